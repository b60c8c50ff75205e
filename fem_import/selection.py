"""Nodes picked by where they are: in a box, on a plane, around an axis, and any combination of these."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_import.errors import InterfaceError, UnknownKeywordError
from fem_import.fe_model import FEModel
from fem_import.keywords import known_keywords

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]

# Of the part's size: a mesh puts nodes on a face to about its printed coordinates, and no two nodes are as near.
_ON_THE_FACE = 1e-6


class Selection(ABC):
    """A region of space; ``a & b``, ``a | b`` and ``a - b`` combine regions."""

    @abstractmethod
    def distance(self, positions: FloatArray) -> FloatArray:
        """Return how far each of the positions (n, 3) [m] lies outside, (n,) [m]; 0 or less inside."""

    def contains(self, positions: FloatArray, tolerance: float) -> NDArray[np.bool_]:
        """Return which of the positions (n, 3) [m] lie inside or within the tolerance [m] of it, (n,)."""
        return np.asarray(self.distance(positions) <= tolerance)

    def nodes(self, part: FEModel) -> IntArray:
        """Return the ascending labels of the part's nodes inside that have degrees of freedom.

        Raises
        ------
        InterfaceError : there is none.
        """
        carrying = np.isin(part.node_ids, part.dofs[:, 0])
        positions, labels = part.positions[carrying], part.node_ids[carrying]
        size = float(np.linalg.norm(np.ptp(positions, axis=0)))
        found = labels[self.contains(positions, _ON_THE_FACE * size)]
        if len(found) == 0:
            distance = self.distance(positions)
            nearest = int(np.argmin(distance))
            x, y, z = positions[nearest]
            raise InterfaceError(
                f"No node of {part.source} lies in {self}. The nearest, {labels[nearest]} at ({x:.6g}, {y:.6g}, "
                f"{z:.6g}) m, is {distance[nearest]:.3g} m outside; the part's size is {size:.3g} m. Regions are in m."
            )
        return np.sort(found)

    def __and__(self, other: Selection) -> Selection:
        """Return what lies in both."""
        return _Both(self, other)

    def __or__(self, other: Selection) -> Selection:
        """Return what lies in either."""
        return _Either(self, other)

    def __sub__(self, other: Selection) -> Selection:
        """Return what lies in this one and not in the other."""
        return _Without(self, other)


@dataclass(frozen=True, init=False)
class Box(Selection):
    """All nodes in a box along the global axes.

    Parameters
    ----------
    lower, upper : (3,) corners [m]; infinite where the box is open.

    Raises
    ------
    InterfaceError : corners that are none, or a lower one above the upper one.
    """

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]

    @known_keywords(UnknownKeywordError)
    def __init__(self, lower: ArrayLike, upper: ArrayLike) -> None:
        corners = [
            _point(value, f"Box: {name}", open_ended=True) for name, value in (("lower", lower), ("upper", upper))
        ]
        if any(low > high for low, high in zip(*corners, strict=True)):
            raise InterfaceError(f"Box: lower {corners[0]} lies above upper {corners[1]} [m].")
        _set(self, lower=corners[0], upper=corners[1])

    def distance(self, positions: FloatArray) -> FloatArray:
        """Return the largest overshoot along an axis."""
        return np.asarray(np.max(np.maximum(self.lower - positions, positions - self.upper), axis=1))


@dataclass(frozen=True, init=False)
class Plane(Selection):
    """All nodes on a plane.

    Parameters
    ----------
    point : (3,) a point on it [m].
    normal : (3,) its length does not matter.
    thickness : nodes up to half of it to either side count too [m].

    Raises
    ------
    InterfaceError : a point or normal that is none, a negative thickness.
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    thickness: float

    @known_keywords(UnknownKeywordError)
    def __init__(self, point: ArrayLike, normal: ArrayLike, thickness: float = 0.0) -> None:
        _set(
            self,
            point=_point(point, "Plane: point"),
            normal=_unit(normal, "Plane: normal"),
            thickness=_length(thickness, "Plane: thickness"),
        )

    def distance(self, positions: FloatArray) -> FloatArray:
        """Return the distance from the plane, less half the thickness."""
        return np.asarray(abs((positions - self.point) @ np.array(self.normal)) - 0.5 * self.thickness)


@dataclass(frozen=True, init=False)
class Cylinder(Selection):
    """All nodes around an axis: the wall of a bolt hole, a bolt circle, a shaft's seat.

    A hole's own wall is what lies within a radius a little above the hole's.

    Parameters
    ----------
    point : (3,) a point on the axis [m].
    axis : (3,) along it; its length does not matter.
    radius : nodes up to this distance from the axis [m].
    inner_radius : and from this distance on [m].
    start, end : where it begins and ends along the axis, counted from the point [m]; without end if infinite.

    Raises
    ------
    InterfaceError : a point or axis that is none, radii or ends in the wrong order.
    """

    point: tuple[float, float, float]
    axis: tuple[float, float, float]
    radius: float
    inner_radius: float
    start: float
    end: float

    @known_keywords(UnknownKeywordError)
    def __init__(
        self,
        point: ArrayLike,
        axis: ArrayLike,
        radius: float,
        inner_radius: float = 0.0,
        start: float = -np.inf,
        end: float = np.inf,
    ) -> None:
        outer, inner = _length(radius, "Cylinder: radius"), _length(inner_radius, "Cylinder: inner_radius")
        if outer == 0.0 or inner > outer:
            raise InterfaceError(
                f"Cylinder: inner_radius {inner:g} and radius {outer:g} [m] leave nothing between them."
            )
        if not start <= end:
            raise InterfaceError(f"Cylinder: start {start!r} must not lie beyond end {end!r} [m].")
        _set(
            self,
            point=_point(point, "Cylinder: point"),
            axis=_unit(axis, "Cylinder: axis"),
            radius=outer,
            inner_radius=inner,
            start=float(start),
            end=float(end),
        )

    def distance(self, positions: FloatArray) -> FloatArray:
        """Return the largest overshoot beyond wall, bore and ends."""
        arms = positions - self.point
        along = arms @ np.array(self.axis)
        from_axis = np.linalg.norm(arms - np.outer(along, self.axis), axis=1)
        outside = np.maximum(from_axis - self.radius, self.inner_radius - from_axis)
        return np.asarray(np.maximum(outside, np.maximum(self.start - along, along - self.end)))


@dataclass(frozen=True)
class _Both(Selection):
    first: Selection
    second: Selection

    def distance(self, positions: FloatArray) -> FloatArray:
        return np.maximum(self.first.distance(positions), self.second.distance(positions))


@dataclass(frozen=True)
class _Either(Selection):
    first: Selection
    second: Selection

    def distance(self, positions: FloatArray) -> FloatArray:
        return np.minimum(self.first.distance(positions), self.second.distance(positions))


@dataclass(frozen=True)
class _Without(Selection):
    first: Selection
    second: Selection

    def distance(self, positions: FloatArray) -> FloatArray:
        return np.maximum(self.first.distance(positions), -self.second.distance(positions))

    def contains(self, positions: FloatArray, tolerance: float) -> NDArray[np.bool_]:
        # A node on the face of what is taken away goes with it: a - b and a & b share no node.
        return self.first.contains(positions, tolerance) & ~self.second.contains(positions, tolerance)


def _set(target: Selection, **fields: object) -> None:
    for name, value in fields.items():
        object.__setattr__(target, name, value)  # frozen: this is its constructor


def _point(value: ArrayLike, what: str, open_ended: bool = False) -> tuple[float, float, float]:
    try:
        point = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        point = np.empty(0)
    if point.shape != (3,) or np.any(np.isnan(point)) or (not open_ended and not np.all(np.isfinite(point))):
        raise InterfaceError(f"{what} must be three{'' if open_ended else ' finite'} numbers [m]; got {value!r}.")
    x, y, z = (float(number) for number in point)
    return x, y, z


def _unit(value: ArrayLike, what: str) -> tuple[float, float, float]:
    vector = np.array(_point(value, what))
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise InterfaceError(f"{what} must not be zero; got {value!r}.")
    x, y, z = (float(number) for number in vector / length)
    return x, y, z


def _length(value: float, what: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number) or number < 0.0:
        raise InterfaceError(f"{what} must be a length [m], not negative; got {value!r}.")
    return number
