"""Nastran coordinate systems: CORD2R, CORD2C and CORD2S, in which grid points and their displacements may be given."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError

FloatArray: TypeAlias = NDArray[np.float64]

KINDS = ("CORD2R", "CORD2C", "CORD2S")
_BASIC = 0


class CoordinateSystems:
    """The systems of a bulk data file by number; 0 is the basic one."""

    def __init__(self) -> None:
        self._defined: dict[int, tuple[str, int, FloatArray, str]] = {}
        self._frames: dict[int, tuple[FloatArray, FloatArray]] = {_BASIC: (np.zeros(3), np.eye(3))}

    def define(self, number: int, kind: str, reference: int, points: FloatArray, where: str) -> None:
        """Take a card: points (3, 3) in system `reference`: the origin, one on the z axis, one in the xz plane."""
        self._defined[number] = (kind, reference, points, where)

    def position(self, number: int, coordinates: FloatArray, where: str) -> FloatArray:
        """Return a point in basic coordinates."""
        origin, axes = self._frame(number, where, ())
        return np.asarray(origin + axes @ _rectangular(self._kind(number), coordinates))

    def axes_at(self, number: int, position: FloatArray, where: str) -> FloatArray:
        """Return the directions of a system at a basic position, as columns in basic axes."""
        origin, axes = self._frame(number, where, ())
        x, y, z = axes.T @ (position - origin)
        kind = self._kind(number)
        if kind == "CORD2R":
            return axes
        azimuth = np.arctan2(y, x)
        outwards, round_about = (
            np.array([np.cos(angle), np.sin(angle), 0.0]) for angle in (azimuth, azimuth + np.pi / 2)
        )
        upwards = np.array([0.0, 0.0, 1.0])
        if kind == "CORD2C":
            return np.asarray(axes @ np.column_stack([outwards, round_about, upwards]))
        polar = np.arctan2(np.hypot(x, y), z)
        radial = np.sin(polar) * outwards + np.cos(polar) * upwards
        downwards = np.cos(polar) * outwards - np.sin(polar) * upwards
        return np.asarray(axes @ np.column_stack([radial, downwards, round_about]))

    def _kind(self, number: int) -> str:
        return "CORD2R" if number == _BASIC else self._defined[number][0]

    def _frame(self, number: int, where: str, above: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """Return the origin and the axes (columns); `above`: the systems that are defined in this one."""
        if number in self._frames:
            return self._frames[number]
        if number not in self._defined:
            raise ExportError(
                f"{where}: coordinate system {number} is not defined by a CORD2R, CORD2C or CORD2S of the file. Put "
                "its card there, or write the grid points in the basic system (CP and CD blank) and export again."
            )
        kind, reference, points, card = self._defined[number]
        if number in above:
            raise ExportError(f"{card}: {kind} {number} is defined in a system that is defined in it.")
        origin, axes = self._frame(reference, card, (*above, number))
        start, on_z, in_xz = (origin + axes @ _rectangular(self._kind(reference), point) for point in points)
        z, x = on_z - start, in_xz - start
        y = np.cross(z, x)
        lengths = np.linalg.norm(z), np.linalg.norm(y)
        if not lengths[1] > 1e-9 * np.linalg.norm(z) * np.linalg.norm(x):
            raise ExportError(f"{card}: the three points of {kind} {number} lie on a line.")
        z, y = z / lengths[0], y / lengths[1]
        self._frames[number] = (start, np.column_stack([np.cross(y, z), y, z]))
        return self._frames[number]


def _rectangular(kind: str, coordinates: FloatArray) -> FloatArray:
    """Return x, y, z of r, theta, z (CORD2C) or r, theta, phi (CORD2S), angles in degrees."""
    if kind == "CORD2R":
        return coordinates
    first, second = np.radians(coordinates[1:])
    radius = coordinates[0]
    if kind == "CORD2C":
        return np.array([radius * np.cos(first), radius * np.sin(first), coordinates[2]])
    across = radius * np.sin(first)
    return np.array([across * np.cos(second), across * np.sin(second), radius * np.cos(first)])
