"""A TOML file in, a model out."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ibsdyn.errors import ExpressionError, ModelFileError, nearest
from ibsdyn.expressions import evaluate_all
from ibsdyn.model import Model
from ibsdyn.model_files.component_tables import component_rows
from ibsdyn.model_files.components import COMPONENTS, ITEMS, add_component
from ibsdyn.model_files.disturbances import read_disturbance
from ibsdyn.model_files.requirements import read_requirement
from ibsdyn.model_files.signals import read_input, read_sensor
from ibsdyn.model_files.table import Table
from ibsdyn.model_files.text_file import checked_path, read_text

if sys.version_info >= (3, 11):
    import tomllib
else:  # the same parser, for the Python before it was built in
    import tomli as tomllib

_Row = tuple[str, str, Table]
REGISTRIES = ("input", "sensor", "disturbance", "requirement")
KNOWN_TABLES = ("model", "parameters", *COMPONENTS, *REGISTRIES)
_MAX_DOTS = 20
_QUOTED_PART = re.compile(r"[\"'][ \t]*\.")
_MODEL_KEYS = ("name", "axis", "order", "tables")


def read_model(path: str | os.PathLike[str], allow_outside: bool = False) -> Model:
    """Return the model of a file; see ``Model.from_toml``."""
    source = checked_path(path, "from_toml")
    return model_of(parsed(read_text(source), source.name), source, allow_outside)


def parsed(text: str, name: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises
    ------
    ModelFileError : no TOML; the message has the line.
    """
    _refuse_deep_keys(text, name)
    try:
        document: dict[str, Any] = tomllib.loads(text)
        return document
    except tomllib.TOMLDecodeError as error:
        raise ModelFileError(f"{name}: {error}{_hint(text, error)}") from None
    except RecursionError:
        raise ModelFileError(f"{name}: its tables and lists are nested too deep.") from None
    except ValueError as error:  # a whole number of thousands of digits
        raise ModelFileError(f"{name}: {error}") from None


def model_of(document: Mapping[str, Any], source: Path, allow_outside: bool = False) -> Model:
    """Return the model of parsed tables.

    Parameters
    ----------
    document : {table: ...} as TOML gives it.
    source : the file, for errors and relative paths.
    allow_outside : whether its paths may lead out of its folder.

    Raises
    ------
    ModelFileError : an unknown table or key, a value that cannot be right; the message has the place.
    """
    for key in document:
        if key not in KNOWN_TABLES:
            raise ModelFileError(f"{source.name}: [{key}] unknown table. {nearest(key, KNOWN_TABLES)}")
    parameters = _parameters(document, source.name)
    folder = source.parent

    def table(place: str, values: object) -> Table:
        return Table(f"{source.name}: [{place}]", values, parameters, folder, allow_outside)

    def named(kind: str) -> dict[str, Table]:
        listed = table(kind, document.get(kind, {}))
        return {name: table(f"{kind}.{_shown(name)}", values) for name, values in listed.values.items()}

    head = table("model", document.get("model", {}))
    head.refuse_unknown(_MODEL_KEYS)
    with head.placed_errors():
        model = Model(
            head.text("name") if "name" in head else source.stem, head.text("axis") if "axis" in head else None
        )
    rows = _table_rows(head, model.axis, parameters, folder, allow_outside)
    listed = [(kind, name, values) for kind in document if kind in ITEMS for name, values in named(kind).items()]
    listed += [row for row in rows if row[0] != "connection"]
    for kind, name, values in _ordered(listed, head):
        add_component(model, kind, name, values)
    listed = [("connection", name, values) for name, values in named("connection").items()]
    for kind, name, values in (*listed, *(row for row in rows if row[0] == "connection")):
        add_component(model, kind, name, values)
    for name, values in named("input").items():
        with values.placed_errors():
            model.add_input(read_input(name, values))
    for name, values in named("sensor").items():
        with values.placed_errors():
            model.add_sensor(read_sensor(name, values))
    for name, values in named("disturbance").items():
        with values.placed_errors():
            model.add_disturbance(read_disturbance(name, values, model))
    for name, values in named("requirement").items():
        with values.placed_errors():
            model.add_requirement(read_requirement(name, values, model))
    return model


def _parameters(document: Mapping[str, Any], name: str) -> dict[str, float]:
    listed = Table(f"{name}: [parameters]", document.get("parameters", {}), {}, Path())
    for key, value in listed.values.items():
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise listed.error(key, f"must be a number or an expression in quotes, got {value!r}.")
    try:
        return evaluate_all({key: v if isinstance(v, str) else listed.numeric(key) for key, v in listed.values.items()})
    except ExpressionError as error:
        raise ModelFileError(f"{listed.where} {error}") from None


def _table_rows(
    head: Table, axis: str | None, parameters: Mapping[str, float], folder: Path, allow_outside: bool
) -> list[_Row]:
    """Components in tables that the file refers to."""
    listed = head.values.get("tables", [])
    paths = [listed] if isinstance(listed, str) else listed
    if not isinstance(paths, list):
        raise head.error("tables", f'must name files, as tables = ["bodies.csv"], got {listed!r}.')
    rows: list[_Row] = []
    for given in paths:
        path = head.with_value("tables", given).path("tables")
        with head.placed_errors():
            rows += component_rows(path, axis, None, parameters, folder, allow_outside)
    return rows


def _ordered(listed: list[_Row], head: Table) -> list[_Row]:
    """Fixations and bodies in the order of [model] order, or as the file has them, kind by kind."""
    if "order" not in head:
        return listed
    order = head.values["order"]
    names = [name for _, name, _ in listed]
    if not isinstance(order, list) or sorted(map(str, order)) != sorted(names):
        raise head.error(
            "order", f"must name each fixation and body once: {', '.join(map(repr, names))}; got {order!r}."
        )
    return sorted(listed, key=lambda item: order.index(item[1]))


def _shown(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else f'"{name}"'


def _refuse_deep_keys(text: str, name: str) -> None:
    """Refuse keys of very many parts: the parser's time grows with the square of their number."""
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") <= _MAX_DOTS:
            continue
        before = line.split("=")
        keys = before if line.lstrip().startswith("[") else before[:-1]
        bare = max(part.count(".") for key in keys for part in key.split(",")) if keys else 0
        if max(bare, len(_QUOTED_PART.findall(line))) > _MAX_DOTS:
            raise ModelFileError(f"{name}: line {number} has a key of more than {_MAX_DOTS} parts.")


def _hint(text: str, error: Exception) -> str:
    line = getattr(error, "lineno", None) or _line_of(str(error))
    lines = text.splitlines()
    if line is None or not 0 < line <= len(lines):
        return ""
    shown = lines[line - 1].strip()
    return f": {shown if len(shown) <= 80 else shown[:77] + '...'}"


def _line_of(message: str) -> int | None:
    _, found, rest = message.partition("at line ")
    digits = rest.split(",")[0]
    return int(digits) if found and digits.isdigit() else None
