"""Nastran bulk data: cards in small, large and free field, grid points, matrices as DMIG, rows of superelements."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError
from fem_import.readers.nastran_columns import MatrixColumns, split_columns
from fem_import.readers.nastran_systems import KINDS, CoordinateSystems
from fem_import.readers.node_table import Nodes

IntArray: TypeAlias = NDArray[np.int64]

_WANTED = ("GRID", "GRDSET", "DMIG", "INCLUDE", "EXTRN", *KINDS)
_REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[EeDd]?([+-]?\d+))?$")


@dataclass(frozen=True)
class _Card:
    name: str
    fields: list[str]
    where: str

    def whole(self, place: int, default: int | None = None) -> int:
        text = self.fields[place].strip() if place < len(self.fields) else ""
        if not text and default is not None:
            return default
        if not re.fullmatch(r"[+-]?\d{1,12}", text):
            raise ExportError(f"{self.where}, {self.name}: field {place + 2} is {text!r}, expected a whole number.")
        return int(text)

    def real(self, place: int) -> float:
        text = self.fields[place].strip() if place < len(self.fields) else ""
        if not text:
            return 0.0
        found = _REAL.match(text)
        if found is None:
            raise ExportError(f"{self.where}, {self.name}: field {place + 2} is {text!r}, expected a number.")
        value = float(f"{found[1]}e{found[2] or 0}")  # 1.5-7 and 1.5D-7 are Nastran's
        if not np.isfinite(value):
            raise ExportError(f"{self.where}, {self.name}: field {place + 2} is {text!r}, which is not finite.")
        return value


@dataclass(frozen=True, eq=False)
class DirectMatrix:
    """A DMIG: its form (6 symmetric, 1 square), node and component (0: a scalar point) of terms (n, 2), digits."""

    form: int
    rows: IntArray
    columns: IntArray
    values: NDArray[np.float64]
    digits: int


@dataclass(eq=False)
class _Terms:
    """What has been read of a DMIG."""

    form: int
    rows: list[tuple[int, int]] = field(default_factory=list)
    columns: list[tuple[int, int]] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    digits: int = 0

    def with_columns(self, more: MatrixColumns | None) -> DirectMatrix:
        """Return the matrix with its columns in large field."""
        rows, columns = (np.array(part, dtype=np.int64).reshape(-1, 2) for part in (self.rows, self.columns))
        values = np.array(self.values, dtype=np.float64)
        if more is None:
            return DirectMatrix(self.form, rows, columns, values, self.digits)
        return DirectMatrix(
            self.form,
            np.concatenate([rows, more.rows]),
            np.concatenate([columns, more.columns]),
            np.concatenate([values, more.values]),
            max(self.digits, more.digits),
        )


@dataclass(frozen=True, eq=False)
class BulkData:
    """Grid points in global axes (None where there are none) and matrices by name.

    axes: of the grid points whose displacements are in a local system, its directions as columns (3, 3);
    rows: grid point and component (0: a scalar point) of a superelement's matrices, where EXTRN tells them.
    """

    nodes: Nodes | None
    matrices: dict[str, DirectMatrix]
    axes: dict[int, NDArray[np.float64]] = field(default_factory=dict)
    rows: list[tuple[int, int]] = field(default_factory=list)


def parse_bulk(text: str, name: str) -> BulkData:
    """Parse GRID and its systems, DMIG and EXTRN; other cards are passed over. Raises ExportError.

    Format: MSC Nastran Quick Reference Guide, "Bulk data entry", GRID, CORD2R, DMIG, EXTRN.
    """
    grids: list[_Card] = []
    rows: list[tuple[int, int]] = []
    systems = CoordinateSystems()
    matrices: dict[str, _Terms] = {}
    in_large_field, lines = split_columns(text)
    for card in _cards(lines, name):
        if card.name == "INCLUDE":
            raise ExportError(f"{card.where}: INCLUDE is not followed. Give the file with the GRID cards.")
        if card.name == "GRDSET" and (card.whole(1, 0) or card.whole(5, 0)):
            raise ExportError(
                f"{card.where}: GRDSET sets a local system for all grid points; only that of each GRID is read. Write "
                "CP and CD on the GRID cards."
            )
        if card.name == "GRID":
            grids.append(card)
        elif card.name in KINDS:
            points = np.array([card.real(place) for place in range(2, 11)]).reshape(3, 3)
            systems.define(card.whole(0), card.name, card.whole(1, 0), points, card.where)
        elif card.name == "EXTRN":
            rows += _external_rows(card)
        elif card.name == "DMIG":
            _take_matrix(card, matrices)
    nodes, axes = _placed(grids, systems)
    for undeclared in in_large_field.keys() - matrices.keys():
        where = f"{name}, line {in_large_field[undeclared].first_line}"
        raise ExportError(f"{where}: a column of matrix {undeclared!r} has no declaration. Is the file cut?")
    found = {key: terms.with_columns(in_large_field.get(key)) for key, terms in matrices.items()}
    return BulkData(nodes, found, axes, rows)


def _placed(grids: list[_Card], systems: CoordinateSystems) -> tuple[Nodes | None, dict[int, NDArray[np.float64]]]:
    """Return the grid points in the basic system, and the axes of those that have their displacements in another."""
    labels: list[int] = []
    positions: list[list[float]] = []
    turned: list[tuple[int, int]] = []
    for number, card in enumerate(grids):
        labels.append(card.whole(0))
        position, displacement = card.whole(1, 0), card.whole(5, 0)
        point = [card.real(place) for place in (2, 3, 4)]
        positions.append(systems.position(position, np.array(point), card.where).tolist() if position else point)
        if displacement:
            turned.append((number, displacement))
    if not grids:
        return None, {}
    places = np.array(positions)
    axes = {labels[number]: systems.axes_at(to, places[number], grids[number].where) for number, to in turned}
    return Nodes(np.array(labels, dtype=np.int64), places, {}), axes


def _external_rows(card: _Card) -> list[tuple[int, int]]:
    """Return the rows of pairs "grid point, components": 123456 are six, 0 is a scalar point."""
    rows: list[tuple[int, int]] = []
    for place in range(0, len(card.fields) - 1, 2):
        if not card.fields[place].strip():
            continue
        components = str(card.whole(place + 1, 0))
        if not re.fullmatch(r"0|[1-6]{1,6}", components):
            raise ExportError(f"{card.where}, EXTRN: {components} are no components of grid point {card.whole(place)}.")
        rows += [(card.whole(place), int(component)) for component in components]
    return rows


def _take_matrix(card: _Card, matrices: dict[str, _Terms]) -> None:
    name = card.fields[0].strip().upper() if card.fields else ""
    if card.whole(1) == 0:
        form, kind = card.whole(2), card.whole(3)
        if name in matrices:
            raise ExportError(f"{card.where}: matrix {name} is declared twice.")
        matrices[name] = _Terms(form if kind in (1, 2) else -kind)
        return
    matrix = matrices.get(name)
    if matrix is None:
        raise ExportError(f"{card.where}: a column of matrix {name!r} comes before its declaration. Is the file cut?")
    column = (card.whole(1), card.whole(2, 0))
    for start in range(4, len(card.fields), 4):
        if not "".join(card.fields[start : start + 4]).strip():
            continue
        matrix.columns.append(column)
        matrix.rows.append((card.whole(start), card.whole(start + 1, 0)))
        matrix.values.append(card.real(start + 2))
        mantissa = _REAL.match(card.fields[start + 2].strip())
        if mantissa is not None:
            matrix.digits = max(matrix.digits, len(mantissa[1].lstrip("+-0.").replace(".", "")))


def _cards(lines: list[tuple[int, str]], name: str) -> Iterator[_Card]:
    card: _Card | None = None
    for number, raw in lines:
        line = raw.partition("$")[0].rstrip().expandtabs(8)
        if not line.strip():
            continue
        if card is not None and (line[0] in " *+" or line.startswith(",")):
            card.fields.extend(_fields(line))
            continue
        if card is not None:
            yield card
            card = None
        keyword = re.split(r"[*, ]", line, maxsplit=1)[0].upper()
        if keyword in _WANTED:
            card = _Card(keyword, _fields(line), f"{name}, line {number}")
    if card is not None:
        yield card


def _fields(line: str) -> list[str]:
    """Return the fields of one line after the first; large fields are 16 wide, four a line."""
    if "," in line:
        fields = [part.strip() for part in line.split(",")[1:9]]
        return fields + [""] * ((4 if "*" in line[:8] else 8) - len(fields))
    width, count = (16, 4) if "*" in line[:8] else (8, 8)
    return [line[8 + k * width : 8 + (k + 1) * width] for k in range(count)]
