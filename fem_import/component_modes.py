"""Reduction bases with rigid and averaged interfaces, and the part's matrices in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fem_import.errors import ReductionError
from fem_import.fe_model import FEModel
from fem_import.interfaces import TiedInterface
from fem_import.interior import Interior
from fem_import.interior_vectors import (
    InteriorModes,
    first_fixed_interface_mode,
    fixed_interface_modes,
    free_interface_modes,
    new_directions,
    participating,
    rigid_frames,
)
from fem_import.progress import Progress
from fem_import.rigid_motion import rigid_motion_at
from fem_import.sensor_points import ObservedPoint
from fem_import.sparse_blocks import RowParallel
from fem_import.tall_blocks import combine, inner

FloatArray: TypeAlias = NDArray[np.float64]

METHODS = ("craig-bampton", "craig-chang", "guyan")
_COLUMNS_AT_ONCE = 12
_DEGENERATE = 1e-9  # relative distance of eigenvalues that are one to rounding


@dataclass(frozen=True)
class Recipe:
    """What a basis is made of.

    method: one of METHODS; max_frequency: cut-off [Hz]; inertia_vectors: add K_ii^-1 (M Psi_c)_i, the first
    correction of the constraint modes for inertia (at equal size the error below half the cut-off was measured 75
    times smaller); min_participation: least share of a fixed-interface mode in what the frames feel of the inside.
    """

    method: str
    max_frequency: float
    inertia_vectors: bool
    min_participation: float


@dataclass(frozen=True, eq=False)
class ComponentModes:
    """A reduction basis and the matrices in it.

    basis (N, n): columns are the six constraint modes of each interface, then the interior modes; M, K (n,
    n), C (n, n) or None; mass_times_basis (N, n); frequencies of the interior modes [Hz], K's interior block
    is (2 pi f)^2 and M's is 1; n_below: modes of the method below the cut-off; next_frequency: the first one
    above it [Hz], None if there is none; solver: what factored; dynamic_compliance (n, n):
    (M Psi)_i^T K_ii^-1 (M Psi)_i, from which `frequency_errors` estimates what the missing modes would change.
    """

    basis: FloatArray
    M: FloatArray
    K: FloatArray
    C: FloatArray | None
    mass_times_basis: FloatArray
    frequencies: FloatArray
    n_below: int
    next_frequency: float | None
    solver: str
    dynamic_compliance: FloatArray


def component_modes(
    part: FEModel,
    interfaces: tuple[TiedInterface, ...],
    sensors: tuple[ObservedPoint, ...],
    recipe: Recipe,
    is_free: bool,
    progress: Progress,
) -> ComponentModes:
    """Reduce a part by component mode synthesis; BLAS is best on one thread (`one_blas_thread`).

    Constraint modes minimise the strain energy for unit frames; all other vectors have all frames at zero, with
    averaged frames both in the constrained sense of `Interior`. K is then block diagonal in either tie and by any
    method. A sensor point adds its attachment modes K_ii^-1 A^T: with them its static compliance, to loads on it and
    on the frames alike, is exact.

    Of a free part the constraint modes of the first frame are what rigid motion and the other frames leave,
    and K is expressed in displacements relative to the first frame. Exact K does both by itself; printed
    digits leave K R of some 1e-13 of K, which puts rigid-body modes at a fraction of a hertz, and this takes
    it out: K R = 0 and R^T M R keeps mass and inertia to rounding.
    """
    progress.stage("factoring the stiffness")
    interior = Interior(part, interfaces, is_free)
    progress.stage("constraint modes")
    constraint = _constraint_modes(part, interfaces, interior, is_free)
    mass, stiffness = RowParallel(part.M), RowParallel(part.K)
    mass_constraint = mass @ constraint
    corrections = interior.solve(mass_constraint[interior.rows])

    progress.stage(f"modes below {recipe.max_frequency:g} Hz")
    if recipe.method == "craig-bampton":
        modes = fixed_interface_modes(interior, recipe.max_frequency)
        if recipe.min_participation > 0.0:
            modes = participating(
                modes, _participation(modes, corrections, mass_constraint[interior.rows]), recipe.min_participation
            )
    elif recipe.method == "craig-chang":
        modes = free_interface_modes(part, interfaces, interior, constraint, recipe.max_frequency, is_free)
    else:
        modes = first_fixed_interface_mode(interior)
    vectors = _interior_basis(modes, corrections, interior, interfaces, sensors, recipe, is_free)

    progress.stage("projection")
    n_frames = constraint.shape[1]
    basis = np.zeros((len(part.dofs), n_frames + vectors.shape[1]), order="F")
    basis[:, :n_frames] = constraint
    basis[interior.rows, n_frames:] = vectors
    eigenvalues, n_below, next_frequency = modes.eigenvalues, modes.n_below, modes.next_frequency
    del vectors, modes
    mass_times_basis = np.empty_like(basis, order="F")
    mass_times_basis[:, :n_frames] = mass_constraint
    mass_times_basis[:, n_frames:] = mass @ basis[:, n_frames:]
    dynamic = _dynamic_compliance(interior, corrections, mass_times_basis, eigenvalues)
    rotation, eigenvalues = _diagonal(basis[:, n_frames:], mass_times_basis[:, n_frames:], stiffness)
    rotation = rotation @ _reproducible_axes(combine(basis[:, n_frames:], rotation), eigenvalues)
    for columns in (basis[:, n_frames:], mass_times_basis[:, n_frames:]):
        combine(columns, rotation, out=columns)
    turn = linalg.block_diag(np.eye(n_frames), rotation)
    C = None if part.C is None else _symmetric(basis.T @ (part.C @ basis))
    return ComponentModes(
        basis=basis,
        M=_reduced_mass(basis, mass_times_basis, n_frames),
        K=_reduced_stiffness(stiffness, interfaces, constraint, eigenvalues, is_free),
        C=C,
        mass_times_basis=mass_times_basis,
        frequencies=np.sqrt(eigenvalues) / (2.0 * np.pi),
        n_below=n_below,
        next_frequency=next_frequency,
        solver=interior.solver,
        dynamic_compliance=_symmetric(turn.T @ dynamic @ turn),
    )


def _interior_basis(
    modes: InteriorModes,
    corrections: FloatArray,
    interior: Interior,
    interfaces: tuple[TiedInterface, ...],
    sensors: tuple[ObservedPoint, ...],
    recipe: Recipe,
    is_free: bool,
) -> FloatArray:
    """Return the interior vectors (n_interior, k) of a method, M-orthonormal, its modes first."""
    if recipe.method == "guyan":
        return modes.vectors
    added = []
    if recipe.inertia_vectors:
        added.append(corrections)
    elif recipe.method == "craig-chang" and is_free:
        added.append(corrections @ rigid_frames(interfaces))
    if sensors:
        added.append(_attachment_modes(interior, sensors))
    if not added:
        return modes.vectors
    return np.hstack([modes.vectors, new_directions(np.hstack(added), modes.vectors, interior)])


def _attachment_modes(interior: Interior, sensors: tuple[ObservedPoint, ...]) -> FloatArray:
    """Return K_ii^-1 A^T (n_interior, 3 or 6 a sensor): deflections under unit loads at the sensor points."""
    place = {int(row): index for index, row in enumerate(interior.rows)}
    loads = np.zeros((len(interior.rows), sum(len(sensor.matrix) for sensor in sensors)))
    first = 0
    for sensor in sensors:
        for row, column in zip(sensor.rows.tolist(), sensor.matrix.T, strict=True):
            if row in place:  # what sits on a rigid interface moves with its frame already
                loads[place[row], first : first + len(column)] += column
        first += len(sensor.matrix)
    return interior.solve(loads)


def _participation(modes: InteriorModes, corrections: FloatArray, mass_constraint: FloatArray) -> FloatArray:
    """Return the share (k, n_frames) of each fixed-interface mode in the dynamic compliance of each frame coordinate.

    To the frames the inside answers with omega^4 (M Psi)_i^T K_ii^-1 (M Psi)_i beyond its static mass, to first
    order; mode r holds (phi_r^T M Psi)^2 / lambda_r of it, and all modes together hold all of it.
    """
    factors = modes.vectors.T @ mass_constraint
    whole = np.einsum("ij,ij->j", corrections, mass_constraint)
    shares = factors**2 / modes.eigenvalues[:, None]
    return np.asarray(np.divide(shares, whole, out=np.zeros_like(shares), where=whole > 0.0))


def _constraint_modes(
    part: FEModel, interfaces: tuple[TiedInterface, ...], interior: Interior, is_free: bool
) -> FloatArray:
    """Return (N, 6 per interface): the part's deflection per unit motion of each frame, the others held."""
    modes = np.zeros((len(part.dofs), 6 * len(interfaces)))
    averages = np.zeros((interior.n_averaged, modes.shape[1]))
    average = 0
    for index, interface in enumerate(interfaces):
        columns = slice(6 * index, 6 * index + 6)
        if interface.tie == "rigid":
            modes[interface.rows, columns] = interface.matrix
        else:
            averages[average : average + 6, columns] = np.eye(6)
            average += 6
    solved = slice(6 if is_free else 0, None)
    loads = np.zeros_like(modes[:, solved])
    for index, interface in enumerate(interfaces):
        if interface.tie == "rigid" and not (is_free and index == 0):
            # The tied rows of the symmetric K are its columns: -K_ib T without a product over all of K.
            of_frame = part.K[interface.rows].T @ interface.matrix
            loads[:, 6 * index - solved.start : 6 * index - solved.start + 6] = -of_frame
    modes[interior.rows, solved] = interior.solve(loads[interior.rows], averages[:, solved])
    if is_free:
        first = interfaces[0].position
        modes[:, :6] = part.rigid_body_motion(first)
        for index, interface in enumerate(interfaces[1:], start=1):
            columns = slice(6 * index, 6 * index + 6)
            modes[:, :6] -= modes[:, columns] @ rigid_motion_at(interface.position, first)
        # What the subtraction leaves on other rigid frames is rounding; those rows are zero by definition.
        for interface in interfaces[1:]:
            if interface.tie == "rigid":
                modes[interface.rows, :6] = 0.0
    return modes


def _dynamic_compliance(
    interior: Interior, corrections: FloatArray, mass_times_basis: FloatArray, eigenvalues: FloatArray
) -> FloatArray:
    """Return (M Psi)_i^T K_ii^-1 (M Psi)_i with one solve for the inertia vectors in the basis alone.

    corrections: K_ii^-1 (M Psi_c)_i. The eigenmodes, next in the basis, are orthogonal to what follows, and
    K_ii^-1 M takes them to themselves over their eigenvalues.
    """
    n_frames, n_known = corrections.shape[1], corrections.shape[1] + len(eigenvalues)
    size = mass_times_basis.shape[1]
    dynamic = np.zeros((size, size))
    dynamic[:n_frames] = inner(corrections, mass_times_basis[interior.rows])
    dynamic[:, :n_frames] = dynamic[:n_frames].T
    dynamic[range(n_frames, n_known), range(n_frames, n_known)] = 1.0 / eigenvalues
    loads = mass_times_basis[interior.rows, n_known:]
    dynamic[n_known:, n_known:] = inner(loads, interior.solve(loads))
    return _symmetric(dynamic)


def _diagonal(vectors: FloatArray, mass_times_vectors: FloatArray, K: RowParallel) -> tuple[FloatArray, FloatArray]:
    """Return the rotation of the interior vectors that makes M 1 and K diagonal, with the eigenvalues."""
    if vectors.shape[1] == 0:
        return np.empty((0, 0)), np.empty(0)
    stiffness = _symmetric(_energy(K, vectors))
    mass = _symmetric(inner(vectors, mass_times_vectors))
    eigenvalues, rotation = linalg.eigh(stiffness, mass)
    if eigenvalues[0] <= 0.0:
        raise ReductionError(
            f"The part with its interfaces held has an interior eigenvalue of {eigenvalues[0]:.3g} "
            "(rad/s)^2: the "
            "exported K is not positive definite there. Too few printed digits, or a preload that buckles "
            "the part?"
        )
    return rotation, eigenvalues


def _energy(K: RowParallel, vectors: FloatArray) -> FloatArray:
    """Return V^T K V, a few columns at a time: K V beside V would double the memory."""
    return np.hstack(
        [
            inner(vectors, K @ vectors[:, first : first + _COLUMNS_AT_ONCE])
            for first in range(0, vectors.shape[1], _COLUMNS_AT_ONCE)
        ]
    )


def _reproducible_axes(modes: FloatArray, eigenvalues: FloatArray) -> FloatArray:
    """Return the rotation (k, k) that fixes the axes in clusters of equal eigenvalues and the sign of every mode.

    Within a cluster of m modes, m rows are picked by pivoted QR and the modes made triangular on them: the
    same axes whatever the solver returned. The sign makes the first entry near the largest one positive.
    """
    axes = np.eye(len(eigenvalues))
    start = 0
    for end in range(1, len(eigenvalues) + 1):
        if end < len(eigenvalues) and eigenvalues[end] - eigenvalues[end - 1] < _DEGENERATE * eigenvalues[end]:
            continue
        if end - start > 1:
            rotation, _, _ = linalg.qr(modes[:, start:end].T, mode="economic", pivoting=True)
            axes[start:end, start:end] = rotation
        start = end
    for index in range(len(eigenvalues)):
        column = modes[:, index] if axes[index, index] == 1.0 else modes @ axes[:, index]
        size = abs(column)
        leading = int(np.argmax(size >= 0.9 * size.max()))
        if column[leading] < 0.0:
            axes[:, index] *= -1.0
    return axes


def _reduced_mass(basis: FloatArray, mass_times_basis: FloatArray, n_frames: int) -> FloatArray:
    mass = _symmetric(inner(basis, mass_times_basis))
    mass[n_frames:, n_frames:] = np.eye(basis.shape[1] - n_frames)
    return mass


def _reduced_stiffness(
    K: RowParallel,
    interfaces: tuple[TiedInterface, ...],
    constraint: FloatArray,
    eigenvalues: FloatArray,
    is_free: bool,
) -> FloatArray:
    n_frames = constraint.shape[1]
    stiffness = np.zeros((n_frames + len(eigenvalues),) * 2)
    if is_free:
        others = constraint[:, 6:]
        relative = np.hstack(
            [np.zeros((n_frames - 6, 6)), np.eye(n_frames - 6)],
        )
        for index, interface in enumerate(interfaces[1:]):
            relative[6 * index : 6 * index + 6, :6] = -rigid_motion_at(interface.position, interfaces[0].position)
        frames = relative.T @ _symmetric(others.T @ (K @ others)) @ relative
    else:
        frames = constraint.T @ (K @ constraint)
    stiffness[:n_frames, :n_frames] = _symmetric(frames)
    stiffness[range(n_frames, len(stiffness)), range(n_frames, len(stiffness))] = eigenvalues
    return stiffness


def _symmetric(matrix: FloatArray) -> FloatArray:
    return np.asarray(0.5 * (matrix + matrix.T))
