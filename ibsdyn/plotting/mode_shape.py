"""A mode in space: rigid bodies as boxes of their inertia, flexible bodies as their mesh, connections as springs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ibsdyn.assembly import Assembly
from ibsdyn.axes import Array
from ibsdyn.components import FlexibleBody, RigidBody
from ibsdyn.picture import BOX_EDGES, BOX_FACES, box_corners, point_rows

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

    from ibsdyn.modes import Modes

# The largest motion is drawn as this share of the model's size.
DRAWN_SHARE = 0.12


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Something to draw: points (p, 3), their motion (p, 3), faces and lines between them, whose it is."""

    name: str
    points: Array
    motion: Array
    faces: np.ndarray | None
    lines: np.ndarray


def plot_mode_shape(modes: Modes, mode: int, axes: Axes3D | None, scale: float | None) -> Axes3D:
    """Draw mode number ``mode`` (from 1); see ``Modes.plot_shape``."""
    if axes is None:
        import matplotlib.pyplot as plt

        figure = plt.figure(figsize=(6.5, 5.5), layout="constrained")
        axes = figure.add_subplot(projection="3d")
    assembly = modes._assembly
    drawn = _drawn(assembly, modes._full_shapes[:, mode - 1])
    points = np.vstack([part.points for part in drawn])
    motion = np.vstack([part.motion for part in drawn])
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    largest = float(np.linalg.norm(motion, axis=1).max())
    if scale is None:
        scale = DRAWN_SHARE * size / largest if largest > 0 else 0.0
    colours = {item.name: f"C{i % 10}" for i, item in enumerate(assembly.bodies)}
    for part in drawn:
        _draw(axes, part, scale, colours.get(part.name, "0.2"))
    for name, colour in colours.items():
        axes.plot([], [], [], color=colour, linewidth=5, alpha=0.7, label=name)
    for fixation in assembly.fixations:
        x, y, z = 1e3 * assembly.frames[fixation.name]
        axes.scatter([x], [y], [z], color="k", marker="^", s=40, label=fixation.name)
    _equal_scales(axes, 1e3 * np.vstack([points, points + scale * motion]))
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.set_zlabel("z [mm]")
    axes.set_title(f"mode {mode}: {modes.frequencies[mode - 1]:.4g} Hz", fontsize="medium")
    axes.legend(loc="upper left", bbox_to_anchor=(-0.12, 1.0), fontsize="small", frameon=False)
    return axes


def _drawn(assembly: Assembly, shape: Array) -> list[_Drawn]:
    drawn = []
    for item in assembly.bodies:
        if isinstance(item, RigidBody):
            corners = box_corners(item)
            drawn.append(_Drawn(item.name, corners, _motion(assembly, item.name, corners, shape), BOX_FACES, BOX_EDGES))
        elif isinstance(item, FlexibleBody):
            drawn.append(_flexible(assembly, item, shape))
    for joint in assembly.joints:
        # From each side's own place to the elastic centre, both ends with their own motion: the gap is the strain.
        for end, position in (
            (joint.connection.item1, joint.connection.position1),
            (joint.connection.item2, joint.connection.position2),
        ):
            points = np.array([position, joint.centre], dtype=float)
            drawn.append(_Drawn(joint.name, points, _motion(assembly, end, points, shape), None, np.array([(0, 1)])))
    return drawn


def _flexible(assembly: Assembly, body: FlexibleBody, shape: Array) -> _Drawn:
    display = body.reduced.display
    if display is not None:
        motion = (display.basis @ shape[assembly.places[body.name]]).reshape(-1, 3)
        return _Drawn(body.name, display.points, motion, display.triangles, np.zeros((0, 2), dtype=int))
    ends = [f"{body.name}.{interface}" for interface in body.reduced.interfaces]
    points = np.array([assembly.frames[end] for end in ends])
    motion = np.array([(assembly.motion(end) @ shape)[:3] for end in ends])
    lines = np.array([(i, i + 1) for i in range(len(ends) - 1)]).reshape(-1, 2)
    return _Drawn(body.name, points, motion, None, lines)


def _motion(assembly: Assembly, item: str, points: Array, shape: Array) -> Array:
    return (point_rows(assembly, item, points) @ shape).reshape(-1, 3)


def _draw(axes: Axes3D, part: _Drawn, scale: float, colour: str) -> None:
    rest, moved = 1e3 * part.points, 1e3 * (part.points + scale * part.motion)
    for a, b in part.lines:
        axes.plot(*rest[[a, b]].T, color="0.7", linewidth=0.7)
        axes.plot(*moved[[a, b]].T, color=colour, linewidth=1.2)
    if part.faces is not None:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        # A mesh is seen as the part it is; the box stands for any shape with its inertia, so one looks through it.
        opacity = 0.3 if part.faces is BOX_FACES else 1.0
        faces = Poly3DCollection(moved[part.faces], facecolors=colour, linewidths=0, alpha=opacity, shade=True)
        axes.add_collection3d(faces)


def _equal_scales(axes: Axes3D, points: Array) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    span = np.maximum(high - low, 0.25 * float((high - low).max()))
    middle = (low + high) / 2
    axes.set_xlim(middle[0] - span[0] / 2, middle[0] + span[0] / 2)
    axes.set_ylim(middle[1] - span[1] / 2, middle[1] + span[1] / 2)
    axes.set_zlim(middle[2] - span[2] / 2, middle[2] + span[2] / 2)
    axes.set_box_aspect(tuple(span), zoom=0.92)  # room for the axis labels
    axes.locator_params(nbins=4)
