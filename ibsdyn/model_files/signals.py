"""Inputs and sensors of a model, from tables of its file and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ibsdyn.model_files.table import Table
from ibsdyn.signals import BaseMotion, Force, Input, Sensor, Torque

INPUTS: Mapping[str, tuple[type[Input], tuple[str, ...]]] = {
    "force": (Force, ("item", "direction", "position")),
    "torque": (Torque, ("item", "direction")),
    "base_motion": (BaseMotion, ("item", "direction", "quantity")),
}
_SENSOR_KEYS = ("item", "direction", "position", "quantity", "relative_to")


def read_input(name: str, table: Table) -> Input:
    """Return a Force, Torque or BaseMotion."""
    kind, keys = INPUTS[table.choice("type", tuple(INPUTS))]
    table.refuse_unknown(("type", *keys))
    with table.placed_errors():
        return kind(name=name, **_given(table, keys))


def read_sensor(name: str, table: Table) -> Sensor:
    """Return a Sensor."""
    table.refuse_unknown(_SENSOR_KEYS)
    with table.placed_errors():
        return Sensor(name=name, **_given(table, _SENSOR_KEYS))


def written_input(signal: Input) -> dict[str, Any]:
    """Return the keys and values of an input, without its name."""
    for type_, (kind, keys) in INPUTS.items():
        if isinstance(signal, kind):
            return {"type": type_, **_values(signal, keys)}
    raise TypeError(f"{signal!r} is no input")


def written_sensor(sensor: Sensor) -> dict[str, Any]:
    """Return the keys and values of a sensor, without its name."""
    return _values(sensor, _SENSOR_KEYS)


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
