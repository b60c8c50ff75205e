"""Nastran: matrices as DMIG in a punch file or by OUTPUT4, whole models and external superelements."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from fem_import.errors import ExportError, MissingFileError, UnknownKeywordError, nearest_known, refuse_unknown_names
from fem_import.fe_model import FEModel
from fem_import.keywords import known_keywords
from fem_import.progress import Progress
from fem_import.readers.assembly import LabelledMatrices, refuse_other_size, warn_of_few_digits
from fem_import.readers.dof_table import DofTable, read_dof_table
from fem_import.readers.nastran_bulk import BulkData, DirectMatrix, parse_bulk
from fem_import.readers.nastran_op4 import parse_op4
from fem_import.readers.node_table import Nodes
from fem_import.readers.packed_file import bare_suffix, read_bytes, text_of
from fem_import.readers.superelement import MODAL, superelement_body
from fem_import.readers.triangles import full_symmetric
from fem_import.readers.triplets import refuse_cut_text
from fem_import.reduced_body import ReducedBody
from fem_import.units import required_units

PathLike: TypeAlias = "str | os.PathLike[str]"
IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_KINDS = ("K", "M", "B")  # stiffness, mass, viscous damping, as Nastran names them
_USUAL_NAMES = ("AAX", "AA", "XX", "GG")  # behind K, M, B: external superelements, the a-set, the g-set
_FIRST_CARDS = (b"DMIG", b"GRID", b"BEGIN", b"CORD", b"EXTRN", b"ASET", b"SPOINT", b"DTI", b"SEBULK")
_SUPERELEMENT_KEYWORDS = ("path", "interfaces", "mass", "names", "bulk", "positions", "units")
_LARGEST_SUPERELEMENT = 20_000


@known_keywords(UnknownKeywordError)
def read_nastran(
    path: PathLike,
    mass: PathLike | None = None,
    *,
    units: str | None = None,
    names: Mapping[str, str] | None = None,
    bulk: PathLike | None = None,
    dofs: PathLike | None = None,
    node_sets: Mapping[str, ArrayLike] | None = None,
) -> FEModel:
    """Read stiffness and mass of a model from DMIG cards (punch file) or OUTPUT4 (text or binary).

    Parameters
    ----------
    path : the .pch or .op4 file, gzipped or not. mass : another one, where the mass matrix is not in the first.
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required.
    names : {"K": name, "M": name, "B": name}; default: the only matrices whose names start so.
    bulk : the bulk data with the GRID cards; default those in the punch file itself.
    dofs : for OUTPUT4 a CSV with node,direction,x,y,z (see read_matrix_market). Default: six rows a grid point of
        the bulk data, in the order of labels, as the g-set has.
    node_sets : {name: grid labels}.

    Returns
    -------
    FEModel : SI. Rows without stiffness and mass (constrained, or rotations of solids) are left out.

    Raises
    ------
    ExportError, MissingFileError, UnknownNameError : what is wrong, where, how to mend it.

    Notes
    -----
    DMIG prints ten digits: rigid-body modes of flexures then rise from zero, and a warning says so. OUTPUT4 in
    binary keeps all.
    """
    source = Path(path)
    required_units(units, source.name)
    files = _Files([source] + ([Path(mass)] if mass is not None else []), bulk, names)
    nodes = files.bulk.nodes
    if files.are_labelled:
        matrices = files.labelled()
        modal = np.flatnonzero(matrices.dofs[:, 1] == MODAL)
        if len(modal):
            raise ExportError(
                f"{source.name} has scalar points such as {matrices.dofs[modal[0], 0]}: modal coordinates of a "
                "superelement, already reduced? Name its boundary grid points and it becomes a ReducedBody: "
                "fi.read(path, units=..., interfaces={'base': grid label, ...}), or fi.read_nastran_superelement."
            )
    else:
        if dofs is not None:
            table = read_dof_table(Path(dofs))
        elif nodes is not None:
            table = _all_six(nodes)
        else:
            raise ExportError(
                f"{source.name} (OUTPUT4) does not say what its rows are. Give bulk=, the file with the GRID cards, "
                "if they are "
                "the g-set (KGG, MGG); else dofs=, a CSV with node,direction,x,y,z."
            )
        matrices = files.numbered(table.dofs)
        nodes = table.nodes
    if nodes is None:
        raise MissingFileError(f"{source.name} holds no GRID cards. Give bulk=, the file that has them.")
    if dofs is None:
        matrices = _in_basic_axes(matrices, files.bulk.axes, source.name)
    return matrices.without_null_rows().model(nodes, str(units), f"Nastran {source.name}", node_sets)


@known_keywords(UnknownKeywordError)
def read_nastran_superelement(
    path: PathLike,
    interfaces: Mapping[str, int],
    mass: PathLike | None = None,
    *,
    units: str | None = None,
    names: Mapping[str, str] | None = None,
    bulk: PathLike | None = None,
    positions: Mapping[int, ArrayLike] | None = None,
) -> ReducedBody:
    """Read an external superelement (EXTSEOUT: KAA, MAA) that Nastran has reduced.

    Parameters
    ----------
    path : the punch file of EXTSEOUT(DMIGPCH,EXTBULK), or KAA and MAA by OUTPUT4.
    interfaces : {name: label of the boundary grid point}, each with components 1 to 6 in the a-set.
    mass : another file, where the mass matrix is not in the first.
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required.
    names : {"K": name, "M": name, "B": name}; default: the only matrices whose names start so.
    bulk, positions : where the grid points are: bulk data, or {label: (x, y, z)}; default the punch file itself.

    Returns
    -------
    ReducedBody : scalar points (component 0) become its modes. In OUTPUT4, which has no labels, the rows are those
        of EXTRN in the bulk data; without it the interfaces come first in the order of their labels and the modes
        after them.

    Raises
    ------
    ExportError, InterfaceError, MissingFileError, UnknownNameError : what is wrong and how to mend it.
    """
    source = Path(path)
    required_units(units, source.name)
    files = _Files([source] + ([Path(mass)] if mass is not None else []), bulk, names)
    if files.are_labelled:
        matrices = files.labelled()
    else:
        table = list(files.bulk.rows)
        if not table:
            boundary = sorted(int(label) for label in interfaces.values())
            table = [(label, direction) for label in boundary for direction in range(1, 7)]
            table += [(number, MODAL) for number in range(1, files.size() - len(table) + 1)]
        matrices = files.numbered(np.array(table, dtype=np.int64).reshape(-1, 2))
    if len(matrices.dofs) > _LARGEST_SUPERELEMENT:
        raise ExportError(f"{source.name}: {len(matrices.dofs)} DoF are no superelement. Read it by fi.read_nastran.")
    if positions is None:
        if files.bulk.nodes is None:
            raise ExportError(f"{source.name} holds no GRID cards. Give bulk= or positions={{label: (x, y, z)}}.")
        positions = dict(zip(files.bulk.nodes.labels.tolist(), files.bulk.nodes.positions, strict=True))
    matrices = _in_basic_axes(matrices, files.bulk.axes, source.name)
    label = f"Nastran superelement {source.name}"
    warn_of_few_digits(matrices.digits, label)
    return superelement_body(
        matrices.K.toarray(),
        matrices.M.toarray(),
        None if matrices.C is None else matrices.C.toarray(),
        matrices.dofs,
        interfaces,
        positions,
        units,
        label,
    )


def _in_basic_axes(
    matrices: LabelledMatrices, axes: Mapping[int, NDArray[np.float64]], source: str
) -> LabelledMatrices:
    """Turn the rows of grid points that have their displacements in a local system (CD)."""
    place = {(node, direction): row for row, (node, direction) in enumerate(matrices.dofs.tolist())} if axes else {}
    blocks: list[tuple[list[int], NDArray[np.float64]]] = []
    for label, directions in axes.items():
        for first in (1, 4):
            rows = [place[label, first + k] for k in range(3) if (label, first + k) in place]
            if len(rows) in (1, 2):
                raise ExportError(
                    f"{source}: GRID {label} has its displacements in a local system (CD) and only {len(rows)} of "
                    "three rows here, which cannot be turned to basic axes. Leave its CD blank and export again."
                )
            if rows:
                blocks.append((rows, directions))
    if not blocks:
        return matrices
    turned = np.concatenate([rows for rows, _ in blocks])
    others = np.setdiff1d(np.arange(len(matrices.dofs)), turned)
    turn: SparseMatrix = sparse.csr_array(
        sparse.coo_array(
            (
                np.concatenate([np.ones(len(others)), *(block.ravel() for _, block in blocks)]),
                (
                    np.concatenate([others, *(np.repeat(rows, 3) for rows, _ in blocks)]),
                    np.concatenate([others, *(np.tile(rows, 3) for rows, _ in blocks)]),
                ),
            ),
            shape=(len(matrices.dofs),) * 2,
        )
    )

    def of_basic(matrix: SparseMatrix) -> SparseMatrix:
        product = turn @ matrix @ turn.T
        return sparse.csr_array((product + product.T) / 2)

    return replace(
        matrices,
        K=of_basic(matrices.K),
        M=of_basic(matrices.M),
        C=None if matrices.C is None else of_basic(matrices.C),
    )


def is_bulk(head: bytes) -> bool:
    """Whether a file starts with the cards of a punch file: DMIG, or those of an external superelement."""
    lines = (line for line in head.splitlines() if line.strip() and not line.startswith(b"$"))
    return next(lines, b"").upper().startswith(_FIRST_CARDS)


@dataclass(frozen=True, eq=False)
class _Entries:
    """One matrix: rows and columns (numbers, or node and component), whether it is one triangle."""

    name: str
    rows: IntArray
    columns: IntArray
    values: NDArray[np.float64]
    digits: int | None
    size: int


class _Files:
    """The matrices of one or two files by kind K, M, B, and the bulk data that goes with them."""

    def __init__(self, paths: list[Path], bulk: PathLike | None, names: Mapping[str, str] | None) -> None:
        refuse_unknown_names("names", names or {}, _KINDS)
        self.are_labelled = bare_suffix(paths[0]) != ".op4"
        self._source = paths[0].name
        self.bulk = BulkData(None, {})
        found: dict[str, _Entries] = {}
        with Progress(f"reading {paths[0].name}", len(paths)) as progress:
            for path in progress.through(paths, (path.name for path in paths)):
                new = self._entries_of(path, paths[0])
                twice = set(found) & set(new)
                if twice:
                    raise ExportError(f"{path.name} gives matrix {sorted(twice)[0]} again.")
                found |= new
        if bulk is not None:
            content = read_bytes(Path(bulk))
            refuse_cut_text(content, Path(bulk).name)
            self.bulk = parse_bulk(text_of(content), Path(bulk).name)
        self._kinds = {kind: _chosen(found, kind, (names or {}).get(kind), self._source) for kind in _KINDS}

    def _entries_of(self, path: Path, first: Path) -> dict[str, _Entries]:
        """Return the matrices of one file by name; also take what it says about nodes."""
        if (bare_suffix(path) != ".op4") != self.are_labelled:
            raise ExportError(f"{first.name} and {path.name} are of different formats. Give both as DMIG or .op4.")
        content = read_bytes(path)
        if self.are_labelled:
            refuse_cut_text(content, path.name)
            read = parse_bulk(text_of(content), path.name)
            self.bulk = replace(read if read.nodes else self.bulk, matrices={})
            return {name: _labelled_entries(name, matrix) for name, matrix in read.matrices.items()}
        new = {}
        for name, matrix in parse_op4(content, path.name).items():
            values = np.full(1, np.nan) if matrix.is_complex else matrix.values
            new[name] = _Entries(name, matrix.rows, matrix.columns, values, matrix.digits, matrix.size)
        return new

    def size(self) -> int:
        return max((entries.size for entries in self._given()), default=0)

    def labelled(self) -> LabelledMatrices:
        """Return the matrices over the union of their DoF, sorted by node and component."""
        keys = np.unique(np.concatenate([part for one in self._given() for part in (one.rows, one.columns)]))
        dofs = np.column_stack([keys >> 3, keys & 7])
        return self._assembled(dofs, keys)

    def numbered(self, dofs: IntArray) -> LabelledMatrices:
        """Return the matrices over given DoF."""
        for one in self._given():
            refuse_other_size(one.size, len(dofs), f"{self._source}, {one.name}", "the DoF table")
        return self._assembled(dofs, None)

    def _given(self) -> list[_Entries]:
        return [entries for entries in self._kinds.values() if entries is not None]

    def _assembled(self, dofs: IntArray, keys: IntArray | None) -> LabelledMatrices:
        def full(kind: str) -> SparseMatrix | None:
            one = self._kinds[kind]
            if one is None:
                return None
            rows, columns = (
                part if keys is None else np.searchsorted(keys, part).astype(np.int64)
                for part in (one.rows, one.columns)
            )
            return full_symmetric(rows, columns, one.values, len(dofs), f"{self._source}, {one.name}", "either")[0]

        stiffness, mass = full("K"), full("M")
        if stiffness is None or mass is None:
            raise ExportError(f"{self._source} lacks a matrix.")  # _chosen has said which
        digits = [one.digits for one in self._given() if one.digits is not None]
        return LabelledMatrices(stiffness, mass, full("B"), dofs, min(digits) if digits else None)


def _labelled_entries(name: str, matrix: DirectMatrix) -> _Entries:
    """Make one whole number of node and component; a form that is no symmetric or square matrix has no entries."""
    if matrix.form not in (1, 6) or not len(matrix.values):
        return _Entries(name, np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0), None, -1)
    rows, columns = matrix.rows, matrix.columns
    for part in (rows, columns):
        wrong = (part[:, 1] < 0) | (part[:, 1] > 6) | (part[:, 0] < 1)
        if np.any(wrong):
            node, component = part[wrong][0]
            raise ExportError(f"Matrix {name} has a row of node {node}, component {component}; components are 0 to 6.")
    return _Entries(
        name,
        rows[:, 0] * 8 + rows[:, 1],
        columns[:, 0] * 8 + columns[:, 1],
        matrix.values,
        matrix.digits,
        0,
    )


def _chosen(found: Mapping[str, _Entries], kind: str, name: str | None, source: str) -> _Entries | None:
    """Return the matrix of that name, or the only one that by its name and form can be of that kind."""
    word = {"K": "stiffness", "M": "mass", "B": "damping"}[kind]
    if name is not None:
        if name.upper() not in found:
            raise ExportError(f"{source} has no matrix {name!r}.{nearest_known(name, found)}")
        candidates = [found[name.upper()]]
    else:
        candidates = _candidates(found, kind)
    if not candidates:
        if kind == "B":
            return None
        raise ExportError(
            f"{source} holds no {word} matrix (a real square one whose name starts with "
            f"{kind}).{nearest_known(kind, found)} "
            + (
                f"Give names={{{kind!r}: ...}}, or mass= if it is in another file."
                if found
                else "A punch file of EXTSEOUT without DMIGPCH has its matrices in the .op4 beside it: read that one, "
                "with this one as bulk=."
            )
        )
    if len(candidates) > 1:
        raise ExportError(
            f"{source} holds {', '.join(one.name for one in candidates)}; say which is the {word} matrix: "
            f"names={{{kind!r}: ...}}."
        )
    if candidates[0].size < 0 or not np.all(np.isfinite(candidates[0].values)):
        raise ExportError(f"{source}: matrix {candidates[0].name} is not a real square matrix.")
    return candidates[0]


def _candidates(found: Mapping[str, _Entries], kind: str) -> list[_Entries]:
    """Return the square matrices whose names start so: one of Nastran's usual names goes before the others.

    EXTSEOUT writes many more: K4XX (structural damping), KASMX, MUG1 ..., of which those that the model lacks are
    1 x 1 and empty.
    """
    candidates = [
        one for key, one in found.items() if key.startswith(kind) and one.size >= 0 and not key.startswith("K4")
    ]
    candidates = [one for one in candidates if len(one.values) or one.size > 1] or candidates * (kind != "B")
    usual = [one for one in candidates if one.name.upper() in {kind + rest for rest in _USUAL_NAMES}]
    return usual if len(usual) == 1 else candidates


def _all_six(nodes: Nodes) -> DofTable:
    """Return the g-set of grid points: six DoF each, sorted by label."""
    labels = np.sort(nodes.labels)
    return DofTable(np.column_stack([np.repeat(labels, 6), np.tile(np.arange(1, 7), len(labels))]), nodes)
