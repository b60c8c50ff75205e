"""The picture of a 1-D model, which has no places in space: its parts lined up along the axis, a fixation first."""

from __future__ import annotations

import itertools

import numpy as np

from ibsdyn.assembly import Assembly
from ibsdyn.axes import DIRECTIONS, Array
from ibsdyn.components import Connection, Inertia1D
from ibsdyn.picture.shape import BOX_EDGES, BOX_FACES, IntArray, Shape, coil, triangles


def lined_up_shapes(assembly: Assembly) -> tuple[Shape, ...]:
    """Return bodies, connections and fixations of a 1-D model as shapes, in steps of 1 along its axis.

    A body's box has its inertia for volume, for want of anything that tells its size.
    """
    axis = str(assembly.axis)
    centres = _chain(assembly, DIRECTIONS.index(axis) % 3)
    largest = max(item.inertia for item in assembly.bodies if isinstance(item, Inertia1D))
    everything = slice(0, len(assembly.names))
    shapes = []
    for item in assembly.bodies:
        if isinstance(item, Inertia1D):
            half = max(0.28 * (item.inertia / largest) ** (1 / 3), 0.08)
            corners = np.array(list(itertools.product((-half, half), repeat=3)))
            points = centres[item.name] + corners
            rows = _axis_rows(assembly, axis, points - centres[item.name], item.name)
            shapes.append(
                Shape(
                    item.name,
                    "rigid body",
                    points,
                    slice(0, len(assembly.names)),
                    rows,
                    triangles(BOX_FACES),
                    BOX_EDGES,
                )
            )
    for joint in assembly.joints:
        shapes.append(_line_spring(assembly, axis, joint.connection, centres))
    for fixation in assembly.fixations:
        points, faces, lines = _wall(centres[fixation.name], DIRECTIONS.index(axis) % 3)
        rows = _axis_rows(assembly, axis, points - centres[fixation.name], fixation.name)
        shapes.append(Shape(fixation.name, "fixation", points, everything, rows, faces, lines))
    return tuple(shapes)


def _chain(assembly: Assembly, along: int) -> dict[str, Array]:
    """Place items by how many connections they are from the first fixation (or item), siblings side by side."""
    neighbours: dict[str, list[str]] = {name: [] for name in assembly.items}
    for joint in assembly.joints:
        neighbours[joint.connection.item1].append(joint.connection.item2)
        neighbours[joint.connection.item2].append(joint.connection.item1)
    level: dict[str, int] = {}
    roots = [fixation.name for fixation in assembly.fixations] or [next(iter(assembly.items))]
    for root in [*roots, *assembly.items]:
        if root in level:
            continue
        level[root] = 0
        waiting = [root]
        while waiting:
            here = waiting.pop(0)
            for other in neighbours[here]:
                if other not in level:
                    level[other] = level[here] + 1
                    waiting.append(other)
    centres = {}
    for step in range(max(level.values()) + 1):
        together = [name for name in assembly.items if level[name] == step]
        for place, name in enumerate(together):
            centre = np.zeros(3)
            centre[along] = step
            centre[(along + 1) % 3] = 0.8 * (place - (len(together) - 1) / 2)
            centres[name] = centre
    return centres


def _axis_rows(assembly: Assembly, axis: str, arms: Array, item: str) -> Array:
    """Rows of points at arms (p, 3) about an item's centre, which moves along or turns about the axis."""
    direction = np.eye(3)[DIRECTIONS.index(axis) % 3]
    per_unit = np.cross(direction, arms) if axis.startswith("r") else np.broadcast_to(direction, arms.shape)
    rows: Array = np.outer(per_unit.ravel(), assembly.motion(item)[DIRECTIONS.index(axis)])
    return rows


def _line_spring(assembly: Assembly, axis: str, connection: Connection, centres: dict[str, Array]) -> Shape:
    start, end = centres[connection.item1], centres[connection.item2]
    points, lines = coil(start, end, 0.09)
    share = np.linspace(0.0, 1.0, len(points))[:, None]
    arms = points - (start + share * (end - start))
    one, other = (_axis_rows(assembly, axis, arms, item) for item in (connection.item1, connection.item2))
    weight = np.repeat(share, 3, axis=0)
    rows = (1.0 - weight) * one + weight * other
    return Shape(connection.name, "connection", points, slice(0, len(assembly.names)), rows, lines=lines)


def _wall(centre: Array, along: int) -> tuple[Array, IntArray, IntArray]:
    """A hatched square across the axis."""
    across = np.eye(3)[[(along + 1) % 3, (along + 2) % 3]]
    back = -0.12 * np.eye(3)[along]
    square = 0.3 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) @ across
    feet = np.linspace(-0.3, 0.3, 6)
    starts = [f * across[0] - 0.3 * across[1] for f in feet]
    hatch = [point for start in starts for point in (start, start - 0.08 * across[0] + back)]
    points = centre + np.vstack([square, *hatch])
    lines = [(0, 1), (1, 2), (2, 3), (3, 0), *((4 + 2 * i, 5 + 2 * i) for i in range(len(feet)))]
    return points, np.array([(0, 1, 2), (0, 2, 3)]), np.array(lines)
