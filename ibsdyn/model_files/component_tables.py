"""Components out of tables: a row each, columns by name with units, as they come out of CAD and spreadsheets."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ibsdyn.axes import INERTIA_NAMES, STIFFNESS_NAMES
from ibsdyn.errors import ModelError, ModelFileError, nearest
from ibsdyn.model import Model
from ibsdyn.model_files.components import COMPONENTS, add_component
from ibsdyn.model_files.sheets import Sheet, read_sheets
from ibsdyn.model_files.table import Table
from ibsdyn.model_files.text_file import checked_path
from ibsdyn.units import si_factor


@dataclass(frozen=True)
class _Column:
    """What a heading stands for: a key, its place in the key's list (None: the value itself), a dimension of `units`
    or "text".
    """

    key: str
    place: int | None
    dimension: str


def _columns() -> dict[str, _Column]:
    known = {
        "name": _Column("name", None, "text"),
        "kind": _Column("kind", None, "text"),
        "item1": _Column("between", 0, "text"),
        "item2": _Column("between", 1, "text"),
        "products": _Column("products", None, "text"),
        "reduced": _Column("reduced", None, "text"),
        "mass": _Column("mass", None, "mass"),
        "zeta": _Column("zeta", None, "ratio"),
    }
    for key in ("position", "cog", "position1", "position2", "elastic centre"):
        for place, axis in enumerate("xyz"):
            known[f"{key} {axis}"] = _Column(key.replace(" ", "_"), place, "length")
    for place, name in enumerate(INERTIA_NAMES):
        known[name] = _Column("inertia", place, "inertia")
    for place, name in enumerate(STIFFNESS_NAMES):
        rotational = "rotational " if place >= 3 else ""
        known[name] = _Column("stiffness", place, f"{rotational}stiffness")
        known[name.replace("k", "c", 1)] = _Column("damping", place, f"{rotational}damping")
    for row in range(3):
        for column in range(3):
            known[f"axes {row + 1}{column + 1}"] = _Column("axes", 3 * row + column, "ratio")
    return known


COLUMNS: Mapping[str, _Column] = _columns()
_ALIASES = {"from": "item1", "to": "item2", "body": "name", "component": "name", "part": "name", "type": "kind"}
_ALIASES |= {f"{word}{axis}": f"cog {axis}" for word in ("com", "cg", "centreofgravity") for axis in "xyz"}
# A bare x, y, z is where a component is; which key that is depends on its kind.
_BARE = {"fixation": "position", "rigid_body": "cog", "connection": "position1"}
_KINDS = {"body": "rigid_body", "rigidbody": "rigid_body", "flexiblebody": "flexible_body", "spring": "connection"}
_UNIT = re.compile(r"^(.*?)\s*[\[(](.*)[\])]\s*$")
_RIGID = ("inf", "infinity", "∞", "rigid")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


def with_table(model: Model, path: str | os.PathLike[str], kind: str | None = None) -> Model:
    """Return the model with the components of a file; see ``Model.add_table``."""
    source = checked_path(path, "add_table")
    grown = model.copy()
    rows = list(component_rows(source, model.axis, kind, {}, source.parent, False))
    for connections in (False, True):  # last: they need what they connect
        for row_kind, name, values in rows:
            if (row_kind == "connection") == connections:
                add_component(grown, row_kind, name, values)
    return grown


def component_rows(
    path: Path,
    axis: str | None,
    kind: str | None,
    parameters: Mapping[str, float],
    folder: Path,
    allow_outside: bool,
) -> Iterator[tuple[str, str, Table]]:
    """Yield kind, name and values of each component of a file.

    Parameters
    ----------
    path : CSV or XLSX.
    axis : of a 1-D model, whose columns carry one number.
    kind : of all its components, where the table does not say it.
    parameters : for cells that are expressions.
    folder, allow_outside : for paths in cells, as in a model file.

    Raises
    ------
    ModelFileError : a heading, a unit or a cell that is not understood; the message has the line.
    """
    if kind is not None and kind not in COMPONENTS:
        raise ModelFileError(f"{path.name}: kind {kind!r} is not known. {nearest(str(kind), COMPONENTS)}")
    found = False
    for sheet in read_sheets(path):
        for part in _rows_of(sheet, axis, kind):
            found = True
            row_kind, name, where, values = part
            yield row_kind, name, Table(where, values, parameters, folder, allow_outside)
    if not found:
        raise ModelFileError(f"{path.name}: no component in it; a table has a heading with a column 'name'.")


def _rows_of(sheet: Sheet, axis: str | None, kind: str | None) -> Iterator[tuple[str, str, str, dict[str, object]]]:
    start = next((i for i, (_, cells) in enumerate(sheet.rows) if _is_heading(cells)), None)
    if start is None:
        return
    headings = _Headings(sheet.where, sheet.rows[start][1], axis)
    rows = sheet.rows[start + 1 :]
    commas = any(isinstance(c, str) and _DECIMAL_COMMA.fullmatch(c) for _, cells in rows for c in cells)
    for line, cells in rows:
        where = f"{sheet.where}: line {line}"
        given = {place: cell for place, cell in enumerate(cells) if cell != ""}
        name = headings.name(given, where)
        own = headings.kind(given, where) or kind or _KINDS.get(_folded(sheet.title)) or headings.implied_kind()
        yield own, name, f"{where} ({name})", headings.values(given, own, commas, f"{where} ({name})")


class _Headings:
    """The columns of one table."""

    def __init__(self, where: str, cells: Sequence[str | float], axis: str | None) -> None:
        self._where = where
        self._axis = axis
        self._columns: dict[int, tuple[str, _Column | None, float]] = {}
        for place, cell in enumerate(cells):
            if cell != "":
                self._columns[place] = self._column(str(cell))
        names = [name for name, _, _ in self._columns.values()]
        for name in names:
            if names.count(name) > 1:
                raise ModelFileError(f"{where}: two columns are called {name!r}.")

    def _column(self, heading: str) -> tuple[str, _Column | None, float]:
        match = _UNIT.match(heading)
        words, unit = (match[1], match[2]) if match else (heading, "")
        name = _known(words)
        if name in ("x", "y", "z"):
            return name, None, self._factor(heading, unit, "length")
        column = self._one_dimensional(name) or COLUMNS.get(name)
        if column is None:
            raise ModelFileError(
                f"{self._where}: column {words!r} is not known. {nearest(words, [*COLUMNS, 'x', 'y', 'z'])}"
            )
        return name, column, 1.0 if column.dimension == "text" else self._factor(heading, unit, column.dimension)

    def _one_dimensional(self, name: str) -> _Column | None:
        if name not in ("inertia", "stiffness", "damping"):
            return None
        if self._axis is None:
            raise ModelFileError(
                f"{self._where}: column {name!r} is for 1-D models; a 3-D one takes "
                f"{', '.join(n for n, c in COLUMNS.items() if c.key == name)}."
            )
        rotational = "rotational " if self._axis.startswith("r") and name != "inertia" else ""
        return _Column(name, None, f"{rotational}{name}")

    def _factor(self, heading: str, unit: str, dimension: str) -> float:
        try:
            return si_factor(unit, dimension) if unit else 1.0
        except ModelError as error:
            raise ModelFileError(f"{self._where}: column {heading!r}: {error}") from None

    def name(self, given: Mapping[int, str | float], where: str) -> str:
        """Return the name in a row."""
        for place, cell in given.items():
            if place in self._columns and self._columns[place][0] == "name":
                return _text(cell)
        raise ModelFileError(f"{where}: the name is missing.")

    def kind(self, given: Mapping[int, str | float], where: str) -> str | None:
        """Return the kind in a row, if the table has one."""
        for place, cell in given.items():
            if place in self._columns and self._columns[place][0] == "kind":
                word = _folded(_text(cell))
                kind = _KINDS.get(word, word)
                if kind not in COMPONENTS:
                    raise ModelFileError(f"{where}: kind {cell!r} is not known. {nearest(word, COMPONENTS)}")
                return kind
        return None

    def implied_kind(self) -> str:
        """Return the kind that the columns are those of."""
        keys = {column.key for _, column, _ in self._columns.values() if column is not None}
        for key, kind in (("between", "connection"), ("reduced", "flexible_body"), ("mass", "rigid_body")):
            if key in keys:
                return kind
        return "rigid_body" if "inertia" in keys else "fixation"

    def values(self, given: Mapping[int, str | float], kind: str, commas: bool, where: str) -> dict[str, object]:
        """Return keys and values of a row as a model file has them, in SI."""
        values: dict[str, object] = {}
        lists: dict[str, dict[int, object]] = {}
        for place, cell in given.items():
            if place not in self._columns:
                raise ModelFileError(f"{where}: {cell!r} stands in a column without a heading.")
            name, column, factor = self._columns[place]
            if name in ("name", "kind"):
                continue
            if column is None:
                column = _Column(_BARE.get(kind, "position"), "xyz".index(name), "length")
            value = _text(cell) if column.dimension == "text" else _number(cell, factor, commas, f"{where} {name}")
            if column.place is None:
                values[column.key] = value
            else:
                lists.setdefault(column.key, {})[column.place] = value
        return values | {key: self._list(key, entries, where) for key, entries in lists.items()}

    def _list(self, key: str, entries: dict[int, object], where: str) -> list[object]:
        names = [n for n, c in COLUMNS.items() if c.key == key]
        if key == "inertia":  # a table without products of inertia is one of symmetric bodies
            entries = dict.fromkeys((3, 4, 5), 0.0) | entries
        missing = [name for place, name in enumerate(names) if place not in entries]
        if missing:
            hint = "; 0 leaves a direction free" if key == "stiffness" else ""
            raise ModelFileError(f"{where}: {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing{hint}.")
        flat = [entries[place] for place in range(len(names))]
        return [flat[0:3], flat[3:6], flat[6:9]] if key == "axes" else flat


def _is_heading(cells: Sequence[str | float]) -> bool:
    return "name" in [_known(cell) for cell in cells if isinstance(cell, str)]


def _folded(words: str) -> str:
    return re.sub(r"[\s_.\-]+", "", words).casefold().replace("center", "centre")


_BY_FOLDED = {_folded(name): name for name in COLUMNS} | _ALIASES
_KINDS |= {_folded(kind): kind for kind in COMPONENTS}


def _known(words: str) -> str:
    match = _UNIT.match(words)
    folded = _folded(match[1] if match else words)
    return _BY_FOLDED.get(folded, folded)


def _text(cell: str | float) -> str:
    return cell if isinstance(cell, str) else f"{cell:g}"


def _number(cell: str | float, factor: float, commas: bool, where: str) -> object:
    """Return a number in SI, or an expression for the model file's own evaluation."""
    if isinstance(cell, float):
        return cell * factor
    if cell.casefold() in _RIGID:
        return math.inf
    if commas:
        if _DECIMAL_COMMA.fullmatch(cell):
            return float(cell.replace(",", ".")) * factor
        if "." in cell and _NUMBER.fullmatch(cell):
            raise ModelFileError(
                f"{where}: {cell!r} has a point where other cells have decimal commas; take thousands' points out."
            )
    if _NUMBER.fullmatch(cell):
        return float(cell) * factor
    return cell if factor == 1.0 else f"({cell})*{factor!r}"
