"""Matrix Market files of any program, with a DoF table as CSV."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TypeAlias

from fem_import.errors import ExportError, UnknownKeywordError
from fem_import.fe_model import FEModel
from fem_import.keywords import known_keywords
from fem_import.readers.assembly import LabelledMatrices, mass_beside, refuse_other_size
from fem_import.readers.dof_table import read_dof_table
from fem_import.readers.long_text import LongText, read_in_turn, texts_of
from fem_import.readers.matrix_market_file import parse_matrix
from fem_import.readers.printed_matrix import PrintedEntries
from fem_import.units import required_units

PathLike: TypeAlias = "str | os.PathLike[str]"

_MASS_NAMES = (("stiffness", "mass"), ("stiff", "mass"), ("stif", "mass"), ("K", "M"))


@known_keywords(UnknownKeywordError)
def read_matrix_market(
    path: PathLike,
    mass: PathLike | None = None,
    *,
    units: str | None = None,
    dofs: PathLike | None = None,
    damping: PathLike | None = None,
) -> FEModel:
    """Read matrices as `scipy.io.mmwrite`, MATLAB's mmwrite and many programs write them.

    Parameters
    ----------
    path : the stiffness matrix, coordinate or array, symmetric or general; gzipped or not.
    mass, damping : the other matrices; default the mass matrix beside it by name (K -> M, stiffness -> mass).
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required.
    dofs : CSV with one line a row of K: node,direction,x,y,z and, if wanted, sets (names parted by "|").
        direction: 1..6 or x y z rx ry rz. Required.

    Returns
    -------
    FEModel : SI.

    Raises
    ------
    ExportError, MissingFileError, UnknownNameError : what is wrong, where, how to mend it.
    """
    stiffness = Path(path)
    required_units(units, stiffness.name)
    if dofs is None:
        raise ExportError(
            f"{stiffness.name} does not say what its rows are. Give dofs=, a CSV with the heading "
            "node,direction,x,y,z and "
            "one line a row (or, for Ansys' *EXPORT, mapping= and nodes=)."
        )
    mass_path = Path(mass) if mass is not None else mass_beside(stiffness, _MASS_NAMES, "")
    paths = [stiffness, mass_path] + ([Path(damping)] if damping is not None else [])
    table = read_dof_table(Path(dofs))

    def parsed(given: tuple[Path, LongText]) -> PrintedEntries:
        item, content = given
        entries = parse_matrix(content, item.name)
        refuse_other_size(entries.size, len(table.dofs), item.name, Path(dofs).name)
        return entries

    printed = read_in_turn(paths, texts_of(*paths), parsed, PrintedEntries.assembled)
    matrices = LabelledMatrices(
        K=printed[0].matrix,
        M=printed[1].matrix,
        C=printed[2].matrix if damping is not None else None,
        dofs=table.dofs,
        digits=min(item.digits for item in printed),
        of_one_triangle=all(item.of_one_triangle for item in printed),
    )
    return matrices.model(table.nodes, str(units), f"Matrix Market {stiffness.name}")
