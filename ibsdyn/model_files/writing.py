"""A model in, the tables and the text of its file out, and its reduced bodies."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import Array

from fem_import import ReducedBody
from fem_import.errors import FemImportError
from ibsdyn.components import GLOBAL_AXES, Connection, Fixation, FlexibleBody, Inertia1D, Item
from ibsdyn.errors import ModelFileError
from ibsdyn.model import Model
from ibsdyn.model_files.disturbances import written_disturbance
from ibsdyn.model_files.requirements import written_requirement
from ibsdyn.model_files.signals import written_input, written_sensor

Tables = dict[str, dict[str, Any]]

# An array with more numbers than this has a line for each.
_LONG = 12


def written_tables(model: Model) -> dict[str, Any]:
    """Return the tables of a model as its file has them: plain texts, numbers, lists and dicts."""
    tables: dict[str, Any] = {"model": _head(model)}
    for name, item in model.items.items():
        kind, values = _item(item, model.axis)
        tables.setdefault(kind, {})[name] = values
    groups: Tables = {
        "connection": {name: _connection(connection) for name, connection in model.connections.items()},
        "input": {name: written_input(signal) for name, signal in model.inputs.items()},
        "sensor": {name: written_sensor(sensor) for name, sensor in model.sensors.items()},
        "disturbance": {name: written_disturbance(d, model) for name, d in model.disturbances.items()},
        "requirement": {name: written_requirement(r, model) for name, r in model.requirements.items()},
    }
    return tables | {kind: named for kind, named in groups.items() if named}


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables as TOML: one header a component, lists on one line."""
    document = tomlkit.document()
    for kind, values in tables.items():
        if kind == "model":
            document.add(kind, _toml_table(values))
        else:
            group = tomlkit.table(is_super_table=True)
            for name, inner in values.items():
                group.add(tomlkit.key(name), _toml_table(inner))
            document.add(kind, group)
    return tomlkit.dumps(document)


def body_file(body: FlexibleBody) -> str:
    """Return the name of a flexible body's file: by its content, so that no other model's file is overwritten."""
    word = re.sub(r"[^A-Za-z0-9_-]+", "_", body.name)[:40]
    return f"{word}-{body.reduced.checksum[:12]}.npz"


def _head(model: Model) -> dict[str, Any]:
    head: dict[str, Any] = {"name": model.name}
    if model.axis is not None:
        head["axis"] = model.axis
    kinds = [_item(item, model.axis)[0] for item in model.items.values()]
    by_kind = sorted(range(len(kinds)), key=lambda place: kinds.index(kinds[place]))
    if by_kind != list(range(len(kinds))):
        head["order"] = list(model.items)  # tables of one kind stand together in the file, items need not
    return head


def _item(item: Item, axis: str | None) -> tuple[str, dict[str, Any]]:
    if isinstance(item, Fixation):
        return "fixation", {"position": list(item.position)}
    if isinstance(item, Inertia1D):
        return "rigid_body", {"inertia" if axis is not None and axis.startswith("r") else "mass": item.inertia}
    if isinstance(item, FlexibleBody):
        return "flexible_body", {"reduced": body_file(item), "zeta": item.zeta}
    return "rigid_body", {"mass": item.mass, "cog": list(item.cog), "inertia": list(item.inertia)}


def _connection(connection: Connection) -> dict[str, Any]:
    values: dict[str, Any] = {"between": [connection.item1, connection.item2]}
    for key in ("position1", "position2", "elastic_centre"):
        place = getattr(connection, key)
        if place is not None:
            values[key] = list(place)
    if connection.axes != GLOBAL_AXES:
        values["axes"] = [list(row) for row in connection.axes]
    single = len(connection.stiffness) == 1
    values["stiffness"] = connection.stiffness[0] if single else list(connection.stiffness)
    values["zeta"] = connection.zeta
    if connection.damping is not None:
        values["damping"] = connection.damping[0] if single else list(connection.damping)
    return values


def write_body(body: ReducedBody, path: Path) -> None:
    """Write a body unless a whole file of the same content is there."""
    try:
        if path.exists() and ReducedBody.load(path).checksum == body.checksum:
            return
    except FemImportError:
        pass  # damaged: written anew
    try:
        body.save(path)
    except OSError as error:
        raise ModelFileError(f"{path} cannot be written: {error.strerror or error}.") from None


def _toml_table(values: Mapping[str, Any]) -> tomlkit.items.Table:
    table = tomlkit.table()
    for key, value in values.items():
        if not isinstance(value, dict):
            table.add(tomlkit.key(key), toml_value(value))
    for key, value in values.items():  # tables inside come last: what follows one would belong to it
        if isinstance(value, dict):
            table.add(tomlkit.key(key), _toml_table(value))
    return table


def toml_value(value: Any) -> Any:
    """Return a value as tomlkit writes it: lists on one line unless they are long."""
    if isinstance(value, list):
        array: Array = tomlkit.array()
        for entry in value:
            array.append(toml_value(entry))
        return array.multiline(True) if len(value) > _LONG else array
    if isinstance(value, dict):
        inline = tomlkit.inline_table()
        for key, entry in value.items():
            inline.append(tomlkit.key(key), toml_value(entry))
        return inline
    return value
