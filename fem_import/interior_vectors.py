"""What describes the inside of a part between its frames: fixed- and free-interface modes, corrections."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from fem_import.errors import ReductionError
from fem_import.fe_model import FEModel
from fem_import.interfaces import TiedInterface
from fem_import.interior import Interior
from fem_import.lanczos import lowest_modes
from fem_import.rigid_motion import rigid_motion_at
from fem_import.sparse_blocks import RowParallel
from fem_import.tall_blocks import combine, inner, subtract

FloatArray: TypeAlias = NDArray[np.float64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_MASSLESS = 1e-12  # of a rigid-body motion's mass, scaled to ones on the diagonal
_NEW_DIRECTION = 1e-6  # of a vector's size: what is left over of it beyond modes and the others


@dataclass(frozen=True, eq=False)
class InteriorModes:
    """Vectors (n_interior, k), M-orthonormal, that leave all frames at rest.

    n_below: modes below the cut-off that they stand for; next_frequency: the first such mode above it [Hz], None if
    there is none; eigenvalues (k,) [(rad/s)²] where the vectors are fixed-interface modes themselves, else empty.
    """

    vectors: FloatArray
    n_below: int
    next_frequency: float | None
    eigenvalues: FloatArray


def fixed_interface_modes(interior: Interior, max_frequency: float) -> InteriorModes:
    """Return the modes with all frames held below a cut-off [Hz] (Craig and Bampton, AIAA J. 6(7), 1968)."""
    eigenvalues, modes, n_below = _below(interior.solve, interior.M, max_frequency)
    return InteriorModes(modes[:, :n_below], n_below, _next_frequency(eigenvalues, n_below), eigenvalues[:n_below])


def first_fixed_interface_mode(interior: Interior) -> InteriorModes:
    """Return no vector at all, and the first frequency with all frames held: where a static reduction ends."""
    eigenvalues, _ = lowest_modes(interior.solve, interior.M, lambda _: 0)
    return InteriorModes(np.zeros((len(interior.rows), 0)), 0, _next_frequency(eigenvalues, 0), np.empty(0))


def participating(modes: InteriorModes, shares: FloatArray, minimum: float) -> InteriorModes:
    """Return only the modes whose largest share (k, n_frames) of a frame coordinate's compliance is enough."""
    kept = np.max(shares, axis=1, initial=0.0) >= minimum
    return InteriorModes(modes.vectors[:, kept], modes.n_below, modes.next_frequency, modes.eigenvalues[kept])


def free_interface_modes(
    part: FEModel,
    interfaces: tuple[TiedInterface, ...],
    interior: Interior,
    constraint: FloatArray,
    max_frequency: float,
    is_free: bool,
) -> InteriorModes:
    """Return the elastic modes of the part with its frames free, less what the constraint modes give of them.

    Together with the constraint modes and K_ii^-1 (M R)_i, R the rigid motions, they span what Rubin (AIAA J. 13(8),
    1975) and Craig and Chang (NASA CR-145190, 1977) span by free modes, rigid modes and residual attachment modes: the
    inertia-relief attachment modes are the constraint modes plus six such vectors.

    No other matrix is factored. With the first frame of a free part held (none, where the part is held itself), the
    answer to loads f is the constraint modes' share Psi S^-1 Psi^T f, S their stiffness, plus K_ii^-1 f_i, as
    constraint modes do no work on what leaves the frames at rest; the rigid motion is then taken out in the norm of M.
    """
    mass = RowParallel(part.M)
    bending = constraint[:, 6:] if is_free else constraint
    stiffness = bending.T @ (RowParallel(part.K) @ bending)
    compliance = linalg.inv(0.5 * (stiffness + stiffness.T)) if bending.shape[1] else np.zeros((0, 0))
    rigid = np.zeros((len(part.dofs), 0))
    if is_free:
        rigid = part.rigid_body_motion(part.positions.mean(axis=0))
        gram = rigid.T @ (mass @ rigid)
        scale = 1.0 / np.sqrt(np.where(np.diag(gram) > 0.0, np.diag(gram), 1.0))
        values, axes = linalg.eigh(gram * np.outer(scale, scale))
        if values[0] < _MASSLESS:
            raise ReductionError(
                f"{part.source} has no inertia against one of its rigid-body motions (point masses in a line?), so it "
                "has no modes by itself. Give it some inertia there."
            )
        rigid = rigid @ (scale[:, None] * axes / np.sqrt(values))
    mass_rigid = mass @ rigid

    def solve(loads: FloatArray) -> FloatArray:
        balanced = loads.copy()
        subtract(balanced, mass_rigid, inner(rigid, loads))
        answer = combine(bending, compliance @ inner(bending, balanced))
        answer[interior.rows] += interior.solve(balanced[interior.rows])
        subtract(answer, rigid, inner(mass_rigid, answer))
        return answer

    eigenvalues, modes, n_below = _below(solve, part.M, max_frequency)
    inside = modes[interior.rows, :n_below]
    subtract(inside, constraint[interior.rows], _frame_motion(interfaces, modes[:, :n_below]))
    none = np.zeros((len(interior.rows), 0))
    return InteriorModes(
        new_directions(inside, none, interior), n_below, _next_frequency(eigenvalues, n_below), np.empty(0)
    )


def new_directions(vectors: FloatArray, modes: FloatArray, interior: Interior) -> FloatArray:
    """Return an M-orthonormal basis of what `vectors` add to the M-orthonormal `modes`."""
    mass = RowParallel(interior.M)
    size = np.sqrt(np.einsum("ij,ij->j", vectors, mass @ vectors))
    vectors = vectors[:, size > 0.0] / size[size > 0.0]
    for _ in range(2):
        subtract(vectors, modes, inner(modes, mass @ vectors))
    gram = inner(vectors, mass @ vectors)
    values, directions = np.linalg.eigh(0.5 * (gram + gram.T))
    kept = values > _NEW_DIRECTION**2
    return combine(vectors, directions[:, kept] / np.sqrt(values[kept]))


def rigid_frames(interfaces: tuple[TiedInterface, ...]) -> FloatArray:
    """Return all frames' coordinates (6 per interface, 6) in rigid motion about the first frame."""
    first = interfaces[0].position
    return np.vstack([rigid_motion_at(interface.position, first) for interface in interfaces])


def _below(
    solve: Callable[[FloatArray], FloatArray], M: SparseMatrix, max_frequency: float
) -> tuple[FloatArray, FloatArray, int]:
    cutoff = (2.0 * np.pi * max_frequency) ** 2
    eigenvalues, modes = lowest_modes(solve, M, lambda estimates: int(np.searchsorted(estimates, cutoff)))
    return eigenvalues, modes, int(np.searchsorted(eigenvalues, cutoff))


def _next_frequency(eigenvalues: FloatArray, n_below: int) -> float | None:
    return float(np.sqrt(eigenvalues[n_below])) / (2.0 * np.pi) if n_below < len(eigenvalues) else None


def _frame_motion(interfaces: tuple[TiedInterface, ...], shapes: FloatArray) -> FloatArray:
    """Return the motion (6 per interface, k) of the frames in shapes (N, k)."""
    return np.vstack(
        [
            np.linalg.lstsq(interface.matrix, shapes[interface.rows])[0]
            if interface.tie == "rigid"
            else interface.matrix @ shapes[interface.rows]
            for interface in interfaces
        ]
    )
