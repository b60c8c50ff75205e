"""The table of components, as a design review wants to see it."""

from __future__ import annotations

from collections.abc import Sequence

from ibsdyn.axes import INERTIA_NAMES, STIFFNESS_NAMES
from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.model import Model
from ibsdyn.reporting.html import Cell, number, point, table
from ibsdyn.signals import BaseMotion, CombinedSensor, Force, Input, Sensor, Stroke, Torque


def component_tables(model: Model) -> str:
    """Return bodies, FE parts, connections, fixations and signals, a table each."""
    parts = [
        ("Rigid bodies", _rigid(model)),
        ("Flexible bodies", _flexible(model)),
        ("Connections", _connections(model)),
        ("Fixations", _fixations(model)),
        ("Inputs and sensors", _signals(model)),
    ]
    return "\n".join(f"<h3>{words}</h3>{content}" for words, content in parts if content)


def _rigid(model: Model) -> str:
    if model.axis is not None:
        unit, label = ("kg m²", "inertia") if model.axis.startswith("r") else ("kg", "mass")
        rows: list[Sequence[Cell]] = [
            (item.name, number(item.inertia)) for item in model.items.values() if isinstance(item, Inertia1D)
        ]
        return table([("name", "name"), (f"{label} [{unit}]", "number")], rows) if rows else ""
    rows = [
        (item.name, number(item.mass), point(item.cog), *(number(value) for value in item.inertia))
        for item in model.items.values()
        if isinstance(item, RigidBody)
    ]
    head = [("name", "name"), ("mass [kg]", "number"), ("CoG x, y, z [mm]", "point")]
    head += [(f"{name} [kg m²]", "number") for name in INERTIA_NAMES]
    return table(head, rows) if rows else ""


def _flexible(model: Model) -> str:
    rows: list[Sequence[Cell]] = []
    for item in model.items.values():
        if isinstance(item, FlexibleBody):
            body = item.reduced
            loss = "from the export" if body.C is not None else number(item.zeta)
            rows.append(
                (
                    item.name,
                    number(body.mass),
                    point(body.centre_of_mass.tolist()),
                    ", ".join(body.interfaces),
                    str(len(body.frequencies)),
                    number(body.max_frequency),
                    loss,
                    body.source,
                )
            )
    head = [("name", "name"), ("mass [kg]", "number"), ("CoG x, y, z [mm]", "point"), ("interfaces", "")]
    head += [("modes", "number"), ("cut-off [Hz]", "number"), ("ζ", "number"), ("source", "quiet")]
    return table(head, rows) if rows else ""


def _connections(model: Model) -> str:
    connections = list(model.connections.values())
    if not connections:
        return ""
    if model.axis is not None:
        unit = "N·m/rad" if model.axis.startswith("r") else "N/m"
        rows: list[Sequence[Cell]] = [
            (c.name, f"{c.item1} – {c.item2}", number(c.stiffness[0]), _loss(c)) for c in connections
        ]
        head = [("name", "name"), ("between", ""), (f"stiffness [{unit}]", "number"), ("ζ", "number")]
        return table(head, rows)
    rows = [
        (c.name, f"{c.item1} – {c.item2}", _where(c), *(number(k, 3) for k in c.stiffness), _loss(c))
        for c in connections
    ]
    head = [("name", "name"), ("between", ""), ("at x, y, z [mm]", "point")]
    units = ("N/m",) * 3 + ("N·m/rad",) * 3
    head += [(f"{name} [{unit}]", "number") for name, unit in zip(STIFFNESS_NAMES, units, strict=True)]
    return table([*head, ("ζ", "number")], rows)


def _where(connection: Connection) -> str:
    assert connection.position1 is not None  # only 1-D models have none
    assert connection.position2 is not None
    words = point(connection.position1)
    if connection.position2 != connection.position1:
        words += f" to {point(connection.position2)}"
    turned = any(connection.axes[i][j] != float(i == j) for i in range(3) for j in range(3))
    return f"{words} (own axes)" if turned else words


def _loss(connection: Connection) -> str:
    return "dampers" if connection.damping is not None else number(connection.zeta)


def _fixations(model: Model) -> str:
    fixations = [item for item in model.items.values() if isinstance(item, Fixation)]
    if not fixations:
        return ""
    if model.axis is not None:
        return table([("name", "name")], [(item.name,) for item in fixations])
    return table([("name", "name"), ("position x, y, z [mm]", "")], [(f.name, point(f.position)) for f in fixations])


def _signals(model: Model) -> str:
    rows: list[Sequence[Cell]] = []
    for name, signal in model.inputs.items():
        rows.append((name, _kind(signal), *_place(signal), signal.unit))
    for name, sensor in model.sensors.items():
        if isinstance(sensor, CombinedSensor):
            sums = " + ".join(f"{number(weight)} · {part.name}" for weight, part in sensor.parts)
            rows.append((name, f"combined sensor: {sums}", "–", "–", "–", sensor.unit))
        else:
            rows.append((name, f"sensor, {sensor.quantity}", *_place(sensor), sensor.unit))
    head = [("name", "name"), ("kind", ""), ("on", ""), ("direction", ""), ("at x, y, z [mm]", "point"), ("unit", "")]
    return table(head, rows) if rows else ""


def _place(signal: Input | Sensor) -> tuple[str, str, str]:
    """Return the item, the direction and the position of a signal in words."""
    direction = signal.direction
    words = direction if isinstance(direction, str) else f"({', '.join(number(value, 3) for value in direction)})"
    position = getattr(signal, "position", None)  # torques, strokes and base motions have none
    relative = getattr(signal, "relative_to", None)
    on = signal.item if relative is None else f"{signal.item}, relative to {relative}"
    return on, words, "–" if position is None else point(position)


def _kind(signal: Input) -> str:
    """Return what an input is, in words."""
    if isinstance(signal, BaseMotion):
        return f"base motion, {signal.quantity}"
    return {Force: "force", Torque: "torque", Stroke: "stroke of a connection"}[type(signal)]
