"""The model and its modes as one set of points for the page's 3-D view."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ibsdyn.assembly import Assembly
from ibsdyn.axes import DIRECTIONS, Array, is_rotation
from ibsdyn.errors import ModelError
from ibsdyn.model import Model
from ibsdyn.modes import Modes
from ibsdyn.picture import Shape, arrow, lined_up_shapes, shapes_in_space
from ibsdyn.reporting.packing import packed
from ibsdyn.signals import CombinedSensor, Input, Sensor, Stroke, Torque

# What keeps a page below a few megabytes: points of meshes, and points times modes.
MOST_POINTS, MOST_MOTIONS = 6000, 120_000
# The largest motion is drawn as this share of the model's size, before the reader turns it up or down.
DRAWN_SHARE = 0.1
BODY_COLOURS = ("#3b76af", "#d08a2e", "#5a9a68", "#8a6bb1", "#b5655f", "#4a9aa8", "#9a8450", "#6b7f94")
COLOURS = {"connection": "#c2410c", "fixation": "#3d4854", "sensor": "#0b7a75", "input": "#be123c"}
OPACITY = {"rigid body": 0.32, "flexible body": 1.0, "connection": 0.9, "fixation": 0.55, "sensor": 1.0, "input": 1.0}


def scene_data(model: Model, modes: Modes, numbers: Sequence[int]) -> dict[str, Any]:
    """Return parts, points and the motion of the points in some modes (from 0)."""
    assembly = model.assembly()
    if assembly.axis is None:
        shapes = [
            *shapes_in_space(assembly, min(MOST_POINTS, MOST_MOTIONS // max(len(numbers), 1))),
            *_arrows(assembly, model),
        ]
    else:
        shapes = list(lined_up_shapes(assembly))
    points = np.vstack([shape.points for shape in shapes])
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    size = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    motion = np.concatenate([shape.displacements(modes._full_shapes[:, list(numbers)]) for shape in shapes])
    return {
        "schematic": assembly.axis is not None,
        "centre": [float(value) for value in centre],
        "size": size,
        "positions": packed(points - centre, "f4"),
        "faces": packed(_numbered(shapes, "faces"), "u4"),
        "lines": packed(_numbered(shapes, "lines"), "u4"),
        "parts": _parts(shapes),
        "modes": [_mode(motion[:, :, place], size) for place in range(len(numbers))],
    }


def _mode(motion: Array, size: float) -> dict[str, Any]:
    """Scale to 16 bits: the largest of the three components is DRAWN_SHARE of the size at 32767."""
    largest = float(np.linalg.norm(motion, axis=1).max())
    drawn = motion / largest if largest > 0 else motion
    return {"unit": DRAWN_SHARE * size / 32767, "motion": packed(np.round(32767 * drawn), "i2")}


def _numbered(shapes: Iterable[Shape], field: str) -> Array:
    start, found = 0, []
    for shape in shapes:
        found.append(getattr(shape, field).ravel() + start)
        start += len(shape.points)
    return np.concatenate(found)


def _parts(shapes: Iterable[Shape]) -> list[dict[str, Any]]:
    parts = []
    points = faces = lines = bodies = 0
    for shape in shapes:
        if shape.kind in COLOURS:
            colour = COLOURS[shape.kind]
        else:
            colour = BODY_COLOURS[bodies % len(BODY_COLOURS)]
            bodies += 1
        parts.append(
            {
                "name": shape.name,
                "kind": shape.kind,
                "colour": colour,
                "opacity": OPACITY[shape.kind],
                "points": [points, len(shape.points)],
                "faces": [faces, 3 * len(shape.faces)],
                "lines": [lines, 2 * len(shape.lines)],
            }
        )
        points, faces, lines = points + len(shape.points), faces + 3 * len(shape.faces), lines + 2 * len(shape.lines)
    return parts


def _arrows(assembly: Assembly, model: Model) -> list[Shape]:
    arrows = []
    signals: list[tuple[str, str, Input | Sensor]] = [(name, "input", signal) for name, signal in model.inputs.items()]
    for name, sensor in model.sensors.items():
        parts = [part for _, part in sensor.parts] if isinstance(sensor, CombinedSensor) else [sensor]
        signals += [(name, "sensor", part) for part in parts]
    for name, kind, signal in signals:
        try:
            item, place, direction, turns = _where(assembly, signal)
        except ModelError:
            continue  # a signal that this model does not have: model.check() tells, and the page prints that
        arrows.append(arrow(assembly, name, kind, item, place, direction, turns))
    return arrows


def _where(assembly: Assembly, signal: Input | Sensor) -> tuple[str, Array, Array, bool]:
    """Return the item, the point, the direction, and whether it turns; ModelError for what the model does not have."""
    if isinstance(signal, Stroke):
        for joint in assembly.joints:
            if joint.name == signal.item:
                axis = joint.connection.axes_matrix[:, DIRECTIONS.index(str(signal.direction)) % 3]
                return joint.connection.item2, joint.centre, axis, signal.is_rotation
        raise ModelError(f"{signal.name}: {signal.item!r} is no connection of the model.")
    assembly.address(signal.item, signal.name)
    turns, direction = _direction(signal)
    position = getattr(signal, "position", None)  # torques and base motions have none
    place = assembly.frames[signal.item] if position is None else np.array(position)
    return signal.item, place, direction, turns


def _direction(signal: Input | Sensor) -> tuple[bool, Array]:
    if isinstance(signal.direction, str):
        return is_rotation(signal.direction), np.eye(3)[DIRECTIONS.index(signal.direction) % 3]
    return isinstance(signal, Torque), np.array(signal.direction)
