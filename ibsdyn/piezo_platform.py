"""A shaker of three piezo actuators, and how a module is mounted on it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ibsdyn.axes import DIRECTIONS, Array, rigid_transfer, rotate_six
from ibsdyn.components import GLOBAL_AXES, Point
from ibsdyn.errors import ModelError, known_keywords, nearest
from ibsdyn.validation import number, numbers_of, point, rotation_matrix, valid_name

PLATE_MOTIONS = ("z", "rx", "ry")
_PLACES = [DIRECTIONS.index(motion) for motion in PLATE_MOTIONS]
# Piezos nearer to one line than this share of their distance cannot tilt the plate about it.
_ON_A_LINE = 1e-3

# Columns are the module's axes that the plate's x, y, z fall on; each is a cyclic change of axes.
_UP = {
    "x": ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "y": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
    "z": GLOBAL_AXES,
}


@dataclass(frozen=True, init=False)
class PiezoPlatform:
    """A plate on three piezo actuators along its z axis, which move it in z, rx and ry.

    Parameters
    ----------
    fixation : the model's fixation that stands on the plate.
    piezos : (3, 2) x and y of the three actuators from the middle of the plate, in the plate's axes [m].
    stroke : full stroke of an actuator, peak to peak [m].

    Raises
    ------
    ModelError : piezos on one line, or a stroke that cannot be.
    """

    fixation: str
    piezos: tuple[tuple[float, float], ...]
    stroke: float

    @known_keywords
    def __init__(self, fixation: str, piezos: Sequence[Sequence[float]] | Array, stroke: float = math.inf) -> None:
        what = "PiezoPlatform"
        name = valid_name(fixation, f"{what}: fixation")
        if not isinstance(piezos, (Sequence, np.ndarray)) or len(piezos) != 3:
            raise ModelError(f"{what}: piezos must be three places (x, y) [m], got {piezos!r}.")
        places = tuple(
            (x, y) for x, y in (numbers_of(place, 2, f"{what}: a piezo's place", "x, y [m]") for place in piezos)
        )
        sides = np.array(places)[1:] - np.array(places)[0]
        if not np.isfinite(sides).all() or abs(np.linalg.det(sides)) <= _ON_A_LINE * float(np.sum(sides**2)):
            raise ModelError(
                f"{what}: the piezos at {list(places)} stand on one line, about which they cannot tilt the plate."
            )
        fields = {
            "fixation": name,
            "piezos": places,
            "stroke": math.inf if stroke == math.inf else number(stroke, f"{what}: stroke", "m", above=0.0),
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    @property
    def strokes_per_motion(self) -> Array:
        """(3, 3) strokes of the piezos (rows) for a unit z [m], rx and ry [rad] of the plate (columns)."""
        return np.array([[1.0, y, -x] for x, y in self.piezos])

    def strokes(self, motion: str) -> Array:
        """Return the (3,) strokes that move the plate along or about one axis only, the largest of them 1.

        Raises
        ------
        ModelError : the motion is none of z, rx, ry.
        """
        if motion not in PLATE_MOTIONS:
            raise ModelError(f"the platform does not move in {motion!r}. {nearest(str(motion), PLATE_MOTIONS)}")
        column = self.strokes_per_motion[:, PLATE_MOTIONS.index(motion)]
        strokes: Array = column / np.abs(column).max()
        return strokes

    def motion(self, strokes: Sequence[float] | Array) -> Array:
        """Return the (6,) motion of the plate's middle, in the plate's axes, for three strokes [m]."""
        plate = np.zeros(6)
        plate[_PLACES] = np.linalg.solve(
            self.strokes_per_motion, np.array(numbers_of(strokes, 3, "strokes", "one a piezo"))
        )
        return plate


@dataclass(frozen=True, init=False)
class Orientation:
    """How a module is mounted on the plate.

    Parameters
    ----------
    name : as in "A".
    up : the module's axis that points along the plate's z: "x", "y" or "z"; the other axes follow cyclically.
    rotation : (3, 3) in place of ``up``: its columns are the plate's x, y, z in the module's (global) axes.
    offset : (3,) from the middle of the plate to the module's fixation, in the plate's axes [m].

    Raises
    ------
    ModelError : both or neither of ``up`` and ``rotation``, or one that cannot be.
    """

    name: str
    rotation: tuple[tuple[float, float, float], ...]
    offset: Point

    @known_keywords
    def __init__(
        self,
        name: str,
        up: str | None = None,
        rotation: Sequence[Sequence[float]] | Array | None = None,
        offset: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        what = f"Orientation {name!r}"
        if not isinstance(name, str) or not name.strip():
            raise ModelError(f"an orientation's name must be a non-empty text, got {name!r}.")
        if (up is None) == (rotation is None):
            raise ModelError(f"{what}: give up= (x, y or z) or rotation= (3 x 3), one of them.")
        if up is not None and up not in _UP:
            raise ModelError(f"{what}: up={up!r} is not known. {nearest(str(up), _UP)} Others by rotation=.")
        fields = {
            "name": name,
            "rotation": _UP[up] if up is not None else rotation_matrix(rotation, f"{what}: rotation"),
            "offset": point(offset, f"{what}: offset"),
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    def base_motion(self, plate: Sequence[float] | Array) -> Array:
        """Return the (6,) motion of the module's fixation in global axes for a small (6,) motion of the plate."""
        motion: Array = rotate_six(np.array(self.rotation)) @ rigid_transfer(self.offset) @ np.asarray(plate)
        return motion

    def in_module(self, vector: Sequence[float] | Array) -> Array:
        """Return a (3,) vector of the plate's axes, such as gravity, in global axes."""
        turned: Array = np.array(self.rotation) @ np.asarray(vector)
        return turned
