"""Ansys: the matrices of a superelement (.sub), exported as Matrix Market text by APDL Math."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_import.errors import ExportError, InterfaceError, UnknownKeywordError
from fem_import.keywords import known_keywords
from fem_import.readers.ansys_cdb import read_archive
from fem_import.readers.assembly import mass_beside, refuse_other_size, warn_of_few_digits
from fem_import.readers.long_text import texts_of
from fem_import.readers.matrix_market_file import parse_matrix
from fem_import.readers.node_table import read_node_table
from fem_import.readers.packed_file import bare_suffix
from fem_import.readers.superelement import MODAL, superelement_body
from fem_import.reduced_body import ReducedBody
from fem_import.units import required_units

PathLike: TypeAlias = "str | os.PathLike[str]"

_MASS_NAMES = (("stiffness", "mass"), ("stiff", "mass"), ("stif", "mass"), ("K", "M"))
_LARGEST = 20_000  # rows; a superelement has hundreds
_HOW_TO_EXPORT = (
    "Export its matrices as text: *DMAT,MatK,D,IMPORT,SUB,part.sub,STIFF and *EXPORT,MatK,MMF,part_stiff.txt; "
    "*DMAT,MatM,D,IMPORT,SUB,part.sub,MASS and *EXPORT,MatM,MMF,part_mass.txt. Then read them by "
    "fi.read_ansys_substructure('part_stiff.txt', interfaces={name: master node}, units=..., positions=...)."
)


@known_keywords(UnknownKeywordError)
def read_ansys_substructure(
    path: PathLike,
    interfaces: Mapping[str, int],
    mass: PathLike | None = None,
    *,
    units: str | None = None,
    nodes: PathLike | None = None,
    positions: Mapping[int, ArrayLike] | None = None,
    masters: Sequence[int] | None = None,
    damping: PathLike | None = None,
) -> ReducedBody:
    """Read the matrices of a superelement that Ansys has reduced (CMS or static condensation).

    Parameters
    ----------
    path : the stiffness matrix as Matrix Market text, gzipped or not. The .sub file itself is refused, with the APDL
        commands that export it.
    interfaces : {name: label of the master node}, each with UX to ROTZ as master DoF.
    mass, damping : the other matrices; default the mass matrix beside it by name (stiff -> mass), no damping.
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required.
    nodes, positions : where the master nodes are: an archive (.cdb) or table of nodes, or {label: (x, y, z)}.
    masters : the labels of the master nodes in the order of the rows; default ascending.

    Returns
    -------
    ReducedBody : the rows behind the six of each master node are generalized coordinates and become its modes.

    Raises
    ------
    ExportError, InterfaceError, MissingFileError, UnknownNameError : what is wrong and how to mend it.

    Warns
    -----
    ExportWarning : rigid motion of the interfaces strains the body, as it does where the order of the rows is another.
    """
    source = Path(path)
    required_units(units, source.name)
    refuse_substructure_file(source)
    mass_path = Path(mass) if mass is not None else mass_beside(source, _MASS_NAMES, _HOW_TO_EXPORT)
    paths = [source, mass_path] + ([Path(damping)] if damping is not None else [])
    printed = [
        parse_matrix(content, item.name).assembled() for item, content in zip(paths, texts_of(*paths), strict=True)
    ]
    size = printed[0].matrix.shape[0]
    if size > _LARGEST:
        raise ExportError(f"{source.name}: {size} DoF are no superelement. Read it by fi.read_ansys.")
    for item, other in zip(paths[1:], printed[1:], strict=True):
        refuse_other_size(other.matrix.shape[0], size, item.name, source.name)
    dofs = _row_table(masters, interfaces, size, source.name)
    if positions is None:
        if nodes is None:
            raise ExportError(
                f"{source.name} does not hold node positions. Give nodes= or positions={{label: (x, y, z)}}."
            )
        table = read_archive(Path(nodes)) if bare_suffix(Path(nodes)) == ".cdb" else read_node_table(Path(nodes))
        positions = dict(zip(table.labels.tolist(), table.positions, strict=True))
    label = f"Ansys substructure {source.name}"
    warn_of_few_digits(min(item.digits for item in printed), label)
    K, M, *C = (item.matrix.toarray() for item in printed)
    return superelement_body(K, M, C[0] if C else None, dofs, interfaces, positions, units, label)


def refuse_substructure_file(path: Path) -> None:
    """Raise ExportError for the binary file, with the commands that export it."""
    if bare_suffix(path) == ".sub":
        raise ExportError(
            f"{path.name} is a superelement of Ansys in its own binary form, which is not read. {_HOW_TO_EXPORT}"
        )


def _row_table(masters: Sequence[int] | None, interfaces: Mapping[str, int], size: int, name: str) -> NDArray[np.int64]:
    """Return node and direction of each row: six a master node, then generalized coordinates."""
    labels = sorted(interfaces.values()) if masters is None else [int(label) for label in masters]
    unnamed = [label for label in interfaces.values() if label not in labels]
    if unnamed:
        raise InterfaceError(f"{name}: node {unnamed[0]} of interfaces is not among masters ({labels}).")
    n_modes = size - 6 * len(labels)
    if n_modes < 0:
        raise ExportError(
            f"{name} has {size} rows, and {len(labels)} master nodes with UX to ROTZ need {6 * len(labels)}. An "
            "interface needs all six: M,node,ALL on a node that carries rotations (CERIG or MPC184 ties the others to "
            "it)."
        )
    table = [(label, direction) for label in labels for direction in range(1, 7)]
    table += [(number, MODAL) for number in range(1, n_modes + 1)]
    return np.array(table, dtype=np.int64)
