"""mode_check(): the reduced body against the full model it came from."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ReductionError, UnknownKeywordError
from fem_import.factorization import factorize
from fem_import.fe_model import FEModel
from fem_import.flexible_modes import flexible_modes
from fem_import.keywords import known_keywords
from fem_import.lanczos import lowest_modes
from fem_import.reduced_body import ReducedBody
from fem_import.rigid_motion import rigid_motion_of_dofs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray: TypeAlias = NDArray[np.float64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_GAP = 1e-4  # relative distance of frequencies between which a count of modes is safe from rounding


@dataclass(frozen=True, eq=False)
class ModeCheck:
    """Flexible modes (rigid-body modes left out) of the part by itself, in ascending order.

    Attributes
    ----------
    full : (k,) the model as exported [Hz].
    tied : (k,) the full model with its rigid interfaces made rigid [Hz].
    reduced : (k,) the reduced body [Hz].
    mac : (k, k) modal assurance criterion, mass-weighted, [tied, reduced]; None for a body loaded from a file. Modes of
        one frequency (the pairs of a symmetric part) have no axes of their own: those of the body are first turned
        onto those of the full model.
    max_frequency : the body's cut-off [Hz].
    missed : modes of the full tied model in this range that are in no list, by a Sturm count; None where the solver
        cannot count. Anything but 0 means that the list is not to be trusted.

    Notes
    -----
    ``differences`` (reduced / tied - 1) is the error of the reduction alone, ``tie_stiffening`` (tied / full - 1)
    what rigid interfaces add; it is 0 with averaged ones.
    """

    full: FloatArray
    tied: FloatArray
    reduced: FloatArray
    mac: FloatArray | None
    max_frequency: float
    missed: int | None

    @property
    def differences(self) -> FloatArray:
        """Relative frequency error of the reduction, (k,)."""
        return np.asarray(self.reduced / self.tied - 1.0)

    @property
    def tie_stiffening(self) -> FloatArray:
        """Relative rise of the frequencies by the rigid interfaces, (k,)."""
        return np.asarray(self.tied / self.full - 1.0)

    def __str__(self) -> str:
        """Return the table of modes."""
        lines = [f"{'mode':>4} {'full [Hz]':>12} {'tied [Hz]':>12} {'reduced [Hz]':>12} {'difference':>11} {'MAC':>7}"]
        for index, (full, tied, reduced) in enumerate(zip(self.full, self.tied, self.reduced, strict=True)):
            mac = "-" if self.mac is None else f"{self.mac[index, index]:.4f}"
            lines.append(
                f"{index + 1:>4} {full:>12.6g} {tied:>12.6g} {reduced:>12.6g} {self.differences[index]:>11.1e} {mac:>7}"
            )
        if self.missed is not None:
            counted = "no mode is missing" if self.missed == 0 else f"{self.missed} modes are missing in this list"
            lines.append(f"     Sturm count: {counted}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the frequency error of the reduction over frequency, with the cut-off; return the axes."""
        from matplotlib import pyplot  # here: drawing is optional and slow to import

        if axes is None:
            axes = pyplot.figure().add_subplot()
        axes.semilogy(self.tied, np.maximum(abs(self.differences), 1e-12), "o", label="reduced against full")
        axes.axvline(self.max_frequency, color="0.4", linestyle="--", label="cut-off")
        axes.set(xlabel="frequency [Hz]", ylabel="relative difference of frequency [-]")
        axes.legend()
        return axes


@known_keywords(UnknownKeywordError)
def mode_check(
    part: FEModel, body: ReducedBody, n_modes: int | None = None, max_frequency: float | None = None
) -> ModeCheck:
    """Compare the flexible modes of a body with those of the full model.

    Parameters
    ----------
    part : the model that the body was reduced from.
    body : of ``fi.reduce``; the MAC needs its basis, which ``save`` leaves out unless told otherwise.
    n_modes : how many flexible modes, or
    max_frequency : up to where [Hz]; all up to the body's cut-off if neither is given.

    Returns
    -------
    ModeCheck.

    Raises
    ------
    ReductionError : something else than a part and a body; the body is not of this part, or no mode lies in the range.

    Notes
    -----
    The full modes come from K + shift M, which can be factored although K of a free part cannot.
    """
    if not isinstance(part, FEModel) or not isinstance(body, ReducedBody):
        raise ReductionError(
            "mode_check takes a fi.FEModel and a fi.ReducedBody of it, in this order; got "
            f"{type(part).__name__} and {type(body).__name__}."
        )
    if body.basis is not None and len(body.basis) != len(part.dofs):
        raise ReductionError(
            f"{body!r} has {len(body.basis)} DoF behind it and the part {len(part.dofs)}: another part."
        )
    if n_modes is not None and max_frequency is not None:
        raise ReductionError("Give n_modes or max_frequency, not both.")
    if n_modes is not None and (not isinstance(n_modes, Integral) or isinstance(n_modes, bool) or n_modes < 1):
        raise ReductionError(f"n_modes must be a whole number above 0; got {n_modes!r}.")
    if max_frequency is not None and not (isinstance(max_frequency, Real) and max_frequency > 0.0):
        raise ReductionError(f"max_frequency must be a positive number of Hz; got {max_frequency!r}.")
    rigid = 6 if body.is_free else 0
    reduced_values, reduced_shapes = flexible_modes(body)
    limit = body.max_frequency if max_frequency is None else max_frequency
    count = int(np.count_nonzero(reduced_values <= limit)) if n_modes is None else min(n_modes, len(reduced_values))
    if count == 0:
        first = f"the first: {reduced_values[0]:.4g} Hz" if len(reduced_values) else "it has none at all"
        raise ReductionError(f"No flexible mode of the body lies below {limit:g} Hz ({first}).")

    shift = (2.0 * np.pi * reduced_values[0]) ** 2
    tie = _tie_matrix(part, body)
    K, M = _project(part.K, tie), _project(part.M, tie)
    found, shapes = _full_modes(K, M, shift, rigid, count)
    missed = _missed(K, M, found, rigid, count)
    tied_frequencies = found[rigid : rigid + count]
    has_rigid_tie = any(frame.tie == "rigid" for frame in body.interfaces.values())
    full = tied_frequencies
    if has_rigid_tie:
        full = _full_modes(part.K, part.M, shift, rigid, count)[0][rigid : rigid + count]
    mac = None
    if body.basis is not None:
        reach = min(len(found) - rigid, reduced_shapes.shape[1])
        clusters = _clusters(found[rigid : rigid + reach], count)
        reach = clusters[-1].stop
        tied_shapes = tie @ shapes[:, rigid : rigid + reach]
        mac = _assurance(tied_shapes, body.basis @ reduced_shapes[:, :reach], part.M, clusters)[:count, :count]
    return ModeCheck(full, tied_frequencies, reduced_values[:count], mac, body.max_frequency, missed)


def _tie_matrix(part: FEModel, body: ReducedBody) -> SparseMatrix:
    """Return L (N, N - tied + 6 per rigid interface): all DoF per free ones and rigid frames."""
    n_dofs = len(part.dofs)
    tied = np.zeros(n_dofs, dtype=bool)
    frames = []
    for frame in body.interfaces.values():
        if frame.tie != "rigid" or len(frame.node_ids) == 0:
            continue
        rows = np.flatnonzero(np.isin(part.dofs[:, 0], frame.node_ids))
        if not np.isin(frame.node_ids, part.dofs[rows, 0]).all():
            raise ReductionError(f"Interface {frame.name!r} of {body!r} names nodes that the part does not have.")
        tied[rows] = True
        motion = rigid_motion_of_dofs(part.positions[part.dof_nodes()[rows]], part.dofs[rows, 1], frame.position)
        block = sparse.lil_array((n_dofs, 6))
        block[rows] = motion
        frames.append(sparse.csr_array(block))
    identity = sparse.csr_array(sparse.eye_array(n_dofs, format="csr")[:, np.flatnonzero(~tied)])
    return sparse.csr_array(sparse.hstack([identity, *frames]))


def _project(matrix: SparseMatrix, tie: SparseMatrix) -> SparseMatrix:
    projected = sparse.csr_array(tie.T @ matrix @ tie)
    return sparse.csr_array(0.5 * (projected + projected.T))


def _full_modes(
    K: SparseMatrix, M: SparseMatrix, shift: float, rigid: int, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return all frequencies and shapes found: rigid ones first, two beyond the count."""
    factor = factorize(sparse.csr_array(K + shift * M), "The shifted stiffness of the full model")
    shifted, shapes = lowest_modes(factor.solve, M, lambda estimates: min(rigid + count + 1, len(estimates)))
    frequencies = np.sqrt(np.maximum(shifted - shift, 0.0)) / (2.0 * np.pi)
    return np.asarray(frequencies), shapes


def _missed(K: SparseMatrix, M: SparseMatrix, found: FloatArray, rigid: int, count: int) -> int | None:
    """Return how many modes below a gap after the counted ones were not found; None where nobody can tell.

    As many eigenvalues lie below lambda as K - lambda M has negative ones (Sylvester's law of inertia).
    """
    last = rigid + count
    while last < len(found) and found[last] < (1.0 + _GAP) * found[last - 1]:
        last += 1
    if last >= len(found):
        return None
    middle = (2.0 * np.pi * 0.5 * (found[last - 1] + found[last])) ** 2
    shifted = sparse.csr_array(sparse.triu(K - middle * M))
    n_below = factorize(shifted, "The stiffness less eigenvalue times mass", definite=False).n_negative
    return None if n_below is None else n_below - last


def _clusters(frequencies: FloatArray, count: int) -> list[slice]:
    """Return the runs of equal frequencies that hold the first `count`, single ones too."""
    apart = np.flatnonzero(np.diff(frequencies) > _GAP * frequencies[1:]) + 1
    edges = [0, *apart.tolist(), len(frequencies)]
    return [slice(start, stop) for start, stop in itertools.pairwise(edges) if start < count]


def _assurance(first: FloatArray, second: FloatArray, M: SparseMatrix, clusters: list[slice]) -> FloatArray:
    """Return the MAC, the second shapes turned within each cluster to agree best with the first (Procrustes)."""
    cross = first.T @ (M @ second)
    for cluster in clusters:
        left, _, right = np.linalg.svd(cross[cluster, cluster])
        turn = (left @ right).T
        cross[:, cluster] = cross[:, cluster] @ turn
        second[:, cluster] = second[:, cluster] @ turn
    own = [np.einsum("ij,ij->j", shapes, M @ shapes) for shapes in (first, second)]
    return np.asarray(cross**2 / np.outer(*own))
