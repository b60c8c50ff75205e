"""Abaqus: assembled matrices of *MATRIX OUTPUT with the nodes and sets of the input deck."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from fem_import.errors import ExportError, MissingFileError, UnknownKeywordError, warn_user
from fem_import.fe_model import FEModel
from fem_import.keywords import known_keywords
from fem_import.readers.abaqus_deck import read_abaqus_deck
from fem_import.readers.assembly import LabelledMatrices, mass_beside
from fem_import.readers.long_text import LongText, read_in_turn, texts_of
from fem_import.readers.node_table import Nodes
from fem_import.readers.packed_file import bare_suffix, first_bytes
from fem_import.readers.regular_text import IntArray, regular_labelled_triplets
from fem_import.readers.triangles import full_symmetric
from fem_import.readers.triplets import parse_triplets, printed_digits, refuse_cut_text, refuse_not_finite
from fem_import.units import required_units

PathLike: TypeAlias = "str | os.PathLike[str]"
FloatArray: TypeAlias = NDArray[np.float64]

_LINE = np.dtype(
    [("node1", np.int64), ("dof1", np.int64), ("node2", np.int64), ("dof2", np.int64), ("value", np.float64)]
)
_STIFFNESS_NAME = re.compile(r"^(.*?)_?STIF(\d*)$", re.IGNORECASE)
_MASS_NAMES = (("STIF", "MASS"),)
_HOW_TO_EXPORT = "*MATRIX GENERATE, STIFFNESS, MASS and *MATRIX OUTPUT, STIFFNESS, MASS write both."
_LARGEST_LABEL = 2**55
_MOST_INTERNAL = 3000  # internal DoF that are condensed by a dense factor


@known_keywords(UnknownKeywordError)
def read_abaqus(
    path: PathLike,
    mass: PathLike | None = None,
    *,
    units: str | None = None,
    deck: PathLike | None = None,
    damping: PathLike | None = None,
) -> FEModel:
    """Read matrices that Abaqus wrote by `*MATRIX OUTPUT` as text, FORMAT=MATRIX INPUT, LABELS or COORDINATE.

    Parameters
    ----------
    path : job_STIF1.mtx (gzipped or not), or job.inp with exactly one such file beside it.
    mass, damping : the other matrices; default job_MASS1.mtx beside it, no damping.
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required, as no file says it.
    deck : the .inp with the nodes and sets, flat or with one instance; default job.inp beside the matrix.

    Returns
    -------
    FEModel : SI. Constrained DoF (1e36 on the diagonal) are left out; internal nodes (negative labels) without
        mass are condensed.

    Raises
    ------
    ExportError, MissingFileError, UnknownNameError : what is wrong, where, how to mend it.

    Notes
    -----
    COORDINATE gives row numbers only. They tell nodes where the labels run 1..N and each node has 3 or 6 DoF
    (row = 3 (n - 1) + d); else the export is refused and FORMAT=LABELS is the cure.
    """
    given = Path(path)
    stiffness = _stiffness_of_job(given) if bare_suffix(given) == ".inp" else given
    deck_path = given if deck is None and given != stiffness else Path(deck) if deck is not None else None
    required_units(units, stiffness.name)
    head = first_bytes(stiffness, 4096)
    _refuse_single_elements(head.partition(b"\n")[0], stiffness.name)
    if is_substructure(head):
        raise ExportError(
            f"{stiffness.name} is a substructure, already reduced. Name its retained nodes and it becomes a "
            "ReducedBody: fi.read(path, units=..., interfaces={'base': node label, ...}), or "
            "fi.read_abaqus_substructure."
        )
    mass_path = Path(mass) if mass is not None else mass_beside(stiffness, _MASS_NAMES, _HOW_TO_EXPORT)
    paths = [stiffness, mass_path] + ([Path(damping)] if damping is not None else [])
    texts = texts_of(*paths)
    deck_path = _deck_beside(stiffness) if deck_path is None else deck_path
    nodes = read_abaqus_deck(deck_path)
    matrices = _matrices(paths, texts, nodes, deck_path.name).without_penalties()
    return matrices.model(nodes, str(units), f"Abaqus {stiffness.name}")


def is_substructure(head: bytes) -> bool:
    """Whether a .mtx starts as a linear user element, the form of a substructure's matrices."""
    return any(line.replace(b" ", b"").upper().startswith(b"*USERELEMENT") for line in head.splitlines())


def is_matrix_table(head: bytes) -> bool:
    """Whether a file starts with lines of *MATRIX OUTPUT: three, five or six numbers, and nothing else."""
    lines = [line for line in head.split(b"\n")[:-1] if line.strip()][:3]
    words = [line.replace(b",", b" ").split() for line in lines]
    try:
        [[float(word) for word in line] for line in words]
    except ValueError:
        return False
    return bool(lines) and len({len(line) for line in words}) == 1 and len(words[0]) in (3, 5, 6)


def job_has_matrices(deck: Path) -> bool:
    """Whether stiffness matrices of Abaqus lie beside an input deck."""
    return bool(_stiffness_files(deck))


@dataclass(frozen=True, eq=False)
class _Table:
    """Entries of one file: rows and columns are 100 node + DoF where labelled, else base-0 numbers."""

    rows: IntArray
    columns: IntArray
    is_labelled: bool
    values: FloatArray
    digits: int


def _parsed_table(content: LongText, name: str) -> _Table:
    refuse_cut_text(content, name)
    line = content.line_at(0)
    comma = b"," in line
    _refuse_single_elements(line, name)
    if len(line.replace(b",", b" ").split()) == 3:
        text = LongText(bytes(content).translate(bytes.maketrans(b",", b" "))) if comma else content
        triplets = parse_triplets(text, name)
        return _Table(triplets.rows, triplets.columns, False, triplets.values, triplets.digits)
    found = regular_labelled_triplets(content)
    if found is None:
        table = _loaded(content, comma, name)
        for field in ("dof1", "dof2"):
            _refuse_other_dofs(table[field], name)
        if np.any(abs(table["node1"]) > _LARGEST_LABEL) or np.any(abs(table["node2"]) > _LARGEST_LABEL):
            raise ExportError(f"{name}: a node label is no label: the matrix file is damaged.")
        rows, columns = (100 * table[f"node{k}"] + table[f"dof{k}"] for k in (1, 2))
        values = np.ascontiguousarray(table["value"])
    else:
        rows, columns, values = found
    refuse_not_finite(values, name)
    return _Table(rows, columns, True, values, printed_digits(content))


def _refuse_single_elements(line: bytes, name: str) -> None:
    if len(line.replace(b",", b" ").split()) == 6:
        raise ExportError(
            f"{name} has six numbers a line: matrices of single elements, not assembled. Export with *MATRIX GENERATE, "
            "STIFFNESS, MASS without ELEMENT BY ELEMENT."
        )


def _refuse_other_dofs(dofs: IntArray, name: str) -> None:
    if dofs.min() >= 1 and dofs.max() <= 6:
        return
    entry = int(np.flatnonzero((dofs < 1) | (dofs > 6))[0])
    raise ExportError(
        f"{name}, entry {entry + 1}: DoF {dofs[entry]} is neither a displacement (1..3) nor a rotation "
        "(4..6). Warping, temperature, pressure and the like cannot be imported."
    )


def _loaded(content: LongText, comma: bool, name: str) -> NDArray[np.void]:
    """Parse what is not so regular line by line, to say which line is wrong."""
    try:
        return np.loadtxt(
            io.BytesIO(bytes(content)),
            dtype=_LINE,
            comments=None,
            delimiter="," if comma else None,
            ndmin=1,
            encoding="latin-1",
        )
    except (ValueError, OverflowError) as error:
        reason = str(error).splitlines()[0]
        raise ExportError(
            f"{name}: expected lines 'node, dof, node, dof, value' or 'row column value'; {reason} Is the file damaged?"
        ) from None


@dataclass(frozen=True, eq=False)
class _Rows:
    """The DoF (n, 2) of the rows, and where they were labelled, sorted labels and a table of their places if dense."""

    dofs: NDArray[np.int64]
    labels: IntArray | None = None
    places: IntArray | None = None
    lowest: int = 0

    @classmethod
    def of_labels(cls, stiffness: _Table) -> _Rows:
        """Return those on the diagonal of the stiffness: each DoF has one."""
        labels = np.unique(stiffness.rows[stiffness.rows == stiffness.columns]).astype(np.int64)
        if not len(labels):
            labels = np.unique(stiffness.rows[:1]).astype(np.int64)
        dofs = np.column_stack([labels // 100, labels % 100])
        lowest, span = int(labels[0]), int(labels[-1]) - int(labels[0]) + 1
        if span > 100 * len(stiffness.rows):
            return cls(dofs, labels)
        places = np.full(span, -1, dtype=np.int32)
        places[labels - lowest] = np.arange(len(labels), dtype=np.int32)
        return cls(dofs, labels, places, lowest)

    def numbers(self, labels: IntArray, stiffness: str) -> IntArray:
        """Return the row of each label; raise ExportError for one without."""
        if self.labels is None:
            return labels
        if self.places is None:
            found: IntArray = np.searchsorted(self.labels, labels).clip(max=len(self.labels) - 1)
            unknown = self.labels[found] != labels
        else:
            places = labels - self.lowest
            found = self.places.take(places, mode="clip")  # the ends are there, so what is beyond them is not
            unknown = (found < 0) | (places < 0) | (places >= len(self.places))
        for entry in np.flatnonzero(unknown)[:1]:
            node, direction = divmod(int(labels[entry]), 100)
            _refuse_no_diagonal(stiffness, node, direction)
        return found


def _matrices(paths: list[Path], texts: Iterator[LongText], nodes: Nodes, deck_name: str) -> LabelledMatrices:
    names = [path.name for path in paths]
    digits: list[int] = []
    rows: list[_Rows] = []

    def parsed(given: tuple[Path, LongText]) -> tuple[str, _Table]:
        name, text = given[0].name, given[1]
        table = _parsed_table(text, name)
        if not rows:
            if table.is_labelled:
                rows.append(_Rows.of_labels(table))
                _refuse_renumbered(rows[0].dofs[:, 0], nodes, name, deck_name)
            else:
                rows.append(_Rows(_dofs_by_row_number(table, name, nodes, deck_name)))
        if table.is_labelled != (rows[0].labels is not None):
            raise ExportError(f"{names[0]} and {name} are in different formats (with and without node labels).")
        digits.append(table.digits)
        return name, table

    def assembled(given: tuple[str, _Table]) -> tuple[sparse.csr_array, bool]:
        name, table = given
        first, second = (rows[0].numbers(labels, names[0]) for labels in (table.rows, table.columns))
        return full_symmetric(first, second, table.values, len(rows[0].dofs), name, "either")

    made = read_in_turn(paths, texts, parsed, assembled)
    full, dofs = [matrix for matrix, _ in made], rows[0].dofs
    for row in np.flatnonzero(full[0].diagonal() == 0.0)[:1]:
        _refuse_no_diagonal(names[0], *dofs[row])
    _warn_of_massless_end(full[1], dofs, names[1])
    matrices = LabelledMatrices(
        K=full[0],
        M=full[1],
        C=full[2] if len(full) > 2 else None,
        dofs=dofs,
        digits=min(digits),
        of_one_triangle=all(of_one for _, of_one in made),
    )
    return _condensed(matrices, names[0])


def _refuse_no_diagonal(name: str, node: int, direction: int) -> NoReturn:
    raise ExportError(
        f"{name} has nothing on the diagonal of node {node}, DoF {direction}: the file is truncated, or the mass is of "
        "another run. Export again."
    )


def _dofs_by_row_number(table: _Table, name: str, nodes: Nodes, deck_name: str) -> NDArray[np.int64]:
    size = int(max(table.rows.max(), table.columns.max())) + 1
    n_nodes = len(nodes.labels)
    each, rest = divmod(size, n_nodes)
    if rest or each not in (3, 6) or not np.array_equal(np.sort(nodes.labels), np.arange(1, n_nodes + 1)):
        raise ExportError(
            f"{name} has {size} numbered rows without labels, and the {n_nodes} nodes of {deck_name} (labels "
            f"{nodes.labels.min()} to {nodes.labels.max()}) do not tell which is which: that needs labels 1..N with 3 "
            "or 6 "
            "DoF each. Export with *MATRIX OUTPUT, STIFFNESS, MASS, FORMAT=LABELS."
        )
    return np.column_stack([np.repeat(np.arange(1, n_nodes + 1), each), np.tile(np.arange(1, each + 1), n_nodes)])


def _refuse_renumbered(labels: IntArray, nodes: Nodes, name: str, deck_name: str) -> None:
    """Labels 1..N in the matrix and others in the deck: Abaqus has numbered the instance's nodes anew."""
    in_matrix = np.unique(labels[labels > 0])
    in_order = np.array_equal(in_matrix, np.arange(1, len(in_matrix) + 1))
    if in_order and len(in_matrix) == len(nodes.labels) and not np.array_equal(in_matrix, np.sort(nodes.labels)):
        raise ExportError(
            f"{name} numbers its nodes 1..{len(in_matrix)}, {deck_name} does not: Abaqus has numbered the nodes of the "
            "instance anew. Write a flat deck (mdb.models[name].setValues(noPartsInputFile=ON)) and export with it."
        )


def _warn_of_massless_end(mass: sparse.csr_array, dofs: IntArray, name: str) -> None:
    """A file without a declared length that breaks off at a line's end shows by what is missing at its end."""
    diagonal = mass.diagonal()
    massless = np.flatnonzero((diagonal == 0.0) & (dofs[:, 1] <= 3) & (dofs[:, 0] > 0))
    if len(massless) and np.any(diagonal):
        row = int(massless[0])
        warn_user(
            f"{name}: {len(massless)} displacements have no mass, first node {dofs[row, 0]}, DoF {dofs[row, 1]}. "
            "Reference nodes and springs have none; of a meshed part it means that the file is cut."
        )


def _condensed(matrices: LabelledMatrices, name: str) -> LabelledMatrices:
    """Eliminate the internal nodes (negative labels, no position) statically, where they have no mass.

    K_rr - K_ri K_ii^-1 K_ir is exact for massless DoF (Guyan 1965).
    """
    internal = np.flatnonzero(matrices.dofs[:, 0] < 1)
    if not len(internal):
        return matrices
    node = matrices.dofs[internal[0], 0]
    cure = (
        "Use elements without internal nodes (B31 instead of B33, C3D8 instead of the hybrid C3D8H) and export again, "
        "or "
        "export a substructure."
    )
    if node == 0:
        raise ExportError(f"{name} has rows of node 0, which is no node. Is the file damaged?")
    if any(np.diff(matrix.indptr)[internal].any() for matrix in (matrices.M, matrices.C) if matrix is not None):
        raise ExportError(
            f"{name} has internal node {node} with mass or damping ({len(internal)} such DoF). It has no position and "
            "cannot "
            f"be condensed exactly. {cure}"
        )
    if len(internal) > _MOST_INTERNAL:
        raise ExportError(
            f"{name} has {len(internal)} DoF of internal nodes such as {node}, too many to condense. {cure}"
        )
    kept = np.setdiff1d(np.arange(len(matrices.dofs)), internal)
    rows = sparse.csr_array(matrices.K[internal])
    inner = rows[:, internal].toarray()
    coupling = sparse.csr_array(rows[:, kept])
    touched = np.unique(coupling.indices)
    try:
        factor = linalg.cho_factor(inner)
    except linalg.LinAlgError:
        raise ExportError(
            f"{name}: the stiffness of internal nodes such as {node} is not positive definite (Lagrange multipliers of "
            f"a hybrid element?), so they cannot be condensed. {cure}"
        ) from None
    dense = coupling[:, touched].toarray()
    update = dense.T @ linalg.cho_solve(factor, dense)
    spread = sparse.coo_array(
        (update.ravel(), (np.repeat(touched, len(touched)), np.tile(touched, len(touched)))),
        shape=(len(kept), len(kept)),
    )

    def outer(matrix: sparse.csr_array) -> sparse.csr_array:
        return sparse.csr_array(sparse.csr_array(matrix[kept])[:, kept])

    return LabelledMatrices(
        K=sparse.csr_array(outer(matrices.K) - spread),
        M=outer(matrices.M),
        C=None if matrices.C is None else outer(matrices.C),
        dofs=matrices.dofs[kept],
        digits=matrices.digits,
    )


def _bare_stem(path: Path) -> str:
    return (path.with_suffix("") if path.suffix.lower() == ".gz" else path).stem


def _stiffness_files(deck: Path) -> list[Path]:
    stem = _bare_stem(deck).casefold()
    found = []
    for candidate in sorted(deck.parent.glob("*.mtx*")):
        match = _STIFFNESS_NAME.match(_bare_stem(candidate))
        if match is not None and match[1].casefold() == stem and bare_suffix(candidate) == ".mtx":
            found.append(candidate)
    return found


def _stiffness_of_job(deck: Path) -> Path:
    if not deck.exists():
        raise MissingFileError(f"{deck} does not exist.")
    found = _stiffness_files(deck)
    if not found:
        raise MissingFileError(f"{_bare_stem(deck)}_STIF1.mtx is not beside {deck.name}. {_HOW_TO_EXPORT}")
    if len(found) > 1:
        raise ExportError(
            f"Beside {deck.name} there are {', '.join(item.name for item in found)}. Give the one to read."
        )
    return found[0]


def _deck_beside(stiffness: Path) -> Path:
    match = _STIFFNESS_NAME.match(_bare_stem(stiffness))
    if match is None:
        raise MissingFileError(f"{stiffness.name} does not tell the name of its input deck. Give deck=.")
    for ending in (".inp", ".inp.gz"):
        candidate = stiffness.with_name(match[1] + ending)
        if candidate.is_file():
            return candidate
    raise MissingFileError(f"{match[1]}.inp is not beside {stiffness.name}: node positions and sets. Give deck=.")
