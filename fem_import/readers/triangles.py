"""Full symmetric matrices of exported entries, of which most programs write one triangle."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ExportError

IntArray: TypeAlias = NDArray[np.int64]
Written: TypeAlias = Literal["one triangle", "both triangles", "either"]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"


def full_symmetric(
    rows: IntArray,
    columns: IntArray,
    values: NDArray[np.float64],
    size: int,
    name: str,
    written: Written,
) -> SparseMatrix:
    """Return (size, size) with both triangles, without the printed zeros.

    rows, columns: base 0. "one triangle": each pair once, in either order; "either": told by the entries.
    Raises ExportError for entries outside, given twice, or of both triangles where one was declared.
    """
    outside = (rows < 0) | (columns < 0) | (rows >= size) | (columns >= size)
    if np.any(outside):
        entry = int(np.flatnonzero(outside)[0])
        raise ExportError(
            f"{name} has an entry at row {rows[entry] + 1}, column {columns[entry] + 1}, outside {size} x {size}. "
            "Is the file damaged, or of another run than the DoF table?"
        )
    lower, upper = bool(np.any(rows > columns)), bool(np.any(rows < columns))
    if written == "both triangles":
        if lower != upper:
            given = "lower" if lower else "upper"
            raise ExportError(f"{name} is declared with both triangles and holds only the {given} one. Damaged?")
        return _assembled(rows, columns, values, size, name)
    if not (lower and upper):
        return _mirrored(rows, columns, values, size, name)
    if written == "either":
        matrix = _assembled(rows, columns, values, size, name)
        n_pairs = sparse.tril(abs(matrix) + abs(matrix.T), -1).nnz
        if sparse.tril(matrix, -1).nnz + sparse.triu(matrix, 1).nnz > n_pairs:
            return matrix  # both triangles; FEModel refuses what has no mirror image
    first, second = np.minimum(rows, columns), np.maximum(rows, columns)
    return _mirrored(first, second, values, size, name)


def _mirrored(rows: IntArray, columns: IntArray, values: NDArray[np.float64], size: int, name: str) -> SparseMatrix:
    triangle = _assembled(rows, columns, values, size, name)
    return sparse.csr_array(triangle + triangle.T - sparse.diags_array(triangle.diagonal()))


def _assembled(rows: IntArray, columns: IntArray, values: NDArray[np.float64], size: int, name: str) -> SparseMatrix:
    index = np.int32 if size < 2**31 else np.int64
    entries = sparse.coo_array((values, (rows.astype(index), columns.astype(index))), shape=(size, size))
    matrix = sparse.csr_array(entries)
    if matrix.nnz < len(values):
        keys = np.sort(rows * size + columns)
        row, column = divmod(int(keys[np.flatnonzero(np.diff(keys) == 0)[0]]), size)
        raise ExportError(
            f"{name} gives the entry of rows {row + 1} and {column + 1} twice: both triangles where one was declared, "
            "or a damaged file. Export it again."
        )
    matrix.eliminate_zeros()
    return matrix
