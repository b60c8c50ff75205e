"""Inputs and sensors of a model, from tables of its file and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from ibsdyn.errors import nearest
from ibsdyn.model import Model
from ibsdyn.model_files.table import Table
from ibsdyn.signals import BaseMotion, CombinedSensor, Force, Input, Output, Sensor, Stroke, Torque

_Entry = TypeVar("_Entry")
INPUTS: Mapping[str, tuple[type[Input], tuple[str, ...]]] = {
    "force": (Force, ("item", "direction", "position")),
    "torque": (Torque, ("item", "direction")),
    "stroke": (Stroke, ("item", "direction")),
    "base_motion": (BaseMotion, ("item", "direction", "quantity")),
}
_SENSOR_KEYS = ("item", "direction", "position", "quantity", "relative_to")


def read_input(name: str, table: Table) -> Input:
    """Return a Force, Torque or BaseMotion."""
    kind, keys = INPUTS[table.choice("type", tuple(INPUTS))]
    table.refuse_unknown(("type", *keys))
    with table.placed_errors():
        return kind(name=name, **_given(table, keys))


def read_sensor(name: str, table: Table) -> Output:
    """Return a Sensor, or a CombinedSensor of several."""
    if "parts" in table:
        return _read_combined(name, table)
    return _read_single(name, table)


def written_input(signal: Input) -> dict[str, Any]:
    """Return the keys and values of an input, without its name."""
    for type_, (kind, keys) in INPUTS.items():
        if isinstance(signal, kind):
            return {"type": type_, **_values(signal, keys)}
    raise TypeError(f"{signal!r} is no input")


def written_sensor(sensor: Output) -> dict[str, Any]:
    """Return the keys and values of a sensor, without its name."""
    if isinstance(sensor, Sensor):
        return _values(sensor, _SENSOR_KEYS)
    parts = [{"weight": weight, "name": part.name, **written_sensor(part)} for weight, part in sensor.parts]
    return {"unit": sensor.unit, "parts": parts}


def read_source(table: Table, key: str, model: Model) -> Input:
    """Return an input: one of the model by its name, or one in a table of its own."""
    if isinstance(table.values.get(key), dict):
        inner = table.inner(key)
        return read_input(inner.text("name"), inner.without("name"))
    return named_entry(table, key, model.inputs)


def written_source(signal: Input, model: Model) -> Any:
    """Return the name of an input that the model has, or a table of one that it does not have."""
    return signal.name if model.inputs.get(signal.name) == signal else {"name": signal.name, **written_input(signal)}


def read_output(table: Table, key: str, model: Model) -> Output:
    """Return a sensor: one of the model by its name, or one in a table of its own."""
    if isinstance(table.values.get(key), dict):
        inner = table.inner(key)
        return read_sensor(inner.text("name"), inner.without("name"))
    return named_entry(table, key, model.sensors)


def written_output(sensor: Output, model: Model) -> Any:
    """Return the name of a sensor that the model has, or a table of one that it does not have."""
    return sensor.name if model.sensors.get(sensor.name) == sensor else {"name": sensor.name, **written_sensor(sensor)}


def named_entry(table: Table, key: str, known: Mapping[str, _Entry]) -> _Entry:
    """Return what the model has under the name that a key gives."""
    name = table.text(key)
    if name not in known:
        raise table.error(key, f"{name!r} is not in the file. {nearest(name, known)}")
    return known[name]


def _read_single(name: str | None, table: Table) -> Sensor:
    table.refuse_unknown(_SENSOR_KEYS)
    with table.placed_errors():
        return Sensor(name=name, **_given(table, _SENSOR_KEYS))


def _read_combined(name: str, table: Table) -> CombinedSensor:
    table.refuse_unknown(("unit", "parts"))
    listed = table.values["parts"]
    if not isinstance(listed, list):
        raise table.error("parts", f"must be a list of tables with weight, item, direction, got {listed!r}.")
    parts = []
    for given in listed:
        part = table.inner("parts", given)
        called = part.text("name") if "name" in part else None
        sensor = _read_single(called, part.without("weight").without("name"))
        parts.append((part.numeric("weight", 1.0), sensor))
    with table.placed_errors():
        return CombinedSensor(name, parts, table.text("unit"))


def _given(table: Table, keys: tuple[str, ...]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for key in keys:
        if key in ("item", "direction") and key not in table:
            raise table.error(key, "is missing.")
        if key in table:
            number = key == "position" or (key == "direction" and not isinstance(table.values[key], str))
            values[key] = table.numeric(key) if number else table.text(key)
    return values


def _values(signal: Input | Sensor, keys: tuple[str, ...]) -> dict[str, Any]:
    values = {key: getattr(signal, key) for key in keys}
    return {key: list(v) if isinstance(v, tuple) else v for key, v in values.items() if v is not None}
