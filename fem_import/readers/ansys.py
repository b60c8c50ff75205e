"""Ansys: assembled matrices written by HBMAT or *EXPORT, or kept in the .full file."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_import.errors import ExportError, MissingFileError, UnknownKeywordError
from fem_import.fe_model import FEModel
from fem_import.keywords import known_keywords
from fem_import.readers.ansys_cdb import read_archive
from fem_import.readers.ansys_full import read_full
from fem_import.readers.assembly import LabelledMatrices, mass_beside, refuse_other_size
from fem_import.readers.harwell_boeing import is_harwell_boeing, parse_harwell_boeing
from fem_import.readers.long_text import read_in_turn, texts_of
from fem_import.readers.matrix_market_file import is_matrix_market, parse_matrix, parse_vector
from fem_import.readers.node_table import Nodes, read_node_table
from fem_import.readers.packed_file import bare_suffix, first_bytes, read_bytes, text_of
from fem_import.readers.printed_matrix import PrintedEntries
from fem_import.readers.triplets import refuse_cut_text
from fem_import.units import required_units

PathLike: TypeAlias = "str | os.PathLike[str]"
IntArray: TypeAlias = NDArray[np.int64]

DIRECTIONS = {"UX": 1, "UY": 2, "UZ": 3, "ROTX": 4, "ROTY": 5, "ROTZ": 6}
_MASS_NAMES = (("stiffness", "mass"), ("stiff", "mass"), ("stif", "mass"))
_HOW_TO_EXPORT = "HBMAT,name,,,ASCII,MASS,NO,YES writes it after a modal analysis (ANTYPE,MODAL)."
_MAPPING_LINE = re.compile(r"\s*(\d{1,15})[\s,]+(\d{1,15})[\s,]+([A-Za-z]\w*)\s*$")


@known_keywords(UnknownKeywordError)
def read_ansys(
    path: PathLike,
    mass: PathLike | None = None,
    *,
    units: str | None = None,
    nodes: PathLike | None = None,
    mapping: PathLike | None = None,
    damping: PathLike | None = None,
    node_sets: Mapping[str, ArrayLike] | None = None,
) -> FEModel:
    """Read matrices of an Ansys model.

    Parameters
    ----------
    path : the stiffness matrix (text of HBMAT or of *EXPORT,...,MMF; gzipped or not), or a .full file, which
        needs the extra ibsdyn[ansys].
    mass, damping : the other matrices in the same format. Default: the mass matrix beside it by name (stiff ->
        mass), no damping. A .full file holds all three.
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required, as no file says it.
    nodes : the node positions: an archive (.cdb of CDWRITE; its node components become node sets) or a text
        table "label x y z" (NLIST, Workbench export; decimal commas are taken). Default: the .cdb of the same
        name.
    mapping : what the rows are: the .mapping file of HBMAT (default: that of the same name), or for *EXPORT the
        vector of node numbers in the order of the rows, each node with 3 or 6 DoF.
    node_sets : {name: node labels}, besides the components.

    Returns
    -------
    FEModel : SI. Null rows of a .full file (constrained DoF) are left out.

    Raises
    ------
    ExportError, MissingFileError, UnknownNameError : what is wrong, where, how to mend it.

    Notes
    -----
    HBMAT writes one triangle with its equations in the solver's order, hence the mapping.
    """
    stiffness = Path(path)
    head = first_bytes(stiffness, 4096)
    required_units(units, stiffness.name)
    if is_full(stiffness):
        extra = [name for name, value in (("mass", mass), ("damping", damping), ("mapping", mapping)) if value]
        if extra:
            raise ExportError(f"{stiffness.name} holds all matrices and their rows; leave {extra[0]}= out.")
        matrices = read_full(stiffness).without_null_rows()
    elif is_harwell_boeing(head) or is_matrix_market(head):
        matrices = _read_text(stiffness, is_harwell_boeing(head), mass, damping, mapping)
    else:
        raise ExportError(
            f"{stiffness.name} is neither Harwell-Boeing text (HBMAT,...,ASCII) nor Matrix Market (*EXPORT,...,MMF) "
            "nor "
            "a .full file."
        )
    return matrices.model(
        _read_nodes(nodes, stiffness, matrices.dofs), str(units), f"Ansys {stiffness.name}", node_sets
    )


def is_full(path: Path) -> bool:
    """Whether the name says that it is a matrix file of the solver."""
    return bare_suffix(path) == ".full"


def _read_text(
    stiffness: Path, is_hb: bool, mass: PathLike | None, damping: PathLike | None, mapping: PathLike | None
) -> LabelledMatrices:
    mass_path = Path(mass) if mass is not None else mass_beside(stiffness, _MASS_NAMES, _HOW_TO_EXPORT)
    paths = [stiffness, mass_path] + ([Path(damping)] if damping is not None else [])
    parse = parse_harwell_boeing if is_hb else parse_matrix
    printed = read_in_turn(
        paths, texts_of(*paths), lambda given: parse(given[1], given[0].name), PrintedEntries.assembled
    )
    sizes = [item.matrix.shape[0] for item in printed]
    for path, size in zip(paths[1:], sizes[1:], strict=True):
        refuse_other_size(size, sizes[0], path.name, stiffness.name)
    if is_hb:
        mapping_path = Path(mapping) if mapping is not None else _mapping_beside(stiffness)
        dofs = _read_equation_mapping(mapping_path)
        other = mass_path.with_name(_stem(mass_path) + ".mapping")
        if mapping is None and other.is_file() and not np.array_equal(_read_equation_mapping(other), dofs):
            raise ExportError(
                f"{mapping_path.name} and {other.name} order the rows differently: the two matrices are of different "
                "runs."
            )
    elif mapping is None:
        raise ExportError(
            f"{stiffness.name} does not say which node a row belongs to. Give mapping=, the vector of node numbers: "
            "*VEC,MapBack,I,IMPORT,FULL,file.full,BACK and *EXPORT,MapBack,MMF,map.txt."
        )
    else:
        mapping_path = Path(mapping)
        dofs = _read_node_vector(mapping_path, sizes[0])
    refuse_other_size(sizes[0], len(dofs), stiffness.name, mapping_path.name)
    return LabelledMatrices(
        K=printed[0].matrix,
        M=printed[1].matrix,
        C=printed[2].matrix if damping is not None else None,
        dofs=dofs,
        digits=min(item.digits for item in printed),
        of_one_triangle=all(item.of_one_triangle for item in printed),
    )


def _stem(path: Path) -> str:
    return (path.with_suffix("") if path.suffix.lower() == ".gz" else path).stem


def _mapping_beside(stiffness: Path) -> Path:
    for name in (_stem(stiffness) + ".mapping", _stem(stiffness) + ".mapping.gz"):
        candidate = stiffness.with_name(name)
        if candidate.is_file():
            return candidate
    raise MissingFileError(
        f"{_stem(stiffness)}.mapping is not beside {stiffness.name}; without it no row has a node. Give mapping=, or "
        "export it: HBMAT,name,,,ASCII,STIFF,NO,YES."
    )


def _read_equation_mapping(path: Path) -> IntArray:
    """Read HBMAT's lines "equation node UX" into (n, 2) node, direction; headings are passed over."""
    content = read_bytes(path)
    refuse_cut_text(content, path.name)
    regular = _regular_mapping(content)
    if regular is not None:
        return regular
    found: list[tuple[int, int]] = []
    for number, line in enumerate(text_of(content).splitlines(), start=1):
        match = _MAPPING_LINE.match(line)
        if match is None:
            if line[:40].strip()[:1].isdigit():
                raise ExportError(
                    f"{path.name}, line {number}: expected 'equation node UX', found {line.strip()[:60]!r}."
                )
            continue
        equation, node, direction = int(match[1]), int(match[2]), DIRECTIONS.get(match[3].upper())
        if direction is None:
            raise ExportError(
                f"{path.name}, line {number}: {match[3]} of node {node} is no displacement or rotation "
                f"({', '.join(DIRECTIONS)}). Other fields and internal DoF cannot be imported."
            )
        if equation != len(found) + 1:
            raise ExportError(
                f"{path.name}, line {number}: equation {equation} follows {len(found)}. Lines are missing."
            )
        found.append((node, direction))
    if not found:
        raise ExportError(f"{path.name} holds no line 'equation node UX'.")
    return np.array(found, dtype=np.int64)


def _regular_mapping(content: bytes) -> IntArray | None:
    """Return the mapping of one heading and lines of three words; None where it is not just that."""
    _, _, body = content.partition(b"\n")
    words = body.split()
    equations, nodes, names = words[::3], words[1::3], words[2::3]
    directions = {name: DIRECTIONS.get(name.decode("latin-1").upper(), 0) for name in set(names)}
    n = len(names)
    regular = n > 0 and len(words) == 3 * n == 3 * body.count(b"\n") and 0 not in directions.values()
    if not regular or not b"".join(nodes).isdigit() or len(max(nodes, key=len)) > 15:
        return None
    if equations != [b"%d" % number for number in range(1, n + 1)]:
        return None
    return np.column_stack([np.array(nodes, dtype=np.int64), [directions[name] for name in names]])


def _read_node_vector(path: Path, size: int) -> IntArray:
    """Read the node numbers in the order of the rows; all nodes have the same 3 or 6 DoF."""
    values = parse_vector(next(texts_of(path)), path.name)
    if np.any(values != np.floor(values)) or np.any(values < 1) or np.any(values > 2**53):
        raise ExportError(
            f"{path.name} must hold node numbers; found {values[(values != np.floor(values)) | (values < 1)][0]}."
        )
    labels = values.astype(np.int64)
    each, rest = divmod(size, len(labels))
    if rest or each not in (3, 6):
        raise ExportError(
            f"{path.name} has {len(labels)} nodes for {size} rows; only nodes with 3 or 6 DoF each can be told by a "
            "vector "
            "of nodes. Where DoF are constrained or mixed, use HBMAT with its mapping, or the .full file."
        )
    return np.column_stack([np.repeat(labels, each), np.tile(np.arange(1, each + 1), len(labels))])


def _read_nodes(given: PathLike | None, stiffness: Path, dofs: IntArray) -> Nodes:
    if given is not None:
        path = Path(given)
        return read_archive(path) if bare_suffix(path) == ".cdb" else read_node_table(path)
    beside = stiffness.with_name(_stem(stiffness) + ".cdb")
    for candidate in (beside, beside.with_name(beside.name + ".gz")):
        if candidate.is_file():
            return read_archive(candidate)
    raise MissingFileError(
        f"{stiffness.name} does not hold the node positions. Give nodes=, an archive (CDWRITE,DB,name,cdb) or a table "
        "of "
        f"'label x y z'; no {beside.name} is beside it."
    )
