"""SuperLU of scipy for symmetric matrices: what there is where MKL is not."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"


class SuperLUFactor:
    """A symmetric matrix factored by SuperLU with pivots from the diagonal.

    Parameters
    ----------
    upper
        Upper triangle with the whole diagonal (n, n).
    order
        Rows in the order in which to eliminate them (n,); None: minimum degree on the symmetric pattern.

    Raises
    ------
    RuntimeError
        If the matrix is exactly singular.
    MemoryError
        If the factor does not fit.
    """

    def __init__(self, upper: SparseMatrix, order: IntArray | None) -> None:
        strict = sparse.triu(upper, 1, format="csr")
        full = sparse.csr_array(upper + strict.T)
        if order is not None:
            full = full[order][:, order]
        # Symmetric, so the rows of CSR are the columns of CSC; SuperLU takes 32-bit indices only.
        columns = sparse.csc_array(
            (full.data, full.indices.astype(np.intc), full.indptr.astype(np.intc)), shape=full.shape
        )
        self._factor = sparse_linalg.splu(
            columns,
            permc_spec="MMD_AT_PLUS_A" if order is None else "NATURAL",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True, "Equil": False},
        )
        self._order = order

    @property
    def n_negative(self) -> int | None:
        """Number of negative eigenvalues; None if a pivot left the diagonal, as its sign then says nothing."""
        if not np.array_equal(self._factor.perm_r, self._factor.perm_c):
            return None
        return int(np.count_nonzero(self._factor.U.diagonal() < 0.0))

    def solve(self, right_sides: FloatArray) -> FloatArray:
        """Return A^-1 B, (n, k)."""
        if self._order is None:
            return np.asarray(self._factor.solve(np.asfortranarray(right_sides)))
        answer = np.empty(right_sides.shape, order="F")
        answer[self._order] = self._factor.solve(np.asfortranarray(right_sides[self._order]))
        return answer
