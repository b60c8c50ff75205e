"""Parts and products of large sparse matrices, without the copies and the single thread of the general ones."""

from __future__ import annotations

import itertools
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.tall_blocks import in_rows
from fem_import.threads import n_threads, side_by_side

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_ROWS_AT_ONCE = 16384  # some 1e6 entries: what is needed beside a matrix stays in the cache
_FEWER_ROWS = 2048  # whose entries themselves stay in it
_WORTH_A_THREAD = 200_000  # entries


class RowParallel:
    """A sparse matrix (n, m) whose product with dense blocks runs on all cores, a range of rows on each.

    Every row is summed by one thread in the same order, so the product does not depend on their number.
    """

    def __init__(self, matrix: SparseMatrix) -> None:
        self._ranges = _shares(matrix)
        self._parts = [_view_of_rows(matrix, first, last) for first, last in self._ranges]
        self.shape = matrix.shape

    def __matmul__(self, block: FloatArray) -> FloatArray:
        """Return the product with a block (m, k), in row order."""
        block = in_rows(block)
        if len(self._parts) == 1:
            return np.asarray(self._parts[0] @ block)
        product = np.empty((self.shape[0], block.shape[1]))

        def multiply(index: int) -> None:
            first, last = self._ranges[index]
            product[first:last] = self._parts[index] @ block

        side_by_side(multiply, range(len(self._parts)))
        return product


def principal_submatrix(matrix: SparseMatrix, rows: IntArray, upper: bool = False) -> SparseMatrix:
    """Return matrix[rows][:, rows] for ascending rows, or of a symmetric matrix its upper triangle alone."""
    new = np.full(matrix.shape[0], -1, dtype=np.int32)
    new[rows] = np.arange(len(rows), dtype=np.int32)
    first_column = np.full(matrix.shape[0], np.iinfo(np.int32).max, dtype=np.int32)  # none in rows left out
    first_column[rows] = new[rows] if upper else 0
    data, indices = np.empty(matrix.nnz), np.empty(matrix.nnz, dtype=np.int32)  # pages never written cost nothing
    counts = np.zeros(len(rows), dtype=np.int64)
    filled = 0
    for first in range(0, matrix.shape[0], _ROWS_AT_ONCE):
        starts = matrix.indptr[first : first + _ROWS_AT_ONCE + 1]
        entries = slice(int(starts[0]), int(starts[-1]))
        lengths = np.diff(starts)
        # All places are inside; to say so ("clip") makes taking twice as fast.
        column = new.take(matrix.indices[entries], mode="clip")
        is_kept = column >= np.repeat(first_column[first : first + _ROWS_AT_ONCE], lengths)
        kept = np.flatnonzero(is_kept)
        end = filled + len(kept)
        matrix.data[entries].take(kept, out=data[filled:end], mode="clip")
        column.take(kept, out=indices[filled:end], mode="clip")
        inside = new[first : first + _ROWS_AT_ONCE]
        # A row without entries would be given those of the next one.
        totals = np.zeros(len(lengths), dtype=np.int64)
        if len(kept):
            totals[lengths > 0] = np.add.reduceat(is_kept, (starts[:-1] - starts[0])[lengths > 0], dtype=np.int64)
        counts[inside[inside >= 0]] = totals[inside >= 0]
        filled = end
    data.resize(filled, refcheck=False)
    indices.resize(filled, refcheck=False)
    starts = np.concatenate([[0], np.cumsum(counts)])
    starts = starts.astype(np.int32 if filled <= np.iinfo(np.int32).max else np.int64)
    part = sparse.csr_array((data, indices, starts), shape=(len(rows), len(rows)))
    if not matrix.has_sorted_indices:
        part.sort_indices()
    return part


def absolute_product(matrix: SparseMatrix, vector: FloatArray) -> FloatArray:
    """Return |A| v without a copy of A."""
    product = np.empty(matrix.shape[0])

    def multiply(share: tuple[int, int]) -> None:
        for first in range(*share, _FEWER_ROWS):
            last = min(first + _FEWER_ROWS, share[1])
            rows = _view_of_rows(matrix, first, last)
            rows.data = abs(rows.data)
            product[first:last] = rows @ vector

    side_by_side(multiply, _shares(matrix))
    return product


def diagonal_of(matrix: SparseMatrix) -> FloatArray:
    """Return the diagonal of a square matrix."""
    diagonal = np.empty(matrix.shape[0])

    def look(share: tuple[int, int]) -> None:
        diagonal[slice(*share)] = _view_of_rows(matrix, *share).diagonal(share[0])

    side_by_side(look, _shares(matrix))
    return diagonal


def _shares(matrix: SparseMatrix) -> list[tuple[int, int]]:
    """Return the rows from and up to which each thread goes, with as many entries on each."""
    count = max(1, min(n_threads(), matrix.nnz // _WORTH_A_THREAD))
    shares = matrix.nnz * np.arange(1, count) // count
    limits = [0, *np.searchsorted(matrix.indptr, shares).tolist(), matrix.shape[0]]
    return list(itertools.pairwise(limits))


def _view_of_rows(matrix: SparseMatrix, first: int, last: int) -> SparseMatrix:
    start, end = int(matrix.indptr[first]), int(matrix.indptr[last])
    rows = sparse.csr_array((last - first, matrix.shape[1]), dtype=matrix.dtype)
    # Given to the constructor, all indices would be looked at once more.
    rows.indptr = matrix.indptr[first : last + 1] - matrix.indptr[first]
    rows.indices, rows.data = matrix.indices[start:end], matrix.data[start:end]
    return rows
