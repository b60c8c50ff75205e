"""The numbers of Table 1 by address, as "mirror.mass" or "mount.kx": what studies, sensitivities and fits vary."""

from __future__ import annotations

import numbers
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple
from weakref import WeakKeyDictionary

from ibsdyn.axes import INERTIA_NAMES, STIFFNESS_NAMES, is_rotation
from ibsdyn.components import (
    Connection,
    Fixation,
    FlexibleBody,
    Inertia1D,
    Item,
    RigidBody,
    damping_values,
    scalar_damping,
    scalar_stiffness,
    stiffness_values,
)
from ibsdyn.errors import ModelError, UnknownNameError, nearest
from ibsdyn.validation import number, point

if TYPE_CHECKING:
    from ibsdyn.model import Model

DAMPING_NAMES = ("cx", "cy", "cz", "cxx", "cyy", "czz")
POSITION_NAMES = ("x", "y", "z")

Component = Item | Connection
Kind = Literal["mass", "inertia", "place", "stiffness", "zeta", "damping"]

# How the entries of a field are called in an address.
_ENTRIES: Mapping[str, tuple[str, ...]] = {
    "cog": POSITION_NAMES,
    "position": POSITION_NAMES,
    "position1": POSITION_NAMES,
    "position2": POSITION_NAMES,
    "elastic_centre": POSITION_NAMES,
    "inertia": INERTIA_NAMES,
}


class Parameter(NamedTuple):
    """One number of a component.

    Attributes
    ----------
    address : as ``mirror.mass``, ``mirror.cog.x``, ``mount.kxx``.
    component : the component's name.
    kind : "mass", "inertia", "place", "stiffness", "zeta" or "damping".
    field, entry : the component's field, and the place in it (0 where it is one number).
    value, unit : SI.
    """

    address: str
    component: str
    kind: Kind
    field: str
    entry: int
    value: float
    unit: str


def checked_model(value: object, what: str) -> Model:
    """Return a model; ModelError for anything else, as its linear system."""
    from ibsdyn.model import Model  # which imports this module

    if not isinstance(value, Model):
        raise ModelError(f"{what} takes an ibs.Model, got {value!r}.")
    return value


def model_parameters(
    items: Mapping[str, Item], connections: Mapping[str, Connection], axis: str | None
) -> dict[str, Parameter]:
    """Return every parameter of a model by address, in the order of its components."""
    listed: list[Parameter] = []
    for component in [*items.values(), *connections.values()]:
        listed += _parameters_of(component, axis)
    return {parameter.address: parameter for parameter in listed}


def chosen_parameters(known: Mapping[str, Parameter], addresses: Iterable[str] | None, what: str) -> list[Parameter]:
    """Return the parameters at some addresses, all of them for None.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : an address twice, or none at all.
    """
    if addresses is None:
        return list(known.values())
    listed = [addresses] if isinstance(addresses, str) else list(addresses)
    for address in listed:
        if not isinstance(address, str) or address not in known:
            raise UnknownNameError(
                f"{what}: the model has no parameter {address!r}. {nearest_address(str(address), known)}"
            )
    if not listed or len(set(listed)) < len(listed):
        raise ModelError(f"{what}: parameters must be a list of different addresses, got {listed!r}.")
    return [known[address] for address in listed]


def nearest_address(address: str, known: Iterable[str]) -> str:
    """Return a sentence that leads from an unknown address to known ones: of the same component if it is one."""
    addresses = list(known)
    component = address.split(".", 1)[0]
    own = [each for each in addresses if each.split(".", 1)[0] == component]
    if own:
        return nearest(address, own)
    components = list(dict.fromkeys(each.split(".", 1)[0] for each in addresses))
    return nearest(component, components)


def changed_components(
    items: Mapping[str, Item], connections: Mapping[str, Connection], axis: str | None, values: Mapping[str, float]
) -> tuple[dict[str, Item], dict[str, Connection]]:
    """Return the components of a model with other values at some addresses, checked as if typed anew.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : a value that the component cannot have.
    """
    if not isinstance(values, Mapping):
        raise ModelError(f"with_parameters expects a dict {{address: value}}, got {values!r}.")
    changed: dict[str, list[tuple[Parameter, float]]] = {}
    known: dict[str, dict[str, Parameter]] = {}
    for address, value in values.items():
        name = address.split(".", 1)[0] if isinstance(address, str) else ""
        component: Component | None = items.get(name) or connections.get(name)
        if component is not None and name not in known:
            known[name] = _known_parameters(component, axis)
        parameter = known.get(name, {}).get(address)
        if parameter is None:
            every = model_parameters(items, connections, axis)
            raise UnknownNameError(
                f"with_parameters: the model has no parameter {address!r}. {nearest_address(str(address), every)}"
            )
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise ModelError(f"with_parameters: {address} must be one number [{parameter.unit}], got {value!r}.")
        changed.setdefault(name, []).append((parameter, float(value)))
    new_items, new_connections = dict(items), dict(connections)
    for name, entries in changed.items():
        if name in new_items:
            new_items[name] = _changed_item(new_items[name], entries, axis)
        else:
            new_connections[name] = _changed_connection(new_connections[name], entries, axis)
    return new_items, new_connections


def _known_parameters(component: Component, axis: str | None) -> dict[str, Parameter]:
    """Return the parameters of a component by address, listed once: variants of a model begin at the same one."""
    known = _KNOWN.setdefault(axis, WeakKeyDictionary())
    if component not in known:
        known[component] = {parameter.address: parameter for parameter in _parameters_of(component, axis)}
    return known[component]


def _parameters_of(component: Component, axis: str | None) -> list[Parameter]:
    name = component.name
    rotating = axis is not None and is_rotation(axis)
    if isinstance(component, Fixation):
        # Where a 1-D model is fixed does not enter it.
        return [] if axis is not None else _several(name, "position", "place", component.position, "m")
    if isinstance(component, Inertia1D):
        if rotating:
            return [Parameter(f"{name}.inertia", name, "inertia", "inertia", 0, component.inertia, "kg m²")]
        return [Parameter(f"{name}.mass", name, "mass", "inertia", 0, component.inertia, "kg")]
    if isinstance(component, RigidBody):
        return [
            Parameter(f"{name}.mass", name, "mass", "mass", 0, component.mass, "kg"),
            *_several(name, "cog", "place", component.cog, "m"),
            *_several(name, "inertia", "inertia", component.inertia, "kg m²"),
        ]
    zeta = Parameter(f"{name}.zeta", name, "zeta", "zeta", 0, component.zeta, "-")
    if isinstance(component, FlexibleBody):
        return [zeta]
    if axis is not None:
        units = ("N·m/rad", "N·m·s/rad") if rotating else ("N/m", "N·s/m")
        return [*_springs_1d(component, *units), zeta]
    return [*_springs(component), zeta, *_places(component)]


def _several(name: str, field: str, kind: Kind, values: Sequence[float], unit: str) -> list[Parameter]:
    return [
        Parameter(f"{name}.{field}.{entry}", name, kind, field, i, value, unit)
        for i, (entry, value) in enumerate(zip(_ENTRIES[field], values, strict=True))
    ]


def _springs_1d(connection: Connection, stiffness_unit: str, damping_unit: str) -> list[Parameter]:
    name = connection.name
    springs = [
        Parameter(f"{name}.stiffness", name, "stiffness", "stiffness", 0, connection.stiffness[0], stiffness_unit)
    ]
    if connection.damping is not None:
        springs.append(Parameter(f"{name}.damping", name, "damping", "damping", 0, connection.damping[0], damping_unit))
    return springs


def _springs(connection: Connection) -> list[Parameter]:
    name = connection.name
    units = ("N/m",) * 3 + ("N·m/rad",) * 3
    springs = [
        Parameter(f"{name}.{label}", name, "stiffness", "stiffness", i, k, unit)
        for i, (label, k, unit) in enumerate(zip(STIFFNESS_NAMES, connection.stiffness, units, strict=True))
    ]
    if connection.damping is not None:
        units = ("N·s/m",) * 3 + ("N·m·s/rad",) * 3
        springs += [
            Parameter(f"{name}.{label}", name, "damping", "damping", i, c, unit)
            for i, (label, c, unit) in enumerate(zip(DAMPING_NAMES, connection.damping, units, strict=True))
        ]
    return springs


def _places(connection: Connection) -> list[Parameter]:
    places = []
    for field in ("position1", "position2", "elastic_centre"):
        place = getattr(connection, field)
        if place is not None:
            places += _several(connection.name, field, "place", place, "m")
    return places


def _changed_item(item: Item, entries: Sequence[tuple[Parameter, float]], axis: str | None) -> Item:
    if isinstance(item, Fixation):
        return Fixation.of(item.name, _with_entries(item.position, entries))
    if isinstance(item, Inertia1D):
        assert axis is not None  # only 1-D models have such a body
        (_, value), *_ = entries
        return (
            Inertia1D.of(item.name, None, value, axis)
            if is_rotation(axis)
            else Inertia1D.of(item.name, value, None, axis)
        )
    if isinstance(item, FlexibleBody):
        (_, value), *_ = entries
        return FlexibleBody.of(item.name, item.reduced, value)
    by_field = _by_field(entries)
    mass = by_field["mass"][0][1] if "mass" in by_field else item.mass
    cog = _with_entries(item.cog, by_field.get("cog", ()))
    return RigidBody.of(item.name, mass, cog, _with_entries(item.inertia, by_field.get("inertia", ())))


def _changed_connection(
    connection: Connection, entries: Sequence[tuple[Parameter, float]], axis: str | None
) -> Connection:
    what = f"connection {connection.name!r}"
    by_field = _by_field(entries)
    fields: dict[str, Any] = {}
    for field, own in by_field.items():
        if field == "zeta":
            fields[field] = number(own[0][1], f"{what}: zeta", "", minimum=0.0)
            continue
        values = _with_entries(getattr(connection, field), own)
        if field == "stiffness":
            unit = own[0][0].unit
            fields[field] = stiffness_values(values, what) if axis is None else scalar_stiffness(values, what, unit)
        elif field == "damping":
            fields[field] = damping_values(values, what) if axis is None else scalar_damping(values, what)
        else:
            fields[field] = point(values, f"{what}: {field}")
    return replace(connection, **fields)


def _by_field(entries: Sequence[tuple[Parameter, float]]) -> dict[str, list[tuple[Parameter, float]]]:
    by_field: dict[str, list[tuple[Parameter, float]]] = {}
    for parameter, value in entries:
        by_field.setdefault(parameter.field, []).append((parameter, value))
    return by_field


def _with_entries(values: Sequence[float], entries: Sequence[tuple[Parameter, float]]) -> tuple[float, ...]:
    changed = list(values)
    for parameter, value in entries:
        changed[parameter.entry] = value
    return tuple(changed)


# A component cannot change, so its list holds as long as it lives. In a 1-D model units go with the axis.
_KNOWN: dict[str | None, WeakKeyDictionary[Component, dict[str, Parameter]]] = {}
