"""Six accelerometers or more to the motion of the rigid body they sit on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ibsdyn.accelerometers import UNIT, Accelerometer, checked_accelerometers
from ibsdyn.axes import DIRECTIONS, Array, is_rotation, rigid_transfer, skew
from ibsdyn.components import Point
from ibsdyn.errors import AnalysisError, ModelError, ModelWarning, RecordError, known_keywords, warn_user
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.identification import FrfEstimate
from ibsdyn.time_record import TimeRecord
from ibsdyn.validation import numbers_of, point

# Positions are typed to four digits or so: what is seen no better than that is not seen at all.
_UNSEEN = 1e-4
# Noise of a single sensor that reaches a motion more than this many times enlarged makes its record worthless.
_BADLY_SEEN = 30.0
_ONE_PLACE = 1e-9  # m; rounding of equal positions
_UNITS = (UNIT,) * 3 + ("rad/s²",) * 3


@dataclass(frozen=True, eq=False, init=False)
class MotionReconstruction:
    """The least-squares way from accelerometers on a rigid item to its six accelerations at a point.

    Parameters
    ----------
    accelerometers : six or more, all on one item.
    at : (3,) the point of the item whose motion is asked [m]; the mean of the accelerometers' positions if None.
    weights : (n,) weight of each accelerometer; 1/noise_density² if None and each has one, otherwise equal.

    Attributes
    ----------
    matrix : (n, 6) R: what each accelerometer shows of the six unit accelerations; a_i = n_i . (u + theta x r_i).
    inverse : (6, n) (R^T W R)^-1 R^T W.
    condition_number : of R about the mean of the positions, rotations scaled with their rms distance from it.

    Raises
    ------
    ModelError : accelerometers on different items, or weights that are none.
    AnalysisError : a motion that no accelerometer sees; the message says which.

    Warns
    -----
    ModelWarning : a motion that is seen more than 30 times worse than another.
    """

    accelerometers: tuple[Accelerometer, ...]
    at: Point
    weights: Array
    matrix: Array
    inverse: Array
    condition_number: float

    @known_keywords
    def __init__(
        self,
        accelerometers: Sequence[Accelerometer],
        at: Sequence[float] | None = None,
        weights: Sequence[float] | Array | None = None,
    ) -> None:
        listed = checked_accelerometers(accelerometers)
        for one in listed:
            if one.item != listed[0].item:
                raise ModelError(
                    f"accelerometer {one.name!r} is on {one.item!r}, {listed[0].name!r} on {listed[0].item!r}; a "
                    "motion is that of one item."
                )
        middle = np.mean([one.position for one in listed], axis=0)
        condition_number = _condition(listed, middle)
        target = np.array(middle if at is None else point(at, "at"))
        weight = _weights(listed, weights)
        # Solved about the middle with scaled rotations, then carried to the point: a point far away costs no digits.
        scale = _scale(listed, middle)
        scaled = _rows(listed, middle) * scale
        root = np.sqrt(weight)
        about_middle = scale[:, None] * np.linalg.pinv(root[:, None] * scaled) * root
        inverse = rigid_transfer(target - middle) @ about_middle
        fields = {
            "accelerometers": listed,
            "at": tuple(float(value) for value in target),
            "weights": weight,
            "matrix": _rows(listed, target),
            "inverse": inverse,
            "condition_number": condition_number,
        }
        for field, value in fields.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    def __repr__(self) -> str:
        """Name the accelerometers, their item and the condition number."""
        x, y, z = self.at
        return (
            f"MotionReconstruction({', '.join(self.names)} on {self.item!r}, at ({x:g}, {y:g}, {z:g}) m, condition "
            f"number {self.condition_number:.3g})"
        )

    @property
    def item(self) -> str:
        """What the accelerometers sit on."""
        return self.accelerometers[0].item

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the accelerometers."""
        return tuple(one.name for one in self.accelerometers)

    @property
    def motion_names(self) -> tuple[str, ...]:
        """Names of the six accelerations, ``platform.x acceleration`` ... ``platform.rz acceleration``."""
        return tuple(f"{self.item}.{direction} acceleration" for direction in DIRECTIONS)

    @property
    def noise_density(self) -> Array:
        """(6,) amplitude spectral density of the noise in each acceleration [m/s²/√Hz, rad/s²/√Hz]."""
        single = np.array([one.noise_density for one in self.accelerometers])
        density: Array = np.sqrt((self.inverse**2) @ single**2)
        return density

    def motion(self, record: TimeRecord) -> TimeRecord:
        """Return the six accelerations of the point, from a record that holds the accelerometers' channels.

        Raises
        ------
        UnknownNameError : a channel is missing.
        RecordError : a channel that is not in m/s².
        """
        signals = self.inverse @ self._readings(record)
        return replace(record, signals=signals, names=self.motion_names, units=_UNITS)

    def consistency(self, record: TimeRecord) -> float:
        """Return the rms share |R q| / |a| of the readings that a rigid motion explains; 1 is all of it.

        A wrong sign, position or sensitivity, or an item that is not rigid in the band, lowers it.

        Raises
        ------
        AnalysisError : six accelerometers, which a rigid motion always explains, or readings that are all zero.
        """
        if len(self.accelerometers) == 6:
            raise AnalysisError(
                "six accelerometers are explained by some rigid motion whatever they show; a seventh (better nine in "
                "all) is needed to see whether they agree."
            )
        root = np.sqrt(self.weights)[:, None]
        readings = self._readings(record)
        readings = readings - readings.mean(axis=1, keepdims=True)  # offsets of amplifiers are no motion
        size = float(np.linalg.norm(root * readings))
        if size == 0.0:
            raise AnalysisError(f"{record.title}: the accelerometers show nothing.")
        return float(np.linalg.norm(root * (self.matrix @ (self.inverse @ readings)))) / size

    def to_motion(self, frf: FrequencyResponse) -> FrequencyResponse:
        """Return responses to the six accelerations of the point out of responses to the accelerometers' readings.

        Parameters
        ----------
        frf : (n_out, n, n_freq) with the accelerometers as inputs, found by name; measured or predicted.

        Returns
        -------
        What was given: a FrequencyResponse, or a FrfEstimate with its covariance turned to the new inputs.

        Notes
        -----
        G_motion = G_accelerometers R; the inverse power of the inputs becomes R^T P R.

        Raises
        ------
        UnknownNameError : an accelerometer is not among the inputs.
        """
        chosen = frf.select(inputs=list(self.names))
        response = np.einsum("osf,sd->odf", chosen.response, self.matrix)
        if not isinstance(chosen, FrfEstimate):
            return replace(chosen, response=response, inputs=self.motion_names, input_units=_UNITS)
        before = np.einsum("jjf->jf", chosen.input_gain).real
        gain = np.einsum("sd,stf,te->def", self.matrix, chosen.input_gain, self.matrix)
        after = np.einsum("jjf->jf", gain).real
        estimate = replace(chosen, response=response, inputs=self.motion_names, input_units=_UNITS, input_gain=gain)
        if chosen.noise_level is None:
            return estimate
        # Noise and distortion of an output reach each response with the root of that input's gain.
        noise = chosen.noise_level[:, :1] / np.sqrt(before[:1]) * np.sqrt(after)
        beyond = None if chosen.distortion_level is None else np.sqrt(np.maximum(estimate.variance - noise**2, 0.0))
        return replace(estimate, noise_level=noise, distortion_level=beyond)

    def to_accelerometers(self, frf: FrequencyResponse) -> FrequencyResponse:
        """Return responses to the accelerometers' readings out of responses to the six accelerations of the point.

        Parameters
        ----------
        frf : (n_out, 6, n_freq) with the inputs x, y, z, rx, ry, rz of the item at the point, in this order.

        Notes
        -----
        G_accelerometers = G_motion (R^T W R)^-1 R^T W; with more than six it is that of the least squares.

        Raises
        ------
        AnalysisError : inputs that are not six accelerations.
        """
        if frf.input_units != _UNITS:
            raise AnalysisError(
                f"to_accelerometers needs the six accelerations x ... rz of {self.item!r} as inputs, in {_UNITS}; got "
                f"{frf.inputs} in {frf.input_units}."
            )
        response = np.einsum("odf,ds->osf", frf.response, self.inverse)
        # Statistics of an estimate are not turned round: what comes back is a response and nothing else.
        return FrequencyResponse(
            frequencies=frf.frequencies,
            response=response,
            outputs=frf.outputs,
            inputs=self.names,
            output_units=frf.output_units,
            input_units=(UNIT,) * len(self.names),
        )

    def _readings(self, record: TimeRecord) -> Array:
        if not isinstance(record, TimeRecord):
            raise RecordError(f"record must be an ibs.TimeRecord, got {record!r}; of several take one at a time.")
        chosen = record.select(self.names)
        for name, unit in zip(chosen.names, chosen.units, strict=True):
            if unit != UNIT:
                raise RecordError(f"{record.title}: channel {name!r} is in {unit!r}; accelerations are in {UNIT}.")
        return chosen.signals


def _rows(listed: Sequence[Accelerometer], about: Array) -> Array:
    directions = np.array([one.unit_direction for one in listed])
    levers = np.array([one.position for one in listed]) - about
    return np.hstack([directions, np.cross(levers, directions)])


def _scale(listed: Sequence[Accelerometer], middle: Array) -> Array:
    levers = np.array([one.position for one in listed]) - middle
    rms = float(np.sqrt((levers**2).sum() / len(listed)))
    return np.repeat([1.0, 1.0 / rms if rms > _ONE_PLACE else 1.0], 3)


def _weights(listed: Sequence[Accelerometer], weights: Sequence[float] | Array | None) -> Array:
    if weights is None:
        noise = np.array([one.noise_density for one in listed])
        return (noise.min() / noise) ** 2 if (noise > 0.0).all() else np.ones(len(listed))
    given = np.array(numbers_of(weights, len(listed), "weights", "one an accelerometer"))
    if not (np.isfinite(given) & (given > 0.0)).all():
        raise ModelError(
            f"weights must be positive and finite, got {given.tolist()}; leave an accelerometer out instead."
        )
    relative: Array = given / given.max()
    return relative


def _condition(listed: Sequence[Accelerometer], middle: Array) -> float:
    """Return the condition number; refuse what is not seen and warn of what is hardly seen, in words."""
    scale = _scale(listed, middle)
    _, values, vectors = np.linalg.svd(_rows(listed, middle) * scale)
    values = np.r_[values, np.zeros(6 - len(values))]
    unseen = vectors[values < _UNSEEN * values[0]]
    names = ", ".join(one.name for one in listed)
    if len(unseen):
        motions = "; ".join(_in_words(motion, scale, middle) for motion in _simplest(unseen))
        enough = "" if len(listed) >= 6 else f"{len(listed)} accelerometers cannot see six motions. "
        raise AnalysisError(
            f"{enough}No accelerometer of {names} on {listed[0].item!r} sees {motions}. Add or move one so that it "
            "does."
        )
    condition = float(values[0] / values[5])
    if condition > _BADLY_SEEN:
        warn_user(
            f"accelerometers {names} on {listed[0].item!r} see {_in_words(vectors[5], scale, middle)} {condition:.0f} "
            "times worse than other motions: noise and cross-axis errors are enlarged as much. Move one so that it "
            "sees this motion.",
            ModelWarning,
        )
    return condition


def _simplest(unseen: Array) -> list[Array]:
    """Return a basis of the unseen motions, those along and about the axes first."""
    rest = unseen
    found = []
    for axis in np.eye(6):
        if len(rest) and np.linalg.norm(rest @ axis) > 1.0 - 1e-9:
            found.append(axis)
            kept = rest - np.outer(rest @ axis, axis)
            _, values, vectors = np.linalg.svd(kept)
            rest = vectors[: len(values)][values > 0.5]
    return [*found, *rest]


def _in_words(scaled: Array, scale: Array, middle: Array) -> str:
    """Name a motion: a translation, or a rotation about a line, perhaps with a translation along it."""
    turning = scaled[3:]
    if np.linalg.norm(turning) < 1e-6:
        return f"a translation along {_direction(scaled[:3])}"
    angle: Array = scaled[3:] * scale[3:]
    u = scaled[:3]
    arm = skew(angle) @ u / (angle @ angle)  # where the motion has no part across the line
    x, y, z = np.round(middle + arm, 6) + 0.0
    along = float(u @ angle / (angle @ angle))
    screw = f" with {1e3 * along:.3g} mm along it per rad" if abs(along) * scale[3] > 1e-6 else ""
    return f"a rotation about {_direction(angle)} through ({x:.4g}, {y:.4g}, {z:.4g}) m{screw}"


def _direction(vector: Array) -> str:
    unit: Array = vector / np.linalg.norm(vector)
    for name, axis in zip(DIRECTIONS, np.eye(3), strict=False):
        if abs(unit @ axis) > 1.0 - 1e-9 and not is_rotation(name):
            return name
    x, y, z = np.round(unit * np.sign(unit[np.argmax(np.abs(unit))]), 3) + 0.0
    return f"({x:g}, {y:g}, {z:g})"
