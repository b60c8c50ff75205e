"""A flexible body in the place of rigid bodies and connections: what holds on to it afterwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ibsdyn.components import Connection, FlexibleBody, Point
from ibsdyn.errors import ModelError, UnknownNameError, nearest

LOCKED = (np.inf,) * 6


def replaced_connections(
    body: FlexibleBody,
    bodies: set[str],
    named: Sequence[str],
    connections: Mapping[str, Connection],
    chosen: Mapping[str, str],
) -> dict[str, Connection]:
    """Return all connections of a model after a flexible body has taken the place of some parts.

    Connections between replaced bodies vanish. Others of a replaced body hold on to the nearest interface. Those that
    are replaced themselves leave a locked tie between the interface and what they were connected to.

    Parameters
    ----------
    body : the flexible body.
    bodies : names of the rigid bodies that it replaces.
    named : names of the connections that it replaces.
    connections : all connections of the model.
    chosen : interface by connection name, for a tie by item name; the nearest one for all that are not in it.

    Raises
    ------
    UnknownNameError : ``chosen`` names something that does not hold on to the body, or an interface it does not have.
    ModelError : a named connection has nothing to do with the bodies, or two items would share an interface.
    """
    what = f"replace_with_flexible {body.name!r}"
    result: dict[str, Connection] = {}
    ties: dict[str, tuple[str, Point]] = {}  # item -> interface, position on the item
    holding: list[str] = []
    for connection in connections.values():
        ends = ((connection.item1, connection.position1), (connection.item2, connection.position2))
        outside = [(item, position) for item, position in ends if item not in bodies]
        if connection.name in named:
            if bodies and len(outside) == 2:
                raise ModelError(
                    f"{what}: connection {connection.name!r} is between {outside[0][0]!r} and {outside[1][0]!r}, which "
                    "both stay; name only connections of the bodies that are replaced."
                )
            for item, position in outside:
                assert position is not None  # 3-D connections have positions
                holding.append(item)
                ties[item] = (_interface(body, position, chosen.get(item)), position)
        elif len(outside) == 2:
            result[connection.name] = connection
        elif len(outside) == 1:
            first = connection.item1 in bodies
            position = connection.position1 if first else connection.position2
            assert position is not None  # 3-D connections have positions
            address = f"{body.name}.{_interface(body, position, chosen.get(connection.name))}"
            holding.append(connection.name)
            result[connection.name] = (
                replace(connection, item1=address) if first else replace(connection, item2=address)
            )
    for key in chosen:
        if key not in holding:
            raise UnknownNameError(f"{what}: interfaces names {key!r}. {nearest(key, holding)}")
    return result | _locked_ties(body, ties, what)


def _locked_ties(body: FlexibleBody, ties: Mapping[str, tuple[str, Point]], what: str) -> dict[str, Connection]:
    taken: dict[str, str] = {}
    result = {}
    for item, (interface, position) in ties.items():
        if interface in taken:
            raise ModelError(
                f"{what}: {taken[interface]!r} and {item!r} would both hold on to interface {interface!r}; tell them "
                f"apart with interfaces={{{taken[interface]!r}: ..., {item!r}: ...}}, known: "
                f"{', '.join(map(repr, body.reduced.interfaces))}."
            )
        taken[interface] = item
        x, y, z = (float(v) for v in body.reduced.interfaces[interface].position)
        name = f"{body.name}-{interface}"
        # The item's own position stays: model.check() sees by it when the part lies somewhere else.
        result[name] = Connection(
            name, item, f"{body.name}.{interface}", position, (x, y, z), stiffness=LOCKED, elastic_centre=(x, y, z)
        )
    return result


def _interface(body: FlexibleBody, position: Point, chosen: str | None) -> str:
    if chosen is not None:
        return body.interface(chosen)
    frames = body.reduced.interfaces
    return min(frames, key=lambda name: float(np.linalg.norm(np.subtract(frames[name].position, position))))
