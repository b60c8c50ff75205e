"""Arrays by agreed names, as NPZ and MATLAB files hold them, to an FEModel."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from fem_import.errors import ExportError, nearest_known
from fem_import.fe_model import FEModel
from fem_import.readers.dof_table import read_dof_table
from fem_import.units import required_units

MATRICES = {"K": ("K",), "M": ("M", "E"), "C": ("C", "D")}
"""Names of stiffness, mass and damping: ours, and those of COMSOL's mphmatrix."""
TABLES = ("positions", "nodes", "node_ids", "dofs")
SET_PREFIX = "set_"


def model_of_arrays(
    arrays: Mapping[str, Any],
    units: str | None,
    source: str,
    dofs: Path | None,
    node_sets: Mapping[str, Any],
    others: Collection[str] = (),
) -> FEModel:
    """Make the FEModel of K, M or E, C or D with positions or nodes, dofs, node_ids; or of a CSV of DoF.

    nodes: (n_nodes, 4) label, x, y, z, instead of positions and node_ids; others: names of the file that are not
    agreed, of which names= may choose. Raises ExportError.
    """
    required_units(units, source)
    K, M, C = (_matrix(arrays, kind, source) for kind in MATRICES)
    if K is None or M is None:
        missing = "K" if K is None else "M (or E)"
        near = nearest_known(missing[0], [*arrays, *others])
        cure = (
            f" If one of them is it: names={{{missing[0]!r}: ...}}; fields of a struct must be saved as variables of "
            "their own."
            if others
            else ""
        )
        word = "mass" if K is not None else "stiffness"
        raise ExportError(f"{source} holds no {missing}: the {word} matrix.{near}{cure}")
    if dofs is not None:
        table = read_dof_table(dofs)
        sets = {**table.nodes.sets, **node_sets}
        return FEModel.from_arrays(
            K, M, table.nodes.positions, table.dofs, table.nodes.labels, sets, C, str(units), source=source
        )
    labels = _table(arrays, "node_ids", source)
    positions = _table(arrays, "positions", source)
    nodes = _table(arrays, "nodes", source)
    if nodes is not None and nodes.ndim == 2 and nodes.shape[1] == 4 and positions is None and labels is None:
        labels, positions = nodes[:, 0], nodes[:, 1:]
    if positions is None:
        raise ExportError(
            f"{source} holds no positions: save them as positions (n_nodes, 3), or nodes (n_nodes, 4: label, x, y, "
            "z), or "
            "give dofs=, a CSV with node,direction,x,y,z."
        )
    rows = _table(arrays, "dofs", source)
    if rows is None:
        each, rest = divmod(K.shape[0], max(len(positions), 1))
        if rest or each not in (3, 6):
            raise ExportError(
                f"{source}: {K.shape[0]} rows for {len(positions)} positions; without dofs (n, 2: node, direction) "
                "each node "
                "must have 3 or 6 DoF."
            )
    return FEModel.from_arrays(
        K,
        M,
        positions,
        each if rows is None else rows,
        None if labels is None else labels.ravel(),
        node_sets,
        C,
        str(units),
        source=source,
    )


def _matrix(arrays: Mapping[str, Any], kind: str, source: str) -> Any:
    given = [name for name in MATRICES[kind] if name in arrays]
    if len(given) > 1:
        raise ExportError(f"{source} holds {' and '.join(given)}, which are names of one matrix. Keep one.")
    if not given:
        return None
    matrix: Any = arrays[given[0]]
    if hasattr(matrix, "check_format"):
        try:  # compiled code trusts the indices, and a damaged MATLAB file has any
            matrix.check_format(full_check=True)
        except ValueError as error:
            raise ExportError(f"{source}: {given[0]} is no sparse matrix ({error}). Is the file damaged?") from None
    if not sparse.issparse(matrix):
        matrix = np.asarray(matrix)
        if matrix.ndim != 2 or matrix.dtype.kind not in "fiuc":
            raise ExportError(f"{source}: {given[0]} is no matrix of numbers ({matrix.dtype}, shape {matrix.shape}).")
    if matrix.dtype.kind == "c":
        if abs(matrix.imag).max() > 0.0:
            raise ExportError(f"{source}: {given[0]} is complex. Structural damping cannot be imported as a matrix.")
        matrix = matrix.real
    return matrix


def _table(arrays: Mapping[str, Any], name: str, source: str) -> Any:
    if name not in arrays:
        return None
    table: Any = arrays[name]
    table = table.toarray() if hasattr(table, "toarray") else np.asarray(table)
    if table.dtype.kind not in "fiu":
        raise ExportError(f"{source}: {name} must be numbers; it is {table.dtype}.")
    return table
