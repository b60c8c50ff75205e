"""Ansys' .full file: the assembled matrices as the solver keeps them, binary."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ExportError
from fem_import.readers.assembly import LabelledMatrices
from fem_import.readers.packed_file import read_bytes
from fem_import.readers.triangles import full_symmetric

IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_INSTEAD = "export the matrices as text: HBMAT,name,,,ASCII,STIFF,NO,YES and the same with MASS."
_HEADER_LENGTH = 100
_FULL_FILE = 4  # the first word of the standard header, and of the file's own with the sign changed
_WHOLE, _REAL = 0x80000000, 0x00000000
_WINDOWED = 0x90000000  # whole numbers, runs of equal ones packed

# Places in the file's own header (record 2), base 0; l and h are the low and high words of one number.
_N_EQUATIONS, _N_NODES, _IS_LUMPED, _IS_UNSYMMETRIC, _N_CONSTRAINT_EQUATIONS = 1, 6, 10, 13, 20
_DOFS_AT = (35, 36)


@dataclass(frozen=True)
class _MatrixPlace:
    """Where the header tells a matrix' position and number of terms, as (low, high) places."""

    name: str
    position: tuple[int, int]
    n_terms: tuple[int, int]


_STIFFNESS = _MatrixPlace("stiffness", (18, 19), (8, 9))
_MASS = _MatrixPlace("mass", (26, 27), (33, 21))
_DAMPING = _MatrixPlace("damping", (28, 29), (34, 39))


def read_full(path: Path) -> LabelledMatrices:
    """Read the matrices without the rows of constrained DoF. Raises ExportError, MissingFileError.

    Layout: Ansys Programmer's Reference, "Format of the full file" (fdfull): records of 32-bit words, each
    led by its length and kind and closed by its length; row by row the lower (or upper) triangle, the column
    numbers with the diagonal last, then the values.
    """
    file = _Records(read_bytes(path), path.name)
    standard, place = file.whole_numbers(0, "standard header")
    if len(standard) != _HEADER_LENGTH or standard[0] != _FULL_FILE:
        raise ExportError(f"{path.name} is no .full file of Ansys: its header does not say so.")
    header, place = file.whole_numbers(place, "header")
    if len(header) < _HEADER_LENGTH or header[0] != -_FULL_FILE:
        file.refuse("its own header does not say that it is an assembled matrix file")
    if header[_IS_LUMPED]:
        file.refuse("the mass matrix is lumped. Solve with LUMPM,OFF")
    if header[_IS_UNSYMMETRIC]:
        file.refuse("the matrices are unsymmetric, which no structure at rest has")
    if header[_N_CONSTRAINT_EQUATIONS]:
        raise ExportError(
            f"{path.name}: {header[_N_CONSTRAINT_EQUATIONS]} constraint equations are kept beside the matrices (CE, "
            "CERIG, RBE3, MPC contact). Mesh through, or delete them (CEDELE,ALL), solve again and tie their nodes "
            "here as interfaces."
        )
    n_equations, n_nodes = int(header[_N_EQUATIONS]), int(header[_N_NODES])
    _, place = file.whole_numbers(place, "kinds of DoF")
    nodes, _ = file.whole_numbers(place, "nodes")
    per_node, place = file.whole_numbers(_joined(header, _DOFS_AT), "DoF of each node")
    kinds, _ = file.whole_numbers(place, "kind of each DoF")
    if len(nodes) != n_nodes or len(per_node) != n_nodes or len(kinds) != n_equations or per_node.sum() != n_equations:
        file.refuse(f"{n_nodes} nodes and {n_equations} equations are announced, and the lists are of other lengths")
    directions = abs(kinds)  # a negative kind: constrained
    if np.any(per_node < 0) or np.any((directions < 1) | (directions > 6)):
        file.refuse("it has DoF that are no displacement or rotation (temperature, pressure, warping)")
    dofs = np.column_stack([np.repeat(nodes, per_node), directions])

    stiffness = _matrix(file, header, _STIFFNESS, n_equations)
    mass = _matrix(file, header, _MASS, n_equations)
    damping = _matrix(file, header, _DAMPING, n_equations)
    for name, matrix in (("stiffness", stiffness), ("mass", mass)):
        if matrix is None:
            raise ExportError(
                f"{path.name} holds no {name} matrix: the analysis never formed it. Solve a modal analysis "
                "(ANTYPE,MODAL; "
                "density given) and keep its .full file (EMATWRITE or WRFULL)."
            )
    free = np.flatnonzero(kinds > 0)

    def of_free(matrix: SparseMatrix) -> SparseMatrix:
        return sparse.csr_array(sparse.csr_array(matrix[free])[:, free])

    if not len(free):
        file.refuse("all its DoF are constrained")
    return LabelledMatrices(
        K=of_free(stiffness),  # type: ignore[arg-type]  # None is refused above
        M=of_free(mass),  # type: ignore[arg-type]
        C=None if damping is None else of_free(damping),
        dofs=dofs[free],
        digits=None,
    )


def _matrix(file: _Records, header: IntArray, place: _MatrixPlace, size: int) -> SparseMatrix | None:
    n_terms = _joined(header, place.n_terms)
    at = _joined(header, place.position)
    if n_terms == 0 or at == 0:
        return None
    columns: list[NDArray[np.int32]] = []
    values: list[NDArray[np.float64]] = []
    for row in range(1, size + 1):
        found, at = file.words(at, _WHOLE, place.name)
        numbers, at = file.words(at, _REAL, place.name)
        if 2 * len(found) != len(numbers) or found[-1] != row:
            file.refuse(f"row {row} of the {place.name} matrix does not end with its diagonal")
        columns.append(found)
        values.append(numbers.view("<f8"))
    lengths = [len(found) for found in columns]
    if sum(lengths) != n_terms:
        file.refuse(f"the {place.name} matrix has {sum(lengths)} terms and {n_terms} are announced")
    entries = np.concatenate(values)
    if not np.all(np.isfinite(entries)):
        file.refuse(f"the {place.name} matrix has a value that is not finite")
    rows = np.repeat(np.arange(size, dtype=np.int64), lengths)
    matrix, _ = full_symmetric(
        rows,
        np.concatenate(columns).astype(np.int64) - 1,
        entries,
        size,
        f"{file.name}, {place.name}",
        "one triangle",
    )
    return matrix


def _joined(header: IntArray, places: tuple[int, int]) -> int:
    """Return a number of two 32-bit words."""
    low, high = (int(header[place]) & 0xFFFFFFFF for place in places)
    return low + (high << 32)


class _Records:
    """The records of an Ansys binary file: length, kind, that many words, length again."""

    def __init__(self, content: bytes, name: str) -> None:
        self.name = name
        self._words = np.frombuffer(content[: len(content) // 4 * 4], "<i4")

    def refuse(self, what: str) -> NoReturn:
        raise ExportError(f"{self.name}: {what}. Is the file damaged? If not: {_INSTEAD}")

    def words(self, at: int, kind: int, what: str) -> tuple[NDArray[np.int32], int]:
        """Return the words of the record at word `at`, and where the next record is."""
        words = self._words
        length = int(words[at]) if 0 <= at < len(words) - 2 else -1
        end = at + 2 + length
        if length < 1 or end >= len(words) or words[end] != length:
            self.refuse(f"no record is found at word {at} ({what}), as in a truncated file")
        found = int(words[at + 1]) & 0xFFFFFFFF
        if found != kind:
            self.refuse(f"the record at word {at} ({what}) is packed or of a kind {found:#x} that is not read")
        return words[at + 2 : end], end + 1

    def whole_numbers(self, at: int, what: str) -> tuple[IntArray, int]:
        """Return a record of whole numbers, unpacked where runs of equal ones were packed."""
        if not 0 <= at < len(self._words) - 2 or int(self._words[at + 1]) & 0xFFFFFFFF != _WINDOWED:
            found, after = self.words(at, _WHOLE, what)
            return found.astype(np.int64), after
        packed, after = self.words(at, _WINDOWED, what)
        return self._unpacked(packed.astype(np.int64), what), after

    def _unpacked(self, packed: IntArray, what: str) -> IntArray:
        """Unpack "length, number of windows, then each: start, n and n values, or start, -n and one value"."""
        if len(packed) < 2 or not 0 < packed[0] <= len(self._words):
            self.refuse(f"a packed record ({what}) is of no sensible length")
        result = np.zeros(int(packed[0]), np.int64)
        at = 2
        for _ in range(int(packed[1])):
            if at + 2 >= len(packed):
                self.refuse(f"a packed record ({what}) breaks off")
            start, length = int(packed[at]), int(packed[at + 1])
            n_given = length if length > 0 else 1
            stop = start + abs(length)
            if start < 0 or length == 0 or stop > len(result) or at + 2 + n_given > len(packed):
                self.refuse(f"a packed record ({what}) is not understood")
            result[start:stop] = packed[at + 2 : at + 2 + n_given]
            at += 2 + n_given
        return result
