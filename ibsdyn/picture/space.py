"""The picture of a 3-D model: bodies, springs and grounds where they are."""

from __future__ import annotations

import itertools

import numpy as np

from ibsdyn.assembly import Assembly, Joint
from ibsdyn.axes import Array
from ibsdyn.components import Fixation, FlexibleBody, RigidBody
from ibsdyn.picture.shape import BOX_EDGES, BOX_FACES, NO_FACES, Shape, coil, triangles
from ibsdyn.picture.thinning import crease_edges, thinned

# Glyphs of fixations, connections and signals, as a share of the model's size.
GROUND_SIZE, SPRING_SIZE, ARROW_SIZE = 0.07, 0.022, 0.16


def shapes_in_space(assembly: Assembly, most_points: int) -> tuple[Shape, ...]:
    """Return bodies, connections and fixations as shapes.

    Parameters
    ----------
    assembly : of a 3-D model.
    most_points : meshes are thinned out until all of them together have no more.
    """
    size = model_size(assembly)
    meshes = sum(_mesh_points(item) for item in assembly.bodies)
    shapes: list[Shape] = []
    for item in assembly.bodies:
        if isinstance(item, RigidBody):
            shapes.append(_box(assembly, item))
        elif isinstance(item, FlexibleBody):
            allowed = int(most_points * _mesh_points(item) / max(meshes, 1))
            shapes.append(_flexible(assembly, item, allowed))
    shapes += [_spring(assembly, joint, SPRING_SIZE * size) for joint in assembly.joints]
    shapes += [_ground(assembly, fixation, GROUND_SIZE * size) for fixation in assembly.fixations]
    return tuple(shapes)


def model_size(assembly: Assembly) -> float:
    """Return the diagonal [m] of the box around all parts of a 3-D model; 1 for a single point."""
    places = [np.atleast_2d(assembly.frames[fixation.name]) for fixation in assembly.fixations]
    for item in assembly.bodies:
        if isinstance(item, RigidBody):
            places.append(box_corners(item))
        elif isinstance(item, FlexibleBody):
            display = item.reduced.display
            places.append(_frames(assembly, item) if display is None else display.points)
    for joint in assembly.joints:
        places.append(np.array([joint.connection.position1, joint.connection.position2], dtype=float))
    return float(np.linalg.norm(np.ptp(np.vstack(places), axis=0))) or 1.0


def box_corners(body: RigidBody) -> Array:
    """Return the eight corners [m] of the homogeneous box with the body's mass and inertia."""
    moments, axes = np.linalg.eigh(body.inertia_tensor)
    squares = 6.0 / body.mass * (moments.sum() - 2.0 * moments)
    half = 0.5 * np.sqrt(squares.clip(0.0))
    signs = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)]) * 2 - 1
    corners: Array = np.array(body.cog) + (signs * half) @ axes.T
    return corners


def point_rows(assembly: Assembly, item: str, points: Array) -> Array:
    """Return the (3 p, n) motion of points [m] that move with an item, over all coordinates."""
    return np.vstack([assembly.motion(item, point)[:3] for point in points])


def _mesh_points(item: object) -> int:
    display = item.reduced.display if isinstance(item, FlexibleBody) else None
    return 0 if display is None else len(display.points)


def _frames(assembly: Assembly, body: FlexibleBody) -> Array:
    return np.array([assembly.frames[f"{body.name}.{interface}"] for interface in body.reduced.interfaces])


def _box(assembly: Assembly, body: RigidBody) -> Shape:
    corners = box_corners(body)
    place = assembly.places[body.name]
    rows = point_rows(assembly, body.name, corners)[:, place]
    return Shape(body.name, "rigid body", corners, place, rows, triangles(BOX_FACES), BOX_EDGES)


def _flexible(assembly: Assembly, body: FlexibleBody, most_points: int) -> Shape:
    display = body.reduced.display
    if display is None:  # a superelement without a skin: a line from interface to interface
        ends = [f"{body.name}.{interface}" for interface in body.reduced.interfaces]
        rows = np.vstack([assembly.motion(end)[:3] for end in ends])
        everything = slice(0, len(assembly.names))
        lines = np.array([(i, i + 1) for i in range(len(ends) - 1)], dtype=np.int64).reshape(-1, 2)
        return Shape(body.name, "flexible body", _frames(assembly, body), everything, rows, lines=lines)
    points, faces, kept = thinned(display, most_points)
    rows = display.basis.reshape(len(display.points), 3, -1)[kept].reshape(3 * len(kept), -1)
    place = assembly.places[body.name]
    return Shape(body.name, "flexible body", points, place, rows, faces, crease_edges(points, faces))


def _spring(assembly: Assembly, joint: Joint, size: float) -> Shape:
    """A coil between the two positions, or an octahedron where they are one; thin lines to what it holds together."""
    connection = joint.connection
    start, end = np.array(connection.position1, dtype=float), np.array(connection.position2, dtype=float)
    first = point_rows(assembly, connection.item1, np.array([assembly.frames[connection.item1], start]))
    second = point_rows(assembly, connection.item2, np.array([assembly.frames[connection.item2], end]))
    levers = np.array([assembly.frames[connection.item1], start, assembly.frames[connection.item2], end])
    if np.linalg.norm(end - start) > size:
        glyph, lines = coil(start, end, 0.5 * size)
        along = np.linspace(0.0, 1.0, len(glyph))
        one, other = (point_rows(assembly, item, glyph) for item in (connection.item1, connection.item2))
        share = np.repeat(along, 3)[:, None]
        moved, faces = (1.0 - share) * one + share * other, NO_FACES
    else:
        corners = np.vstack([joint.centre + s * size * axis for axis in connection.axes_matrix.T for s in (1, -1)])
        one, other = (point_rows(assembly, item, corners) for item in (connection.item1, connection.item2))
        glyph, moved = corners, 0.5 * (one + other)
        faces = np.array([(x, y, z) for x, y, z in itertools.product((0, 1), (2, 3), (4, 5))])
        lines = np.array([(a, b) for a, b in itertools.combinations(range(6), 2) if a // 2 != b // 2])
    points = np.vstack([levers, glyph])
    return Shape(
        connection.name,
        "connection",
        points,
        slice(0, len(assembly.names)),
        np.vstack([first, second, moved]),
        faces + 4 if len(faces) else NO_FACES,
        np.vstack([[(0, 1), (2, 3)], lines + 4]),
    )


def _ground(assembly: Assembly, fixation: Fixation, size: float) -> Shape:
    """A pyramid on a hatched square behind the point that is held, on the side where the machine is not."""
    corners = np.array([(-1, -1, -1.6), (1, -1, -1.6), (1, 1, -1.6), (-1, 1, -1.6)], dtype=float)
    feet = np.linspace(-1, 1, 5)
    hatch = np.array([[(f, side, -1.6), (f - 0.35, side, -2.1)] for side in (-1, 1) for f in feet])
    points = size * np.vstack([np.zeros((1, 3)), corners, hatch.reshape(-1, 3)]) @ _away(assembly, fixation).T
    points = np.array(fixation.position) + points
    faces = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1), (1, 3, 2), (1, 4, 3)])
    outline = [(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)]
    strokes = [(5 + 2 * i, 6 + 2 * i) for i in range(2 * len(feet))]
    place = assembly.places[fixation.name]
    rows = point_rows(assembly, fixation.name, points)[:, place]
    return Shape(fixation.name, "fixation", points, place, rows, faces, np.array(outline + strokes))


def _away(assembly: Assembly, fixation: Fixation) -> Array:
    """Return the rotation whose z axis is the global axis that points most from the fixation to the bodies."""
    centre = np.mean([assembly.frames[body.name] for body in assembly.bodies], axis=0)
    towards = centre - np.array(fixation.position)
    if np.linalg.norm(towards) == 0:
        return np.eye(3)
    main = int(np.abs(towards).argmax())
    if main == 2 and towards[2] > 0:
        return np.eye(3)
    z = np.sign(towards[main]) * np.eye(3)[main]
    x = np.eye(3)[(main + 1) % 3]
    return np.column_stack([x, np.cross(z, x), z])


def arrow(assembly: Assembly, name: str, kind: str, item: str, position: Array, direction: Array, turns: bool) -> Shape:
    """Return an arrow that moves with a point of an item: where something acts or is measured, and in which sense.

    Parameters
    ----------
    assembly : of a 3-D model.
    name, kind : of the input or sensor.
    item, position, direction : which point (3,) [m] it belongs to, and where it points (3,).
    turns : draw an arc about the direction instead.
    """
    size = ARROW_SIZE * model_size(assembly)
    along = direction / np.linalg.norm(direction)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    third = np.cross(along, across)
    if turns:
        angles = np.linspace(0.0, 1.5 * np.pi, 19)
        arc = 0.5 * (np.outer(np.cos(angles), across) + np.outer(np.sin(angles), third))
        tip, forward, outward = arc[-1], across, arc[-1] / np.linalg.norm(arc[-1])
        head = np.array([tip - 0.25 * forward + s * 0.15 * outward for s in (1, -1)])
        shaft = np.vstack([np.zeros(3), 0.6 * along, arc])
        lines = [(0, 1), *((i, i + 1) for i in range(2, len(shaft) - 1))]
    else:
        tip = along
        head = np.array([0.72 * along + s * 0.12 * side for side in (across, third) for s in (1, -1)])
        shaft = np.vstack([np.zeros(3), tip])
        lines = [(0, 1)]
    end = len(shaft) - 1
    lines += [(end, len(shaft) + i) for i in range(len(head))]
    points = position + size * np.vstack([shaft, head])
    rows = np.tile(point_rows(assembly, item, position[None]), (len(points), 1))
    return Shape(name, kind, points, slice(0, len(assembly.names)), rows, lines=np.array(lines))
