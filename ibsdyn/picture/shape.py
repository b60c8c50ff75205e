"""A part of the picture: points, faces and lines that move with the model's coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array

IntArray: TypeAlias = NDArray[Any]

# Faces of a box whose corners are numbered in binary, x slowest.
BOX_FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
BOX_EDGES = np.array([(a, b) for a in range(8) for b in range(a, 8) if bin(a ^ b).count("1") == 1])
NO_FACES = np.zeros((0, 3), dtype=np.int64)
NO_LINES = np.zeros((0, 2), dtype=np.int64)
COIL_TURNS = 6


@dataclass(frozen=True, eq=False)
class Shape:
    """A part of the picture.

    Attributes
    ----------
    name, kind : whose picture it is; "rigid body", "flexible body", "connection", "fixation", "input" or "sensor".
    points : (p, 3) at rest [m].
    place : which of the assembly's coordinates move it.
    rows : (3 p, m) displacement of the points, x y z each, per coordinate of ``place`` [m].
    faces : (f, 3) triangles between the points.
    lines : (l, 2) lines between the points.
    """

    name: str
    kind: str
    points: Array
    place: slice
    rows: Array
    faces: IntArray = field(default_factory=lambda: NO_FACES)
    lines: IntArray = field(default_factory=lambda: NO_LINES)

    def displacements(self, shapes: Array) -> Array:
        """Return the motion of the points (p, 3, k) in mode shapes (n, k) over all coordinates."""
        moved: Array = (self.rows @ shapes[self.place]).reshape(len(self.points), 3, -1)
        return moved


def triangles(quadrilaterals: IntArray) -> IntArray:
    """Cut (q, 4) faces in two."""
    return np.vstack([quadrilaterals[:, [0, 1, 2]], quadrilaterals[:, [0, 2, 3]]])


def coil(start: Array, end: Array, radius: float) -> tuple[Array, IntArray]:
    """A flat zigzag with straight ends, as springs are drawn."""
    along = end - start
    length = float(np.linalg.norm(along))
    across = np.cross(along / length, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    share = np.r_[0.0, np.linspace(0.2, 0.8, 2 * COIL_TURNS + 1), 1.0]
    side = np.r_[0.0, 0.0, np.resize([1.0, -1.0], 2 * COIL_TURNS - 1), 0.0, 0.0]
    points = start + np.outer(share, along) + radius * np.outer(side, across)
    return points, np.array([(i, i + 1) for i in range(len(points) - 1)])
