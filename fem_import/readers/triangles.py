"""Full symmetric matrices of exported entries, of which most programs write one triangle."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ExportError
from fem_import.readers.regular_text import IntArray

FloatArray: TypeAlias = NDArray[np.float64]
Written: TypeAlias = Literal["one triangle", "both triangles", "either"]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_BLOCK = 1 << 16  # entries that stay in the cache
_MOST_ROWS_AN_ENTRY = 100  # a declared size is not believed before memory is taken for it


def full_symmetric(
    rows: IntArray,
    columns: IntArray,
    values: FloatArray,
    size: int,
    name: str,
    written: Written,
) -> tuple[SparseMatrix, bool]:
    """Return (size, size) with both triangles, without the printed zeros, and whether one triangle was given.

    rows, columns: base 0. "one triangle": each pair once, in either order; "either": told by the entries. The arrays
    may be used up.
    Raises ExportError for entries outside, given twice, or of both triangles where one was declared.
    """
    refuse_outside(rows, columns, size, name)
    lower, upper = bool(np.any(rows > columns)), bool(np.any(rows < columns))
    if written == "both triangles":
        if lower != upper:
            given = "lower" if lower else "upper"
            raise ExportError(f"{name} is declared with both triangles and holds only the {given} one. Damaged?")
        return _assembled(rows, columns, values, size, name), False
    if not (lower and upper):
        return mirrored(rows, columns, values, size, name), True
    if written == "either":
        matrix = _assembled(rows, columns, values, size, name)
        if _has_both_triangles(matrix):
            return matrix, False  # FEModel refuses what has no mirror image
    first, second = np.minimum(rows, columns), np.maximum(rows, columns)
    return mirrored(first, second, values, size, name), True


def refuse_outside(rows: IntArray, columns: IntArray, size: int, name: str, table: str = "the DoF table") -> None:
    """Raise ExportError for the first entry outside size x size, or for a size far beyond the entries."""
    if size > _MOST_ROWS_AN_ENTRY * len(rows) + 1000:
        raise ExportError(f"{name} declares {size} rows and has {len(rows)} entries. Is the file damaged?")
    if len(rows) and min(rows.min(), columns.min()) >= 0 and max(rows.max(), columns.max()) < size:
        return
    outside = (rows < 0) | (columns < 0) | (rows >= size) | (columns >= size)
    for entry in np.flatnonzero(outside)[:1]:
        raise ExportError(
            f"{name} has an entry at row {rows[entry] + 1}, column {columns[entry] + 1}, outside {size} x {size}. "
            f"Is the file damaged, or of another run than {table}?"
        )


def mirrored(rows: IntArray, columns: IntArray, values: FloatArray, size: int, name: str) -> SparseMatrix:
    """Return one triangle and its mirror image, without the zeros. The arrays may be used up.

    Raises ExportError for an entry given twice.
    """
    values[np.flatnonzero(rows == columns)] *= 0.5
    triangle = _of_ordered(rows, columns, values, size)
    if triangle is None:
        triangle = _of_ordered(columns, rows, values, size)  # as good: the other triangle
    if triangle is None:
        triangle = _of_disordered(rows, columns, values, size, name)
    _drop_zeros(triangle)
    whole = sparse.csr_array(triangle + triangle.T.tocsr())
    whole.has_canonical_format = True  # so nobody needs to look
    return whole


def _has_both_triangles(matrix: SparseMatrix) -> bool:
    """Whether any entry has one at its mirror image."""
    mirror = matrix.T.tocsr()
    if np.array_equal(matrix.indptr, mirror.indptr) and np.array_equal(matrix.indices, mirror.indices):
        return True
    n_pairs = sparse.tril(abs(matrix) + abs(mirror), -1).nnz
    return bool(sparse.tril(matrix, -1).nnz + sparse.triu(matrix, 1).nnz > n_pairs)


def _assembled(rows: IntArray, columns: IntArray, values: FloatArray, size: int, name: str) -> SparseMatrix:
    """Return the matrix of entries; programs mostly print them row by row or column by column already."""
    matrix = _of_ordered(rows, columns, values, size)
    if matrix is None:
        transposed = _of_ordered(columns, rows, values, size)
        matrix = None if transposed is None else sparse.csr_array(transposed.T)
    if matrix is None:
        matrix = _of_disordered(rows, columns, values, size, name)
    _drop_zeros(matrix)
    return matrix


def _drop_zeros(matrix: SparseMatrix) -> None:
    if not matrix.data.all():
        matrix.eliminate_zeros()


def _of_ordered(rows: IntArray, columns: IntArray, values: FloatArray, size: int) -> SparseMatrix | None:
    """Return the matrix of entries that stand in order, row by row, each once; None where they do not."""
    for start in range(0, len(rows), _BLOCK):
        row, column = rows[start : start + _BLOCK + 1], columns[start : start + _BLOCK + 1]
        downwards = row[1:] > row[:-1]
        onwards = column[1:] > column[:-1]
        onwards &= row[1:] == row[:-1]
        downwards |= onwards
        if not downwards.all():
            return None
    index = _index_type(size, len(rows))
    starts = np.searchsorted(rows, np.arange(size + 1, dtype=rows.dtype)).astype(index)
    matrix: SparseMatrix = sparse.csr_array((values, columns.astype(index, copy=False), starts), shape=(size, size))
    matrix.has_canonical_format = True
    return matrix


def _of_disordered(rows: IntArray, columns: IntArray, values: FloatArray, size: int, name: str) -> SparseMatrix:
    index = _index_type(size, len(rows))
    entries = sparse.coo_array((values, (rows.astype(index), columns.astype(index))), shape=(size, size))
    matrix = sparse.csr_array(entries)
    if matrix.nnz < len(values):
        keys = np.sort(rows.astype(np.int64) * size + columns)
        row, column = divmod(int(keys[np.flatnonzero(np.diff(keys) == 0)[0]]), size)
        raise ExportError(
            f"{name} gives the entry of rows {row + 1} and {column + 1} twice: both triangles where one was declared, "
            "or a damaged file. Export it again."
        )
    return matrix


def _index_type(size: int, n_entries: int) -> type[np.int32] | type[np.int64]:
    return np.int32 if max(size, n_entries) < 2**31 else np.int64
