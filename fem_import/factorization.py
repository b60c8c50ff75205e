"""The sparse direct solver, chosen once for the whole package.

PARDISO of MKL where the `mkl` wheel is installed (x86-64 Linux and Windows), SuperLU of scipy elsewhere; both
with the nested-dissection order of `ordering` where pymetis is installed. `Factorization.solver` says which.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import sparse

from fem_import import mkl, ordering, pardiso
from fem_import.errors import ReductionError
from fem_import.memory import physical_memory
from fem_import.mixed_precision import MixedPrecisionFactor
from fem_import.pardiso import FactorTooLargeError, PardisoError, PardisoFactor
from fem_import.superlu import SuperLUFactor

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

# What a factor in double precision may take of the memory, as K, M and some hundred vectors need as much again as a
# third of it; and one in single precision.
_SHARE_IN_DOUBLE, _LARGEST_SHARE = 0.5, 0.7
_GROWTH_LIMIT = 1e13  # of the diagonally scaled matrix: beyond, fewer than three digits of a double remain


@dataclass(frozen=True, eq=False)
class Factorization:
    """A factored symmetric matrix (n, n); `solver` says by what.

    n_negative: how many of its eigenvalues are negative; None where the solver cannot tell.
    """

    size: int
    solver: str
    n_negative: int | None
    _factor: PardisoFactor | MixedPrecisionFactor | SuperLUFactor | None  # None of an empty matrix

    def solve(self, right_sides: FloatArray) -> FloatArray:
        """Return A^-1 B for B (n, k), all columns in one call: blocks run at BLAS-3 speed."""
        if self._factor is None or right_sides.shape[1] == 0:
            return np.zeros_like(right_sides)
        return self._factor.solve(right_sides)


def factorize(
    matrix: SparseMatrix, what: str = "the stiffness", order: IntArray | None = None, definite: bool = True
) -> Factorization:
    """Factor a symmetric sparse matrix.

    Parameters
    ----------
    matrix
        (n, n), full, or its upper triangle alone, which saves the copy of it that PARDISO needs.
    what
        Names the matrix in errors.
    order
        Rows in the order in which to eliminate them, from `ordering`; by default found on the graph of the
        rows, which takes longer than on that of the nodes.
    definite
        Whether the matrix must be positive definite; False serves to count its negative eigenvalues.

    Raises
    ------
    ReductionError
        If the matrix is singular, not definite though it must be, or does not fit into memory.
    """
    size = matrix.shape[0]
    order = _order_of_rows(matrix) if order is None and size else order
    solver = _name(order is not None)
    if size == 0:
        return Factorization(0, solver, 0, None)
    upper = _upper_triangle(matrix)
    diagonal = upper.diagonal()
    if definite and np.any(diagonal <= 0.0):
        raise ReductionError(f"{what} is not positive definite: {diagonal.min():.3g} on its diagonal.")
    factor: PardisoFactor | MixedPrecisionFactor | SuperLUFactor
    try:
        factor = _by_pardiso(upper, order, definite) if mkl.is_available() else SuperLUFactor(upper, order)
    except FactorTooLargeError as error:
        raise ReductionError(
            f"{what} ({size} DoF) does not fit into memory when factored, even in single precision: "
            f"{error.size * 1e-9:.3g} GB of {physical_memory() * 1e-9:.3g} GB. Use a machine with more memory, or a "
            "coarser mesh away from the interfaces."
        ) from None
    except (PardisoError, RuntimeError) as error:
        raise ReductionError(_singular(what, str(error))) from None
    except MemoryError:
        raise ReductionError(f"{what} ({size} DoF) does not fit into memory when factored.") from None
    _refuse_singular(upper, diagonal, factor, what, definite)
    if isinstance(factor, MixedPrecisionFactor):
        solver += ", in single precision for want of memory, refined to double"
    # Asking SuperLU for the count copies its U, so only where it is the question.
    return Factorization(size, solver, 0 if definite else factor.n_negative, factor)


def _by_pardiso(upper: SparseMatrix, order: IntArray | None, definite: bool) -> PardisoFactor | MixedPrecisionFactor:
    if not definite:
        return PardisoFactor(upper, pardiso.INDEFINITE, order)
    memory = physical_memory()
    try:
        return PardisoFactor(upper, pardiso.POSITIVE_DEFINITE, order, _SHARE_IN_DOUBLE * memory)
    except FactorTooLargeError as error:
        in_double = error.size
    try:
        return MixedPrecisionFactor(upper, order, _LARGEST_SHARE * memory)
    except ReductionError:  # slender parts may be too ill-conditioned for it
        if in_double > _LARGEST_SHARE * memory:
            raise
    return PardisoFactor(upper, pardiso.POSITIVE_DEFINITE, order)


def _name(has_order: bool) -> str:
    if mkl.is_available():
        order = "METIS on nodes" if has_order else "its own METIS"
        return f"PARDISO (MKL {mkl.version()}), {order}"
    order = "METIS on nodes" if has_order else "MMD_AT_PLUS_A (pymetis is not installed)"
    return f"SuperLU (scipy {scipy.__version__}), {order}; MKL is not installed"


def _order_of_rows(matrix: SparseMatrix) -> IntArray | None:
    if mkl.is_available():
        return None  # PARDISO orders rows by a METIS of its own
    rows = np.arange(matrix.shape[0])
    return ordering.elimination_order(ordering.node_graph(matrix, rows), rows)


def _upper_triangle(matrix: SparseMatrix) -> SparseMatrix:
    """Return the upper triangle with all of the diagonal stored; the matrix itself if it is that already."""
    if not matrix.has_sorted_indices:
        matrix = matrix.sorted_indices()
    first = matrix.indptr[:-1]
    rows = np.arange(matrix.shape[0])
    is_upper = bool(np.all(np.diff(matrix.indptr) > 0)) and bool(np.all(matrix.indices[first] == rows))
    if is_upper:
        return matrix
    upper = sparse.csr_array(sparse.triu(matrix, format="csr"))
    if upper.nnz and np.all(np.diff(upper.indptr) > 0) and np.all(upper.indices[upper.indptr[:-1]] == rows):
        return upper
    upper = sparse.csr_array(upper + 0.0 * sparse.eye_array(len(rows)))
    upper.setdiag(upper.diagonal())  # stores what is zero, which PARDISO wants to see
    upper.sort_indices()
    return upper


def _refuse_singular(
    upper: SparseMatrix,
    diagonal: FloatArray,
    factor: PardisoFactor | MixedPrecisionFactor | SuperLUFactor,
    what: str,
    definite: bool,
) -> None:
    """Solve once for a known load: a singular matrix passes the factorization and gives garbage silently.

    Judged as if the diagonal were all ones, so that rotations in rad and translations in m weigh the same.
    """
    scale = 1.0 / np.sqrt(np.where(diagonal == 0.0, 1.0, abs(diagonal)))[:, None]
    load = np.random.default_rng(7).standard_normal((len(diagonal), 1))
    answer = factor.solve(load / scale)
    if not np.all(np.isfinite(answer)):
        raise ReductionError(_singular(what, "a solve is not finite"))
    product = upper @ answer + upper.T @ answer - diagonal[:, None] * answer
    answer /= scale
    growth = float(np.linalg.norm(answer) / np.linalg.norm(load))
    error = float(np.linalg.norm(scale * product - load))
    residual = error / float(np.linalg.norm(load) + 1e-6 * np.linalg.norm(answer))
    energy = float((load.T @ answer)[0, 0])
    if growth > _GROWTH_LIMIT or residual > 1e-6 or (definite and energy <= 0.0):
        raise ReductionError(_singular(what, f"solution grows by {growth:.1e}, residual {residual:.1e}"))


def _singular(what: str, detail: str) -> str:
    return (
        f"{what} is singular or not positive definite ({detail}): some of the part can still move freely with "
        "the interfaces held. A loose piece, a mechanism, or an interface that misses its part?"
    )
