"""Where a beam goes when its mirrors move: optical sensitivities of flat mirrors in 3-D.

To first order, from the law of reflection: a direction d leaves a mirror of normal n as d - 2 (d·n) n. A mirror that
turns by theta turns its normal by theta x n; one whose surface moves by u at the point of incidence moves that point
along the incoming beam by n·u / n·d.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fem_import.names import ReadOnlyMapping
from ibsdyn.axes import DIRECTIONS, Array, skew
from ibsdyn.components import Point
from ibsdyn.errors import ModelError, UnknownNameError, known_keywords, nearest
from ibsdyn.signals import CombinedSensor, Sensor
from ibsdyn.validation import number, point

# A beam that meets a mirror at less than this angle grazes it: the point of incidence is anywhere [rad].
GRAZING = 1e-3
# A sensitivity below this share of the largest one is rounding of zero.
ROUNDING = 1e-12


@dataclass(frozen=True, init=False)
class FlatMirror:
    """A flat mirror that moves with an item of a model.

    Parameters
    ----------
    item : a body, an interface or a sensor point; a fixation for a mirror that stands still.
    position : (3,) a point of its reflecting plane [m].
    normal : (3,) normal of that plane; its length and sign do not matter.

    Raises
    ------
    ModelError : a normal of zero length, a position that is none.
    """

    item: str
    position: Point
    normal: Point

    @known_keywords
    def __init__(self, item: str, position: Sequence[float], normal: Sequence[float]) -> None:
        what = f"mirror on {item!r}"
        object.__setattr__(self, "item", item)
        object.__setattr__(self, "position", point(position, f"{what}: position"))
        object.__setattr__(self, "normal", _unit(normal, f"{what}: normal"))


@dataclass(frozen=True, eq=False, init=False)
class BeamPath:
    """A beam that is reflected by mirrors in turn and ends on a detector plane across it.

    Parameters
    ----------
    origin : (3,) where the beam starts [m].
    direction : (3,) of the beam there; its length does not matter.
    mirrors : FlatMirror in the order in which the beam meets them.
    length : from the last mirror to the detector [m].
    up : (3,) the detector's first axis u, made perpendicular to the beam; the global axis most across the beam if None.
        The second is v = beam x u.
    source, detector : items that the beam's source and the detector move with; they stand still if None.

    Raises
    ------
    ModelError : a beam that misses or grazes a mirror, or numbers that are none.

    Attributes
    ----------
    points : (n_mirrors + 2, 3) origin, points of incidence, detector [m].
    u, v : (3,) axes of the detector.
    angle : {element: (2, 6)} turn of the final beam towards u and v as the detector sees it, per motion x, y, z
        [rad/m], rx, ry, rz [rad/rad] of the element at its point on the beam. Elements are called as the mirrors' items
        (a second one "mirror (2)"), "source" and "detector".
    displacement : {element: (2, 6)} shift of the beam on the detector along u and v, the same way [m/m], [m/rad].
    """

    mirrors: tuple[FlatMirror, ...]
    points: Array
    u: Array
    v: Array
    angle: Mapping[str, Array]
    displacement: Mapping[str, Array]
    _elements: Mapping[str, tuple[str, Point]]

    @known_keywords
    def __init__(
        self,
        origin: Sequence[float],
        direction: Sequence[float],
        mirrors: FlatMirror | Sequence[FlatMirror],
        length: float,
        up: Sequence[float] | None = None,
        source: str | None = None,
        detector: str | None = None,
    ) -> None:
        given = mirrors if isinstance(mirrors, (list, tuple)) else [mirrors]
        listed = [mirror for mirror in given if isinstance(mirror, FlatMirror)]
        if not listed or len(listed) < len(given):
            raise ModelError(f"beam path: mirrors must be ibs.FlatMirror, one at least, got {mirrors!r}.")
        at, d = np.array(point(origin, "beam path: origin")), np.array(_unit(direction, "beam path: direction"))
        reach = number(length, "beam path: length", "m", minimum=0.0)
        points = [at]
        elements: dict[str, tuple[str, Point]] = {}
        # How the beam moves sideways where it is, and how it turns, per motion of each element.
        shifts: dict[str, Array] = {}
        turns: dict[str, Array] = {}
        if source is not None:
            elements["source"] = (source, _as_point(at))
            shifts["source"] = np.hstack([np.eye(3), np.zeros((3, 3))])
            turns["source"] = np.hstack([np.zeros((3, 3)), -skew(d)])
        for mirror in listed:
            n = np.array(mirror.normal)
            distance = _distance(at, d, mirror)
            at = at + distance * d
            reflect = np.eye(3) - 2 * np.outer(n, n)
            along = np.outer(d, n) / (n @ d)  # what moves the surface moves the point of incidence along the beam
            for earlier in shifts:
                shifts[earlier] = (np.eye(3) - along) @ (shifts[earlier] + distance * turns[earlier])
                turns[earlier] = reflect @ turns[earlier]
            label = _label(mirror.item, elements)
            elements[label] = (mirror.item, _as_point(at))
            shifts[label] = np.hstack([along, np.zeros((3, 3))])
            normal_turn = -skew(n)  # theta x n
            turns[label] = np.hstack([np.zeros((3, 3)), -2 * (np.outer(n, d) + (n @ d) * np.eye(3)) @ normal_turn])
            d = reflect @ d
            points.append(at)
        points.append(at + reach * d)
        u = _across(d, up)
        v = np.cross(d, u)
        axes = np.vstack([u, v])
        angle = {label: axes @ turn for label, turn in turns.items()}
        displacement = {label: axes @ (shifts[label] + reach * turns[label]) for label in shifts}
        if detector is not None:
            elements["detector"] = (detector, _as_point(points[-1]))
            displacement["detector"] = np.hstack([-axes, np.zeros((2, 3))])
            angle["detector"] = np.hstack([np.zeros((2, 3)), np.vstack([-v, u])])  # -(theta x d) along u and v
        fields = {
            "mirrors": tuple(listed),
            "points": np.array(points),
            "u": u,
            "v": v,
            "angle": ReadOnlyMapping(angle),
            "displacement": ReadOnlyMapping(displacement),
            "_elements": ReadOnlyMapping(elements),
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    @known_keywords
    def sensor(self, what: str, axis: str, name: str | None = None, quantity: str = "displacement") -> CombinedSensor:
        """Return the motion of the final beam as an output for FRFs, budgets and simulations.

        Parameters
        ----------
        what : "angle" [rad] or "displacement" on the detector [m].
        axis : "u" or "v".
        name : how results call it.
        quantity : "displacement"; "velocity" or "acceleration" give its derivatives.

        Raises
        ------
        UnknownNameError : another word for what or axis.
        """
        if what not in ("angle", "displacement"):
            raise UnknownNameError(f"a beam has no {what!r}. {nearest(str(what), ('angle', 'displacement'))}")
        if axis not in ("u", "v"):
            raise UnknownNameError(f"the detector has no axis {axis!r}; its axes are 'u' and 'v'.")
        table = self.angle if what == "angle" else self.displacement
        row = ("u", "v").index(axis)
        parts = [
            (float(weight), Sensor(*self._sensed(label, direction), quantity))
            for label, sensitivity in table.items()
            for direction, weight in zip(DIRECTIONS, sensitivity[row], strict=True)
            if abs(weight) > ROUNDING * np.abs(sensitivity).max()
        ]
        per_time = {"displacement": "", "velocity": "/s", "acceleration": "/s²"}
        if quantity not in per_time:
            raise UnknownNameError(f"quantity {quantity!r} is not known. {nearest(str(quantity), per_time)}")
        unit = ("rad" if what == "angle" else "m") + per_time[quantity]
        return CombinedSensor(f"beam {what} {axis}" if name is None else name, parts, unit)

    def _sensed(self, label: str, direction: str) -> tuple[str, str, Point]:
        item, place = self._elements[label]
        return item, direction, place

    def __str__(self) -> str:
        """Return the path and the sensitivities in words."""
        lines = [" -> ".join(f"({', '.join(f'{round(x, 9) + 0.0:.4g}' for x in p)})" for p in self.points) + " m"]
        for title, table, units in (
            ("beam angle", self.angle, ("rad/m", "rad/rad")),
            ("beam displacement", self.displacement, ("m/m", "m/rad")),
        ):
            for label, sensitivity in table.items():
                for axis, row in zip("uv", sensitivity, strict=True):
                    shown = [
                        f"{weight:+.4g} {direction} [{units[k >= 3]}]"
                        for k, (direction, weight) in enumerate(zip(DIRECTIONS, row, strict=True))
                        if abs(weight) > ROUNDING * np.abs(sensitivity).max()
                    ]
                    lines.append(f"{title} {axis} per motion of {label}: {', '.join(shown) or 'none'}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)


def _distance(at: Array, d: Array, mirror: FlatMirror) -> float:
    n, place = np.array(mirror.normal), np.array(mirror.position)
    if abs(n @ d) < GRAZING:
        raise ModelError(
            f"beam path: the beam runs along the mirror on {mirror.item!r} (angle {abs(n @ d):.2g} rad); check normal."
        )
    distance = float(n @ (place - at) / (n @ d))
    if distance < 0:
        raise ModelError(
            f"beam path: the beam runs away from the mirror on {mirror.item!r}, which lies {-distance:.4g} m behind it."
        )
    return distance


def _label(item: str, known: Mapping[str, object]) -> str:
    count = 2
    label = item
    while label in known:
        label, count = f"{item} ({count})", count + 1
    return label


def _as_point(place: Array) -> Point:
    x, y, z = (float(c) for c in place)
    return x, y, z


def _across(d: Array, up: Sequence[float] | None) -> Array:
    wanted = np.eye(3)[int(np.argmin(np.abs(d)))] if up is None else np.array(_unit(up, "beam path: up"))
    across = wanted - (wanted @ d) * d
    size = float(np.linalg.norm(across))
    if size < GRAZING:
        raise ModelError(f"beam path: up {tuple(wanted)} lies along the final beam {tuple(np.round(d, 6))}.")
    unit: Array = across / size
    return unit


def _unit(value: Sequence[float], what: str) -> Point:
    vector = np.array(point(value, what))
    largest = float(np.abs(vector).max())
    if largest == 0.0:
        raise ModelError(f"{what} must not be zero, got {tuple(vector.tolist())}.")
    vector /= largest  # its square may be beyond what a float can hold
    x, y, z = (float(c) for c in vector / np.linalg.norm(vector))
    return x, y, z
