"""Points that are watched, not connected: an accelerometer, the optical centre of a mirror."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import InterfaceError
from fem_import.fe_model import FEModel
from fem_import.interfaces import (
    Interface,
    Nodes,
    check_interface_name,
    checked_position,
    node_labels,
    positions_of,
    tells_rotation,
    tie_one,
)
from fem_import.rigid_motion import rigid_motion_at

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ObservedPoint:
    """A sensor point resolved on a model.

    position (3,) [m]; node_ids; rows: of the model's DoF that take part (m,); matrix (6, m) or (3, m): motion of
    the point = matrix @ u[rows], three translations only where the nodes do not hold a rotation.
    """

    name: str
    position: FloatArray
    node_ids: IntArray
    rows: IntArray
    matrix: FloatArray


def observed_points(
    part: FEModel, sensors: Mapping[str, Interface | Nodes], interface_names: tuple[str, ...]
) -> tuple[ObservedPoint, ...]:
    """Resolve sensor points on a model: the mean motion of one node or more, which adds no stiffness.

    Three nodes that are not on one line, or one with rotations of its own, tell rotations too; fewer tell the three
    translations at their mean.

    Raises
    ------
    InterfaceError : names or nodes that are none, a rigid tie, a position away from nodes that tell no rotation.
    """
    if not isinstance(sensors, Mapping):
        raise InterfaceError(f"sensors must be a mapping {{name: nodes}}; got {sensors!r}.")
    points = []
    for name, given in sensors.items():
        check_interface_name(name)
        if name in interface_names:
            raise InterfaceError(f"{name!r} is an interface already; a sensor point needs a name of its own.")
        points.append(_observed(part, name, given if isinstance(given, Interface) else Interface(given)))
    return tuple(points)


def _observed(part: FEModel, name: str, given: Interface) -> ObservedPoint:
    if given.tie == "rigid":
        raise InterfaceError(
            f"Sensor {name!r}: tie='rigid' would stiffen the part; make it an interface if that is meant."
        )
    nodes = [int(given.nodes)] if isinstance(given.nodes, (int, np.integer)) else given.nodes
    node_ids = node_labels(part, f"Sensor {name!r}", nodes)
    rows = np.flatnonzero(np.isin(part.dofs[:, 0], node_ids))
    if len(node_ids) == 1 and len(rows) == 6:
        return _of_a_node_that_turns(part, name, given, node_ids, rows)
    rows = rows[part.dofs[rows, 1] <= 3]
    if len(rows) != 3 * len(node_ids):
        raise InterfaceError(
            f"Sensor {name!r}: its {len(node_ids)} nodes have only {len(rows)} of {3 * len(node_ids)} translations "
            f"left in {part.source}: constrained away, or never in an element. Leave those nodes out."
        )
    if tells_rotation(part.positions[part.dof_nodes()[rows]], part.dofs[rows, 1]):
        tied = tie_one(part, name, Interface(node_ids, given.position, "average", given.weights), "average")
        return ObservedPoint(name, tied.position, tied.node_ids, tied.rows, tied.matrix)
    return _translations_only(part, name, given, node_ids, rows)


def _of_a_node_that_turns(
    part: FEModel, name: str, given: Interface, node_ids: IntArray, rows: IntArray
) -> ObservedPoint:
    at = positions_of(part, node_ids)[0]
    position = at if given.position is None else checked_position(f"Sensor {name!r}", given.position)
    matrix = rigid_motion_at(position, at)[:, part.dofs[rows, 1] - 1]
    return ObservedPoint(name, position, node_ids, rows, matrix)


def _translations_only(part: FEModel, name: str, given: Interface, node_ids: IntArray, rows: IntArray) -> ObservedPoint:
    centre = positions_of(part, node_ids).mean(axis=0)
    position = centre if given.position is None else checked_position(f"Sensor {name!r}", given.position)
    if np.linalg.norm(position - centre) > 1e-6 * np.linalg.norm(np.ptp(part.positions, axis=0)):
        shape = "a single node" if len(node_ids) == 1 else f"{len(node_ids)} nodes on one line"
        raise InterfaceError(
            f"Sensor {name!r} is {shape}, which tells no rotation, so its motion is known at {centre} m only, not at "
            f"{position} m. Give three nodes that are not on one line, or leave position away."
        )
    matrix = np.zeros((3, len(rows)))
    matrix[part.dofs[rows, 1] - 1, np.arange(len(rows))] = 1.0 / len(node_ids)
    return ObservedPoint(name, centre, node_ids, rows, matrix)
