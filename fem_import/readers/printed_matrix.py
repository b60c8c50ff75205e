"""A matrix as a text file prints it, and the full symmetric one made of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.readers.regular_text import IntArray
from fem_import.readers.triangles import Written, full_symmetric

SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"


@dataclass(frozen=True, eq=False)
class PrintedMatrix:
    """A full symmetric matrix, the digits it was printed with, and whether only one triangle was printed."""

    matrix: SparseMatrix
    digits: int
    of_one_triangle: bool


@dataclass(frozen=True, eq=False)
class PrintedEntries:
    """rows, columns (base 0) and values of the entries of a (size, size) matrix; name is the file's in messages."""

    rows: IntArray
    columns: IntArray
    values: NDArray[np.float64]
    size: int
    name: str
    written: Written
    digits: int

    def assembled(self) -> PrintedMatrix:
        """Return the full matrix; the entries are used up. Raises ExportError as `full_symmetric` does."""
        matrix, of_one_triangle = full_symmetric(
            self.rows, self.columns, self.values, self.size, self.name, self.written
        )
        return PrintedMatrix(matrix, self.digits, of_one_triangle)
