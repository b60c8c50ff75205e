"""What sensors show of a run, from the coordinates of what they sit on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ibsdyn.assembly import Assembly, mean_motion
from ibsdyn.axes import Array
from ibsdyn.components import FlexibleBody
from ibsdyn.engine import FlexibleMapping
from ibsdyn.floating_frame import FloatingFrame
from ibsdyn.kinematics import FrameMotion, euler_parameter_frame, linear_frame, tait_bryan_frame
from ibsdyn.signals import Sensor

# Samples that are turned into motions at a time: rotation matrices of a long run would fill the memory.
CHUNK = 50_000


def recorded_items(sensors: Sequence[Sensor], assembly: Assembly, flexible: FlexibleMapping) -> list[str]:
    """Return the items whose coordinates the sensors need."""
    seen = [name for sensor in sensors for name in (sensor.item, sensor.relative_to) if name is not None]
    return list(dict.fromkeys(_holder(name, flexible) for name in seen))


def sensor_signals(
    sensors: Sequence[Sensor], coordinates: Mapping[str, Array], assembly: Assembly, flexible: FlexibleMapping
) -> Array:
    """Return (n_sensors, n_samples) values.

    Parameters
    ----------
    coordinates : by recorded item (3, n_samples, n), as ``TimeIntegration.run`` returns them.
    """
    count = next(iter(coordinates.values())).shape[1]
    values = np.empty((len(sensors), count))
    floating = {
        name: FloatingFrame(assembly.items[name])  # type: ignore[arg-type]  # the flexible ones
        for name in coordinates
        if flexible == "floating-frame" and isinstance(assembly.items.get(name), FlexibleBody)
    }
    for begin in range(0, count, CHUNK):
        part = slice(begin, min(begin + CHUNK, count))
        motions: dict[str, FrameMotion] = {}

        def motion(name: str, part: slice = part, motions: dict[str, FrameMotion] = motions) -> FrameMotion:
            if name not in motions:
                item = _holder(name, flexible)
                motions[name] = _frame(name, coordinates[item][:, part], assembly, floating.get(item))
            return motions[name]

        for row, sensor in enumerate(sensors):
            if assembly.axis is not None:
                values[row, part] = coordinates[sensor.item][sensor.order, part, 0]
                if sensor.relative_to is not None:
                    values[row, part] -= coordinates[sensor.relative_to][sensor.order, part, 0]
                continue
            at = np.array(sensor.position) if sensor.position is not None else assembly.frames[sensor.item]
            values[row, part] = _seen(sensor, motion(sensor.item), at - assembly.frames[sensor.item])
            if sensor.relative_to is not None:
                lever = at - assembly.frames[sensor.relative_to]
                values[row, part] -= _seen(sensor, motion(sensor.relative_to), lever)
    return values


def _holder(name: str, flexible: FlexibleMapping) -> str:
    return name.split(".", 1)[0] if flexible == "floating-frame" else name


def _seen(sensor: Sensor, frame: FrameMotion, lever: Array) -> Array:
    whole = frame.rotation() if sensor.is_rotation else frame.point(lever)
    seen: Array = whole[sensor.order] @ sensor.vector
    return seen


def _frame(name: str, coordinates: Array, assembly: Assembly, floating: FloatingFrame | None) -> FrameMotion:
    """Return the motion of the frame of an item or interface."""
    item = assembly.items.get(name)
    if floating is None:
        if isinstance(item, FlexibleBody):
            return linear_frame(coordinates @ mean_motion(item).T)
        return tait_bryan_frame(coordinates)
    frame = euler_parameter_frame(coordinates[:, :, :7])
    if "." in name:
        body = floating.body.reduced
        start = body.coordinates.index(f"{name.split('.', 1)[1]}.x")
        rows = np.eye(len(body.coordinates))[start : start + 6, floating.kept]
    else:
        rows = mean_motion(floating.body)[:, floating.kept]
    return frame.carried(assembly.frames[name] - floating.origin, coordinates[:, :, 7:] @ rows.T)
