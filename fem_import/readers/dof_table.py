"""A table of DoF as text: what each row of a matrix is, and where."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError, nearest_known
from fem_import.readers.node_table import Nodes
from fem_import.readers.packed_file import read_bytes, text_of
from fem_import.readers.triplets import refuse_cut_text

IntArray: TypeAlias = NDArray[np.int64]

_DIRECTIONS = {name: number for number, name in enumerate(("x", "y", "z", "rx", "ry", "rz"), start=1)}
_DIRECTIONS |= {str(number): number for number in range(1, 7)}
_COLUMNS = ("node", "direction", "x", "y", "z")


@dataclass(frozen=True, eq=False)
class DofTable:
    """dofs (n, 2): node label and direction of each row; nodes: their labels, positions and sets."""

    dofs: IntArray
    nodes: Nodes


def read_dof_table(path: Path) -> DofTable:
    """Read CSV with the heading node,direction,x,y,z and, if wanted, sets; one line a matrix row, in its order.

    direction: 1..6 or x y z rx ry rz; sets: names parted by "|". Fields are parted by commas, semicolons or
    tabs. Raises ExportError, MissingFileError.
    """
    content = read_bytes(path)
    refuse_cut_text(content, path.name)
    lines = [(k, line) for k, line in enumerate(text_of(content).splitlines(), start=1) if line.strip()]
    heading = lines[0][1]
    separator = next((mark for mark in (";", "\t", ",") if mark in heading), ",")
    columns = [name.strip().strip('"').lower() for name in heading.split(separator)]
    for name in _COLUMNS:
        if name not in columns:
            raise ExportError(
                f"{path.name}, line 1: there is no column {name!r}. Expected node,direction,x,y,z and perhaps sets; "
                f"found {heading.strip()[:80]!r}."
            )
    places = [columns.index(name) for name in _COLUMNS]
    sets_at = columns.index("sets") if "sets" in columns else None
    table = _regular_table([line for _, line in lines[1:]], separator, len(columns), places, sets_at)
    if table is not None:
        return table
    dofs: list[tuple[int, int]] = []
    positions: dict[int, tuple[float, ...]] = {}
    sets: dict[str, list[int]] = {}
    for number, line in lines[1:]:
        where = f"{path.name}, line {number}"
        fields = [field.strip().strip('"') for field in line.split(separator)]
        if len(fields) != len(columns):
            raise ExportError(f"{where}: {len(fields)} fields for {len(columns)} columns: {line.strip()[:60]!r}.")
        node_text, direction_text, *coordinates = (fields[place] for place in places)
        direction = _DIRECTIONS.get(direction_text.lower())
        if direction is None:
            raise ExportError(f"{where}: direction {direction_text!r}.{nearest_known(direction_text, _DIRECTIONS)}")
        if not (node_text.isascii() and node_text.isdigit() and len(node_text) < 16):
            raise ExportError(f"{where}: {node_text[:40]!r} is not a node label.")
        node = int(node_text)
        try:
            position = tuple(float(word) for word in coordinates)
        except ValueError:
            raise ExportError(f"{where}: the position {coordinates} is not three numbers.") from None
        if positions.setdefault(node, position) != position:
            raise ExportError(f"{where}: node {node} is at {position} here and at {positions[node]} above.")
        dofs.append((node, direction))
        if sets_at is not None:
            for name in filter(None, (word.strip() for word in fields[sets_at].split("|"))):
                sets.setdefault(name, []).append(node)
    if not dofs:
        raise ExportError(f"{path.name} holds a heading and no rows.")
    labels = np.array(list(positions), dtype=np.int64)
    nodes = Nodes(labels, np.array(list(positions.values())), {name: np.unique(found) for name, found in sets.items()})
    return DofTable(np.array(dofs, dtype=np.int64), nodes)


def _regular_table(
    lines: list[str], separator: str, n_columns: int, places: list[int], sets_at: int | None
) -> DofTable | None:
    """Return the table column by column; None where something is odd, so that the lines are looked at one by one."""
    fields = separator.join(lines).split(separator)
    if (
        not lines
        or len(fields) != n_columns * len(lines)
        or any(line.count(separator) != n_columns - 1 for line in lines)
    ):
        return None
    labels, named, *coordinates = (fields[place::n_columns] for place in places)
    spelled = {name: _DIRECTIONS.get(name.strip().lower(), 0) for name in set(named)}
    joined = "".join(labels)
    if not (joined.isascii() and joined.isdigit()) or not 0 < len(max(labels, key=len)) < 16 or 0 in spelled.values():
        return None
    try:
        nodes = np.array(labels, dtype=np.int64)
        points = np.array(coordinates, dtype=np.float64).T
    except ValueError:
        return None
    found, first, node_of_row = np.unique(nodes, return_index=True, return_inverse=True)
    if not np.array_equal(points, points[first[node_of_row]]):
        return None  # a node in two places, or a position that is no number
    sets: dict[str, list[IntArray]] = {}
    for cell, members in _rows_of_cells(fields[sets_at::n_columns] if sets_at is not None else []).items():
        for name in filter(None, (word.strip() for word in cell.strip().strip('"').split("|"))):
            sets.setdefault(name, []).append(nodes[members])
    order = np.argsort(first)
    return DofTable(
        np.column_stack([nodes, np.array([spelled[name] for name in named], dtype=np.int64)]),
        Nodes(
            found[order], points[first[order]], {name: np.unique(np.concatenate(each)) for name, each in sets.items()}
        ),
    )


def _rows_of_cells(cells: list[str]) -> dict[str, list[int]]:
    rows: dict[str, list[int]] = {}
    for row, cell in enumerate(cells):
        if cell:
            rows.setdefault(cell, []).append(row)
    return rows
