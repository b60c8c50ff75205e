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
from ibsdyn.signals import Output, Sensor

# Samples that are turned into motions at a time: rotation matrices of a long run would fill the memory.
CHUNK = 50_000


def parts_of(outputs: Sequence[Output]) -> tuple[tuple[Sensor, ...], Array]:
    """Return the sensors that outputs are made of, and the (n_outputs, n_sensors) weights of their signals."""
    sums = [((1.0, out),) if isinstance(out, Sensor) else out.parts for out in outputs]
    sensors = tuple(dict.fromkeys(sensor for parts in sums for _, sensor in parts))
    weights = np.zeros((len(outputs), len(sensors)))
    for row, parts in enumerate(sums):
        for weight, sensor in parts:
            weights[row, sensors.index(sensor)] += weight
    return sensors, weights


def recorded_items(sensors: Sequence[Sensor], assembly: Assembly, flexible: FlexibleMapping) -> dict[str, int]:
    """Return the items whose coordinates the sensors need, and how often differentiated."""
    needed: dict[str, int] = {}
    for sensor in sensors:
        for name in (sensor.item, sensor.relative_to):
            if name is not None:
                holder = _holder(name, assembly, flexible)
                needed[holder] = max(needed.get(holder, 0), sensor.order)
    return needed


def sensor_signals(
    sensors: Sequence[Sensor], coordinates: Mapping[str, Array], assembly: Assembly, flexible: FlexibleMapping
) -> Array:
    """Return (n_sensors, n_samples) values.

    Parameters
    ----------
    coordinates : by recorded item (orders, n_samples, n), as ``TimeIntegration.run`` returns them.
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
                item = _holder(name, assembly, flexible)
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


def _holder(name: str, assembly: Assembly, flexible: FlexibleMapping) -> str:
    """Return the item whose coordinates tell the motion of an item, an interface or a sensor point."""
    whole_body = flexible == "floating-frame" or name in assembly.sensor_points
    return name.split(".", 1)[0] if whole_body else name


def _seen(sensor: Sensor, frame: FrameMotion, lever: Array) -> Array:
    whole = frame.rotation() if sensor.is_rotation else frame.point(lever)
    seen: Array = whole[sensor.order] @ sensor.vector
    return seen


def _frame(name: str, coordinates: Array, assembly: Assembly, floating: FloatingFrame | None) -> FrameMotion:
    """Return the motion of the frame of an item, an interface or a sensor point."""
    item = assembly.items.get(name)
    if floating is None:
        if isinstance(item, FlexibleBody):
            return linear_frame(coordinates @ mean_motion(item).T)
        if name in assembly.sensor_points:
            return linear_frame(coordinates @ _watched(name, assembly).T)
        return tait_bryan_frame(coordinates)
    frame = euler_parameter_frame(coordinates[:, :, :7])
    if name in assembly.sensor_points:
        rows = _watched(name, assembly)
    elif "." in name:
        body = floating.body.reduced
        start = body.coordinates.index(f"{name.split('.', 1)[1]}.x")
        rows = np.eye(len(body.coordinates))[start : start + 6]
    else:
        rows = mean_motion(floating.body)
    return frame.carried(assembly.frames[name] - floating.origin, coordinates[:, :, 7:] @ rows[:, floating.kept].T)


def _watched(name: str, assembly: Assembly) -> Array:
    """Return the (6, n_body) motion of a sensor point; its last three rows are zero where it tells no rotation."""
    motion = assembly.sensor_points[name][1].motion
    return np.vstack([motion, np.zeros((6 - len(motion), motion.shape[1]))])
