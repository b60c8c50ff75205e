"""Accelerometers: where they sit, what they get wrong, and what they read of a simulated motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ibsdyn.axes import Array
from ibsdyn.components import Point
from ibsdyn.errors import ModelError, RecordError, RecordWarning, known_keywords, warn_user
from ibsdyn.signals import Direction, Sensor
from ibsdyn.time_record import TimeRecord
from ibsdyn.validation import checked_names, checked_seed, number, numbers_of, point

UNIT = "m/s²"
_AXES = ("x", "y", "z")
_STILL = (0.0, 0.0, 0.0)


@dataclass(frozen=True, init=False)
class Accelerometer:
    """An accelerometer glued to an item: its place, its direction and its data sheet.

    Parameters
    ----------
    name : the name of its channel.
    item : a body, a fixation or an interface, with which it moves and turns.
    position : (3,) where it measures, global axes [m].
    direction : "x", "y", "z" or a 3-vector (its length does not matter).
    noise_density : one-sided amplitude spectral density of its white noise [m/s²/√Hz].
    range : largest acceleration that it can show, of either sign [m/s²].
    cross_axis : fraction of the motion across that it senses too; one number for both directions across, or one each
        (see ``across``).
    dc_coupled : it shows constant acceleration, so its share of gravity; otherwise the mean is taken off, as the
        high-pass of a charge amplifier does. A tilt that varies within the band is felt by either kind.

    Raises
    ------
    ModelError : a direction that is no translation, or a figure that no data sheet can have.
    """

    name: str
    item: str
    position: Point
    direction: str | Point
    noise_density: float
    range: float
    cross_axis: tuple[float, float]
    dc_coupled: bool

    @known_keywords
    def __init__(
        self,
        name: str,
        item: str,
        position: Sequence[float],
        direction: Direction,
        noise_density: float = 0.0,
        range: float = math.inf,
        cross_axis: float | Sequence[float] = 0.0,
        dc_coupled: bool = False,
    ) -> None:
        what = f"Accelerometer {name!r}"
        checked = Sensor(item, direction, position, name=name)
        if checked.is_rotation:
            raise ModelError(
                f"{what}: direction {direction!r} is a rotation; an accelerometer feels x, y, z or a vector."
            )
        both = cross_axis if isinstance(cross_axis, (Sequence, np.ndarray)) else (cross_axis, cross_axis)
        one, other = (
            number(fraction, f"{what}: cross_axis (a fraction, 0.02 is 2 %)", "", minimum=-1.0)
            for fraction in numbers_of(both, 2, f"{what}: cross_axis", "fractions along the two directions across")
        )
        if max(one, other) > 1.0:
            raise ModelError(f"{what}: cross_axis is a fraction of at most 1, got {max(one, other):g}; 2 % is 0.02.")
        if not isinstance(dc_coupled, bool):
            raise ModelError(f"{what}: dc_coupled must be True or False, got {dc_coupled!r}.")
        fields = {
            "name": checked.name,
            "item": checked.item,
            "position": point(position, f"{what}: position"),
            "direction": checked.direction,
            "noise_density": number(noise_density, f"{what}: noise_density", "m/s²/√Hz", minimum=0.0),
            "range": math.inf if range == math.inf else number(range, f"{what}: range", UNIT, above=0.0),
            "cross_axis": (one, other),
            "dc_coupled": dc_coupled,
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    @property
    def sensor(self) -> Sensor:
        """What it measures where it is perfect, for the linear system and simulations."""
        return Sensor(self.item, self.direction, self.position, quantity="acceleration", name=self.name)

    @property
    def unit_direction(self) -> Array:
        """(3,) its direction, of length 1, global axes."""
        if isinstance(self.direction, str):
            axis: Array = np.eye(3)[_AXES.index(self.direction)]
            return axis
        return np.array(self.direction)

    @property
    def across(self) -> Array:
        """(2, 3) the directions of the two cross-axis fractions: the global axis that is farthest from its own (the
        first of x, y, z where two are), made perpendicular; and the one that completes a right-handed frame.
        """
        own = self.unit_direction
        farthest = np.eye(3)[int(np.argmin(np.round(np.abs(own), 9)))]
        first = farthest - (farthest @ own) * own
        first /= np.linalg.norm(first)
        return np.array([first, np.cross(own, first)])

    @property
    def sensitivity(self) -> Array:
        """(3,) what it shows of a unit acceleration along x, y, z, the cross-axis fractions included."""
        sensed: Array = self.unit_direction + np.array(self.cross_axis) @ self.across
        return sensed

    @property
    def motion_sensors(self) -> tuple[Sensor, ...]:
        """The six sensors whose record ``accelerometer_record`` needs: acceleration of the point, rotation of the item.

        Accelerometers of one item share those of its rotation.
        """
        moving = (
            Sensor(self.item, axis, self.position, quantity="acceleration", name=name)
            for axis, name in zip(_AXES, self._acceleration_names, strict=True)
        )
        turning = (
            Sensor(self.item, f"r{axis}", quantity="displacement", name=name)
            for axis, name in zip(_AXES, self._rotation_names, strict=True)
        )
        return (*moving, *turning)

    @property
    def _acceleration_names(self) -> list[str]:
        return [f"{self.name}: true {axis} acceleration" for axis in _AXES]

    @property
    def _rotation_names(self) -> list[str]:
        return [f"{self.item}: true r{axis}" for axis in _AXES]


def motion_sensors(accelerometers: Sequence[Accelerometer]) -> list[Sensor]:
    """Return the sensors to simulate for some accelerometers, each once."""
    return list({sensor.name: sensor for one in accelerometers for sensor in one.motion_sensors}.values())


@known_keywords
def accelerometer_record(
    motion: TimeRecord,
    accelerometers: Accelerometer | Sequence[Accelerometer],
    gravity: Sequence[float] = _STILL,
    seed: int | Sequence[int] | None = 0,
) -> TimeRecord:
    """Return what accelerometers would have shown of a simulated motion.

    Parameters
    ----------
    motion : record of the sensors ``motion_sensors`` of each accelerometer; further channels are passed over.
    accelerometers : one or several.
    gravity : (3,) [m/s²], global axes, such as (0, 0, -9.81).
    seed : of the noise; another for each run. None draws a new one.

    Returns
    -------
    TimeRecord with one channel an accelerometer, named after it, in m/s².

    Warns
    -----
    RecordWarning : a channel that its accelerometer's range clips.

    Raises
    ------
    RecordError : the record lacks a channel.

    Notes
    -----
    An accelerometer shows the specific force along axes that turn with it: s . R^T (a - g), with R the rotation of its
    item, a the acceleration of its point, g gravity and s its ``sensitivity``.
    """
    listed = checked_accelerometers(accelerometers)
    field = np.array(point(gravity, "gravity"))
    seeds = None if seed is None else [checked_seed(one) for one in (seed if isinstance(seed, Sequence) else (seed,))]
    generator = np.random.default_rng(seeds)
    rotations: dict[str, Rotation] = {}
    channels = []
    for one in listed:
        if one.item not in rotations:
            rotations[one.item] = Rotation.from_rotvec(_rows(motion, one._rotation_names, one).T)
        force = _rows(motion, one._acceleration_names, one).T - field
        shown = rotations[one.item].inv().apply(force) @ one.sensitivity
        if not one.dc_coupled:
            shown = shown - shown.mean()
        # White noise of one-sided density d has the variance d² times the band up to half the sample rate.
        shown = shown + generator.normal(size=shown.size) * one.noise_density * math.sqrt(motion.sample_rate / 2)
        channels.append(_clipped(shown, one, motion.title))
    return replace(
        motion, signals=np.array(channels), names=tuple(one.name for one in listed), units=(UNIT,) * len(listed)
    )


@known_keywords
def bracket(
    item: str,
    position: Sequence[float],
    size: float,
    prefix: str = "U",
    noise_density: float = 0.0,
    range: float = math.inf,
    cross_axis: float | Sequence[float] = 0.0,
    dc_coupled: bool = False,
) -> tuple[Accelerometer, ...]:
    """Return six accelerometers on the faces of a cube, the arrangement that sees all six motions equally well.

    Parameters
    ----------
    item : what the cube is mounted on.
    position : (3,) its centre [m].
    size : length of its edges [m].
    prefix : of the names; "U" gives U1 ... U6.
    noise_density, range, cross_axis, dc_coupled : of each accelerometer.

    Raises
    ------
    ModelError : a size or a figure that cannot be.

    Notes
    -----
    Those on the faces +x and -x measure y, those on +y and -y measure z, those on +z and -z measure x: sums give the
    translations and differences the rotations, and with rotations scaled by half the edge the condition number is 1.
    """
    centre = np.array(point(position, "bracket: position"))
    half = number(size, "bracket: size", "m", above=0.0) / 2
    return tuple(
        Accelerometer(
            f"{prefix}{2 * face + (side < 0) + 1}",
            item,
            tuple(centre + side * half * np.eye(3)[face]),
            _AXES[(face + 1) % 3],
            noise_density=noise_density,
            range=range,
            cross_axis=cross_axis,
            dc_coupled=dc_coupled,
        )
        for face in (0, 1, 2)
        for side in (1, -1)
    )


def checked_accelerometers(accelerometers: object) -> tuple[Accelerometer, ...]:
    """Return accelerometers of different names as a tuple; a single one is taken as a list of one.

    Raises
    ------
    ModelError : none, something else among them, or two of one name.
    """
    listed = tuple(accelerometers) if isinstance(accelerometers, (list, tuple)) else (accelerometers,)
    for one in listed:
        if not isinstance(one, Accelerometer):
            raise ModelError(f"accelerometers must be ibs.Accelerometer, got {one!r}.")
    checked_names([one.name for one in listed], "accelerometers")
    return listed


def _rows(motion: TimeRecord, names: Sequence[str], one: Accelerometer) -> Array:
    missing = [name for name in names if name not in motion.names]
    if missing:
        raise RecordError(
            f"{motion.title}: channel {missing[0]!r} is missing, which accelerometer {one.name!r} needs. Simulate with "
            "the sensors of ibs.motion_sensors(accelerometers)."
        )
    rows: Array = motion.signals[[motion.index(name) for name in names]]
    return rows


def _clipped(shown: Array, one: Accelerometer, title: str) -> Array:
    beyond = int((np.abs(shown) > one.range).sum())
    if beyond == 0:
        return shown
    warn_user(
        f"{title}: accelerometer {one.name!r} goes up to {np.abs(shown).max():.4g} m/s², beyond its range of "
        f"{one.range:g}; {beyond} of {shown.size} samples are clipped and its spectra are wrong at all frequencies. "
        "Lower the excitation or take a sensor of more range.",
        RecordWarning,
    )
    clipped: Array = np.clip(shown, -one.range, one.range)
    return clipped
