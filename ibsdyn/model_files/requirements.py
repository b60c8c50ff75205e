"""Requirements of a model, from tables of its file and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from ibsdyn.errors import ModelFileError, nearest
from ibsdyn.model import Model
from ibsdyn.model_files.signals import read_input, read_sensor, written_input, written_sensor
from ibsdyn.model_files.table import Table
from ibsdyn.quantities import ModeDamping, ModeFrequency, PeakResponse, Quantity, ResponseAt
from ibsdyn.requirement import SENSES, Requirement
from ibsdyn.signals import Input, Sensor

QUANTITIES: Mapping[str, tuple[Callable[..., Quantity], tuple[str, ...]]] = {
    "mode_frequency": (ModeFrequency, ("mode",)),
    "mode_damping": (ModeDamping, ("mode",)),
    "response_at": (ResponseAt, ("input", "output", "frequency")),
    "peak_response": (PeakResponse, ("input", "output", "band")),
}
_Signal = TypeVar("_Signal")
_KEYS = ("limit", "sense", "quantity", "quantity_name")


def read_requirement(name: str, table: Table, model: Model) -> Requirement:
    """Return a requirement whose signals are those of the model by name, or tables of their own."""
    kind, keys = QUANTITIES[table.choice("quantity", tuple(QUANTITIES))]
    table.refuse_unknown((*_KEYS, *keys))
    with table.placed_errors():
        given: dict[str, Any] = {}
        for key in keys:
            if key not in table:
                raise table.error(key, "is missing.")
            given[key] = _read(table, key, model)
        if "quantity_name" in table:
            given["name"] = table.text("quantity_name")
        sense = {"sense": table.choice("sense", SENSES)} if "sense" in table else {}
        return Requirement(name, kind(**given), table.numeric("limit"), **sense)


def written_requirement(requirement: Requirement, model: Model) -> dict[str, Any]:
    """Return the keys and values of a requirement, without its name.

    Raises
    ------
    ModelFileError : a quantity that files do not know.
    """
    quantity: Any = requirement.quantity
    for word, (kind, keys) in QUANTITIES.items():
        if type(quantity) is kind:
            values = {key: _written(getattr(quantity, key), model) for key in keys}
            unnamed = kind(**{key: getattr(quantity, key) for key in keys})
            named = {} if unnamed.name == quantity.name else {"quantity_name": quantity.name}
            return {"quantity": word, **values, **named, "sense": requirement.sense, "limit": requirement.limit}
    raise ModelFileError(
        f"requirement {requirement.name!r}: its quantity is a {type(quantity).__name__}, which model files do not "
        f"know; they know {', '.join(QUANTITIES)}."
    )


def read_source(table: Table, key: str, model: Model) -> Input:
    """Return an input: one of the model by its name, or one in a table of its own."""
    if isinstance(table.values[key], dict):
        inner = table.inner(key)
        return read_input(inner.text("name"), inner.without("name"))
    return _named(table, key, model.inputs)


def written_source(signal: Input, model: Model) -> Any:
    """Return the name of an input that the model has, or a table of one that it does not have."""
    return signal.name if model.inputs.get(signal.name) == signal else {"name": signal.name, **written_input(signal)}


def _read(table: Table, key: str, model: Model) -> Any:
    if key == "input":
        return read_source(table, key, model)
    if key == "output":
        if isinstance(table.values[key], dict):
            inner = table.inner(key)
            return read_sensor(inner.text("name"), inner.without("name"))
        return _named(table, key, model.sensors)
    return table.values[key] if key == "mode" else table.numeric(key)


def _written(value: Any, model: Model) -> Any:
    if isinstance(value, Sensor):
        known = model.sensors.get(value.name) == value
        return value.name if known else {"name": value.name, **written_sensor(value)}
    if isinstance(value, Input):
        return written_source(value, model)
    return list(value) if isinstance(value, tuple) else value


def _named(table: Table, key: str, known: Mapping[str, _Signal]) -> _Signal:
    name = table.text(key)
    if name not in known:
        raise table.error(key, f"{name!r} is not in the file. {nearest(name, known)}")
    return known[name]
