"""Requirements of a model, from tables of its file and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ibsdyn.disturbances import AnyDisturbance
from ibsdyn.errors import ModelFileError
from ibsdyn.model import Model
from ibsdyn.model_files.signals import named_entry, read_output, read_source, written_output, written_source
from ibsdyn.model_files.table import Table
from ibsdyn.quantities import ModeDamping, ModeFrequency, PeakResponse, Quantity, ResponseAt, RmsResponse
from ibsdyn.requirement import SENSES, Requirement
from ibsdyn.signals import Input, Output

QUANTITIES: Mapping[str, tuple[Callable[..., Quantity], tuple[str, ...]]] = {
    "mode_frequency": (ModeFrequency, ("mode",)),
    "mode_damping": (ModeDamping, ("mode",)),
    "response_at": (ResponseAt, ("input", "output", "frequency")),
    "peak_response": (PeakResponse, ("input", "output", "band")),
    "rms_response": (RmsResponse, ("output", "disturbances", "band")),
}
_KEYS = ("limit", "sense", "quantity", "quantity_name")


def read_requirement(name: str, table: Table, model: Model) -> Requirement:
    """Return a requirement whose signals are those of the model by name, or tables of their own."""
    kind, keys = QUANTITIES[table.choice("quantity", tuple(QUANTITIES))]
    table.refuse_unknown((*_KEYS, *keys))
    with table.placed_errors():
        given: dict[str, Any] = {}
        for key in keys:
            if key not in table:
                if (kind, key) == (RmsResponse, "band"):
                    continue  # all that the disturbances reach
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
            values = {key: _written(getattr(quantity, key), model) for key in keys if key != "disturbances"}
            if isinstance(quantity, RmsResponse):
                values["disturbances"] = _disturbance_names(quantity, model)
            values = {key: value for key, value in values.items() if value is not None}
            unnamed = kind(**{key: getattr(quantity, key) for key in keys})
            named = {} if unnamed.name == quantity.name else {"quantity_name": quantity.name}
            return {"quantity": word, **values, **named, "sense": requirement.sense, "limit": requirement.limit}
    raise ModelFileError(
        f"requirement {requirement.name!r}: its quantity is a {type(quantity).__name__}, which model files do not "
        f"know; they know {', '.join(QUANTITIES)}."
    )


def _read(table: Table, key: str, model: Model) -> Any:
    if key == "input":
        return read_source(table, key, model)
    if key == "output":
        return read_output(table, key, model)
    if key == "disturbances":
        return _disturbances(table, key, model)
    return table.values[key] if key == "mode" else table.numeric(key)


def _written(value: Any, model: Model) -> Any:
    if isinstance(value, Output):
        return written_output(value, model)
    if isinstance(value, Input):
        return written_source(value, model)
    return list(value) if isinstance(value, tuple) else value


def _disturbances(table: Table, key: str, model: Model) -> list[AnyDisturbance]:
    names = table.values[key]
    listed = [names] if isinstance(names, str) else names
    if not isinstance(listed, list) or not listed:
        raise table.error(key, f"must name disturbances of the file, got {names!r}.")
    return [named_entry(table.with_value(key, name), key, model.disturbances) for name in listed]


def _disturbance_names(quantity: RmsResponse, model: Model) -> list[str]:
    for disturbance in quantity.disturbances:
        if model.disturbances.get(disturbance.name) != disturbance:
            raise ModelFileError(
                f"quantity {quantity.name!r}: its disturbance {disturbance.name!r} is not in the model; add it by "
                "add_disturbance(...), so that the file can name it."
            )
    return [disturbance.name for disturbance in quantity.disturbances]
