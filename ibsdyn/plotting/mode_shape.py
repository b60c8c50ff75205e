"""A mode as a stick model: bodies as spiders from their frame to their connections, springs as dots between."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ibsdyn.assembly import Assembly
from ibsdyn.axes import Array
from ibsdyn.components import FlexibleBody

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

    from ibsdyn.modes import Modes

# The largest motion is drawn as this share of the model's size.
DRAWN_SHARE = 0.15


def plot_mode_shape(modes: Modes, mode: int, axes: Axes3D | None, scale: float | None) -> Axes3D:
    """Draw mode number ``mode`` (from 1); see ``Modes.plot_shape``."""
    if axes is None:
        import matplotlib.pyplot as plt

        figure = plt.figure(figsize=(6, 5.5), layout="constrained")
        axes = figure.add_subplot(projection="3d")
    assembly = modes._assembly
    shape = modes._full_shapes[:, mode - 1]
    sticks = _sticks(assembly, shape)
    surfaces = _surfaces(assembly, shape)
    at_rest = np.vstack([s[1] for s in sticks] + [s[1] for s in surfaces])
    moved_by = np.vstack([s[2] for s in sticks] + [s[2] for s in surfaces])
    size = float(np.linalg.norm(np.ptp(at_rest, axis=0)))
    largest = float(np.linalg.norm(moved_by, axis=1).max())
    if scale is None:
        scale = DRAWN_SHARE * size / largest if largest > 0 else 0.0
    names = [item.name for item in [*assembly.bodies, *assembly.fixations]]
    colours = {name: f"C{i % 10}" for i, name in enumerate(names)}
    for name, points, motion in sticks:
        axes.plot(*(1e3 * points.T), color="0.75", linewidth=1.0)
        axes.plot(*(1e3 * (points + scale * motion).T), color=colours[name], linewidth=2.0, marker="o", markersize=3)
    for name, points, motion, triangles in surfaces:
        deformed = 1e3 * (points + scale * motion)
        axes.plot_trisurf(
            *deformed.T, triangles=triangles, color=colours[name], alpha=0.55, linewidth=0.1, edgecolor="0.3"
        )
    for name in names:
        axes.plot([], [], [], color=colours[name], linewidth=2.0, label=name)
    _equal_scales(axes, 1e3 * np.vstack([at_rest, at_rest + scale * moved_by]))
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.set_zlabel("z [mm]")
    axes.set_title(f"mode {mode}: {modes.frequencies[mode - 1]:.4g} Hz", fontsize="medium")
    axes.legend(loc="upper left", fontsize="small")
    return axes


def _sticks(assembly: Assembly, shape: Array) -> list[tuple[str, Array, Array]]:
    """Return (item, points (p, 3), motion (p, 3)) of each line to draw."""
    sticks = []
    for joint in assembly.joints:
        for end in (joint.connection.item1, joint.connection.item2):
            owner = end.split(".", 1)[0]
            points = np.array([assembly.frames[end], joint.centre])
            sticks.append(_stick(assembly, owner, end, points, shape))
    for item in assembly.bodies:
        if isinstance(item, FlexibleBody) and item.reduced.display is None:
            ends = [f"{item.name}.{interface}" for interface in item.reduced.interfaces]
            points = np.array([assembly.frames[end] for end in ends])
            motion = np.array([(assembly.motion(end) @ shape)[:3] for end in ends])
            sticks.append((item.name, points, motion))
        elif not isinstance(item, FlexibleBody):
            frame = assembly.frames[item.name][None, :]
            sticks.append(_stick(assembly, item.name, item.name, frame, shape))
    return sticks


def _stick(assembly: Assembly, owner: str, end: str, points: Array, shape: Array) -> tuple[str, Array, Array]:
    motion = np.array([(assembly.motion(end, p) @ shape)[:3] for p in points])
    return owner, points, motion


def _surfaces(assembly: Assembly, shape: Array) -> list[tuple[str, Array, Array, np.ndarray]]:
    """Return (item, points, motion, triangles) of each flexible body that knows its surface."""
    surfaces = []
    for item in assembly.bodies:
        if isinstance(item, FlexibleBody) and item.reduced.display is not None:
            display = item.reduced.display
            motion = (display.basis @ shape[assembly.places[item.name]]).reshape(-1, 3)
            surfaces.append((item.name, display.points, motion, display.triangles))
    return surfaces


def _equal_scales(axes: Axes3D, points: Array) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, max(float((high - low).max()) / 2, 1e-3)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_zlim(middle[2] - half, middle[2] + half)
    axes.set_box_aspect((1, 1, 1))


