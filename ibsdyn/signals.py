"""Inputs and outputs of a model: forces, torques, strokes of actuators, motions of fixations, sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ibsdyn.assembly import Assembly, Joint
from ibsdyn.axes import DIRECTIONS, Array, is_rotation, rotate_six
from ibsdyn.components import Fixation, Point
from ibsdyn.errors import ModelError, UnknownNameError, known_keywords, nearest
from ibsdyn.validation import number, numbers_of, point, shown_name

QUANTITIES = ("displacement", "velocity", "acceleration")
# A vector that has been divided by its length has length 1 within this.
UNIT_ROUNDING = 1e-15
_PER_TIME = ("", "/s", "/s²")

Direction = str | Sequence[float]


@dataclass(frozen=True, init=False)
class _Signal:
    item: str
    direction: str | Point
    name: str

    @property
    def unit(self) -> str:
        """Its unit."""
        raise NotImplementedError

    @property
    def is_rotation(self) -> bool:
        """Whether it turns rather than moves."""
        return isinstance(self.direction, str) and is_rotation(self.direction)

    @property
    def vector(self) -> Array:
        """The (3,) unit vector along its direction, or of its axis where it turns."""
        if isinstance(self.direction, str):
            axis: Array = np.eye(3)[DIRECTIONS.index(self.direction) % 3]
            return axis
        return np.array(self.direction)

    def _where(self) -> str:
        if isinstance(self.direction, str):
            return f"{self.item}.{self.direction}"
        return f"{self.item}.({', '.join(f'{v:.3g}' for v in self.direction)})"


@dataclass(frozen=True, init=False)
class _Motion(_Signal):
    quantity: str

    @property
    def unit(self) -> str:
        """m, m/s, m/s² or the same of rad."""
        return ("rad" if self.is_rotation else "m") + _PER_TIME[self.order]

    @property
    def order(self) -> int:
        """How many times the displacement is differentiated."""
        return QUANTITIES.index(self.quantity)


@dataclass(frozen=True, init=False)
class Force(_Signal):
    """A force on a body.

    Parameters
    ----------
    item : a body, an interface or a sensor point; on a flexible body's own name it acts on all of its mass, as gravity
        does.
    direction : "x", "y", "z" or a 3-vector (its length does not matter).
    position : (3,) point of attack [m]; the CoG or the interface's frame if None.
    name : how results call it.

    Raises
    ------
    ModelError : an unknown or zero direction, a wrong position, a name that is none.
    """

    position: Point | None

    @known_keywords
    def __init__(
        self,
        item: str,
        direction: Direction,
        position: Sequence[float] | None = None,
        name: str | None = None,
    ) -> None:
        what = f"Force on {item!r}"
        _set(self, "item", _item(item, what))
        _set(self, "direction", _direction(direction, what, ("x", "y", "z"), "Torque(...) for rx, ry, rz"))
        _set(self, "position", None if position is None else point(position, f"{what}: position"))
        _set(self, "name", shown_name(name, f"force {self._where()}{_place(self.position)}"))

    @property
    def unit(self) -> str:
        """N."""
        return "N"


@dataclass(frozen=True, init=False)
class Torque(_Signal):
    """A torque on a body.

    Parameters
    ----------
    item : a body or an interface.
    direction : "rx", "ry", "rz", or a 3-vector along its axis (its length does not matter).
    name : how results call it.

    Raises
    ------
    ModelError : an unknown direction or a name that is none.
    """

    @known_keywords
    def __init__(self, item: str, direction: Direction, name: str | None = None) -> None:
        what = f"Torque on {item!r}"
        _set(self, "item", _item(item, what))
        _set(self, "direction", _direction(direction, what, ("rx", "ry", "rz"), "Force(...) for x, y, z"))
        _set(self, "name", shown_name(name, f"torque {self._where()}"))

    @property
    def unit(self) -> str:
        """N·m."""
        return "N·m"


@dataclass(frozen=True, init=False)
class Stroke(_Signal):
    """The stroke of an actuator: it drives the rest length of a connection along one of the connection's own axes.

    A piezo stack is a connection with the stack's stiffness; a stroke s moves item2 by s relative to item1 where
    nothing resists, and pushes with k s where it is blocked.

    Parameters
    ----------
    item : a connection.
    direction : "x" ... "rz", along the connection's axes; finite stiffness there.
    name : how results call it.

    Raises
    ------
    ModelError : an unknown direction or a name that is none.
    """

    @known_keywords
    def __init__(self, item: str, direction: str, name: str | None = None) -> None:
        what = f"Stroke of {item!r}"
        _set(self, "item", _item(item, what))
        if not isinstance(direction, str):
            raise ModelError(
                f"{what}: direction must be one of the connection's axes, {DIRECTIONS}, got {direction!r}."
            )
        _set(self, "direction", _direction(direction, what, DIRECTIONS, ""))
        _set(self, "name", shown_name(name, f"stroke {self._where()}"))

    @property
    def unit(self) -> str:
        """m or rad."""
        return "rad" if self.is_rotation else "m"

    def six_vector(self, joint: Joint) -> Array:
        """Return the (6,) change of the rest position of a joint's end 2 for a unit stroke, global axes."""
        column: Array = rotate_six(joint.connection.axes_matrix)[:, DIRECTIONS.index(str(self.direction))]
        return column


@dataclass(frozen=True, init=False)
class BaseMotion(_Motion):
    """The prescribed motion of a fixation; rotations turn about its position.

    Parameters
    ----------
    item : a fixation.
    direction : "x" ... "rz", or a 3-vector for a translation.
    quantity : "displacement", "velocity" or "acceleration".
    name : how results call it.

    Raises
    ------
    ModelError : an unknown direction or quantity, or a name that is none.
    """

    @known_keywords
    def __init__(
        self, item: str, direction: Direction, quantity: str = "acceleration", name: str | None = None
    ) -> None:
        what = f"BaseMotion of {item!r}"
        _set(self, "item", _item(item, what))
        _set(self, "direction", _direction(direction, what, DIRECTIONS, ""))
        _set(self, "quantity", _quantity(quantity, what))
        _set(self, "name", shown_name(name, f"{self._where()} {self.quantity}"))


@dataclass(frozen=True, init=False)
class Sensor(_Motion):
    """What is measured: the motion of a point of an item along a direction.

    Parameters
    ----------
    item : a body, a fixation, an interface or a sensor point of a flexible body ("flexure.optic"); a flexible body's
        own name stands for its mean motion.
    direction : "x" ... "rz", or a 3-vector (its length does not matter).
    position : (3,) the point [m]; the CoG or the frame if None.
    quantity : "displacement", "velocity" or "acceleration".
    name : how results call it.
    relative_to : another item; then its motion at the same point is subtracted.

    Raises
    ------
    ModelError : an unknown direction or quantity, a wrong position, a name that is none.
    """

    position: Point | None
    relative_to: str | None

    @known_keywords
    def __init__(
        self,
        item: str,
        direction: Direction,
        position: Sequence[float] | None = None,
        quantity: str = "acceleration",
        name: str | None = None,
        relative_to: str | None = None,
    ) -> None:
        what = f"Sensor on {item!r}"
        _set(self, "item", _item(item, what))
        _set(self, "direction", _direction(direction, what, DIRECTIONS, ""))
        _set(self, "position", None if position is None else point(position, f"{what}: position"))
        _set(self, "quantity", _quantity(quantity, what))
        _set(self, "relative_to", None if relative_to is None else _item(relative_to, f"{what}: relative_to"))
        relative = f" relative to {relative_to}" if relative_to is not None else ""
        _set(self, "name", shown_name(name, f"{self._where()}{_place(self.position)} {self.quantity}{relative}"))


@dataclass(frozen=True, init=False)
class CombinedSensor:
    """A weighted sum of sensors, as the tilt out of two displacements or the motion of a reflected beam.

    Parameters
    ----------
    name : how results call it.
    parts : (weight, Sensor) pairs; their sensors measure one quantity ("displacement", ...).
    unit : of the sum.

    Raises
    ------
    ModelError : no parts, something that is no sensor, quantities that differ.
    """

    name: str
    parts: tuple[tuple[float, Sensor], ...]
    unit: str

    @known_keywords
    def __init__(self, name: str, parts: Sequence[tuple[float, Sensor]], unit: str) -> None:
        checked = shown_name(name, "combined sensor") if name else shown_name("", "combined sensor")
        what = f"combined sensor {checked!r}"
        pairs = []
        for part in parts:
            if not isinstance(part, (tuple, list)) or len(part) != 2 or not isinstance(part[1], Sensor):
                raise ModelError(f"{what}: parts must be (weight, Sensor) pairs, got {part!r}.")
            pairs.append((number(part[0], f"{what}: weight", ""), part[1]))
        quantities = sorted({sensor.quantity for _, sensor in pairs})
        if len(quantities) != 1:
            raise ModelError(f"{what}: parts must measure one quantity, got {', '.join(quantities) or 'no parts'}.")
        for field, value in {"name": checked, "parts": tuple(pairs), "unit": unit}.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    @property
    def quantity(self) -> str:
        """What its parts measure."""
        return self.parts[0][1].quantity

    @property
    def order(self) -> int:
        """How many times the displacement is differentiated."""
        return self.parts[0][1].order


Input = Force | Torque | Stroke | BaseMotion
Output = Sensor | CombinedSensor


def load_column(signal: Force | Torque | Stroke, assembly: Assembly) -> Array:
    """Return the (N,) generalised forces of a unit force, torque or stroke.

    Raises
    ------
    UnknownNameError : the item or connection is not in the model.
    ModelError : it acts on a fixation, off the axis of a 1-D model, or along a direction without finite stiffness.
    """
    if isinstance(signal, Stroke):
        return _stroke_column(signal, assembly)
    what = signal.name
    assembly.address(signal.item, what)
    if isinstance(assembly.items.get(signal.item), Fixation):
        raise ModelError(f"{what}: {signal.item!r} is a fixation, which no force moves; use BaseMotion.")
    position = signal.position if isinstance(signal, Force) else None
    if isinstance(signal, Torque):
        _refuse_unknown_rotation(signal, assembly, signal.item)
    return along_direction(signal, assembly, assembly.motion(signal.item, position))


def _stroke_column(signal: Stroke, assembly: Assembly) -> Array:
    row = direction_row(signal, assembly)  # which refuses what is off the axis of a 1-D model
    joints = {joint.name: joint for joint in assembly.joints}
    if signal.item not in joints:
        raise UnknownNameError(f"{signal.name}: no connection {signal.item!r}. {nearest(signal.item, joints)}")
    joint = joints[signal.item]
    k = joint.connection.stiffness[0 if assembly.axis is not None else int(row.argmax())]
    if k == 0.0 or math.isinf(k):
        state = "free (stiffness 0)" if k == 0.0 else "locked (stiffness inf)"
        raise ModelError(
            f"{signal.name}: {signal.item!r} is {state} along {signal.direction!r}; an actuator needs the finite "
            "stiffness of its stack there."
        )
    column: Array = joint.relative.T @ (
        joint.stiffness[:, 0] if assembly.axis is not None else joint.stiffness @ signal.six_vector(joint)
    )
    return column


def base_column(signal: BaseMotion, assembly: Assembly) -> Array:
    """Return the (n_base,) displacements of the fixations' coordinates for a unit motion.

    Raises
    ------
    UnknownNameError : the item is not in the model.
    ModelError : it is not a fixation, or moves off the axis of a 1-D model.
    """
    what = signal.name
    assembly.address(signal.item, what)
    if not isinstance(assembly.items.get(signal.item), Fixation):
        known = [f.name for f in assembly.fixations]
        raise ModelError(f"BaseMotion {what!r}: {signal.item!r} is not a fixation. {nearest(signal.item, known)}")
    return along_direction(signal, assembly, assembly.motion(signal.item))[assembly.is_base]


def sensor_row(sensor: Output, assembly: Assembly) -> Array:
    """Return the (N,) row that gives a sensor's displacement.

    Raises
    ------
    UnknownNameError : an item is not in the model.
    ModelError : it looks off the axis of a 1-D model.
    """
    if isinstance(sensor, CombinedSensor):
        combined: Array = np.sum([weight * sensor_row(part, assembly) for weight, part in sensor.parts], axis=0)
        return combined
    what = sensor.name
    assembly.address(sensor.item, what)
    if sensor.is_rotation:
        for item in (sensor.item, sensor.relative_to):
            _refuse_unknown_rotation(sensor, assembly, item)
    row = along_direction(sensor, assembly, assembly.motion(sensor.item, sensor.position))
    if sensor.relative_to is not None:
        assembly.address(sensor.relative_to, f"{what}: relative_to")
        at = sensor.position if sensor.position is not None else assembly.frames[sensor.item]
        row = row - along_direction(sensor, assembly, assembly.motion(sensor.relative_to, at))
    return row


def checked_inputs(inputs: object) -> tuple[Input, ...]:
    """Return inputs as a tuple; a single one is taken as a list of one.

    Raises
    ------
    ModelError : empty, or something that is no input.
    """
    listed = _listed(inputs)
    for item in listed:
        if not isinstance(item, (Force, Torque, Stroke, BaseMotion)):
            swapped = " Inputs come first, then outputs." if isinstance(item, Sensor) else ""
            raise ModelError(f"inputs must be Force, Torque, Stroke or BaseMotion, got {item!r}.{swapped}")
    if not listed:
        raise ModelError("inputs are empty; give at least one Force, Torque, Stroke or BaseMotion.")
    return tuple(item for item in listed if isinstance(item, (Force, Torque, Stroke, BaseMotion)))


def checked_outputs(outputs: object) -> tuple[Output, ...]:
    """Return outputs as a tuple; a single one is taken as a list of one.

    Raises
    ------
    ModelError : empty, or something that is no Sensor.
    """
    listed = _listed(outputs)
    for item in listed:
        if not isinstance(item, (Sensor, CombinedSensor)):
            raise ModelError(f"outputs must be Sensor, got {item!r}.")
    if not listed:
        raise ModelError("outputs are empty; give at least one Sensor.")
    return tuple(item for item in listed if isinstance(item, (Sensor, CombinedSensor)))


def _listed(value: object) -> list[object]:
    return list(value) if isinstance(value, (list, tuple)) else [value]


def _refuse_unknown_rotation(signal: _Signal, assembly: Assembly, item: str | None) -> None:
    if item is not None and not assembly.tells_rotation(item):
        raise ModelError(
            f"{signal.name}: sensor point {item!r} is too few nodes to know a rotation; give fi.reduce three for it "
            "that are not on one line."
        )


def along_direction(signal: _Signal, assembly: Assembly, motion: Array) -> Array:
    """Return the (n,) row of a (6, n) motion along a signal's direction; see ``direction_row``."""
    if isinstance(signal.direction, str) and assembly.axis is None:
        along: Array = motion[DIRECTIONS.index(signal.direction)]
        return along
    other: Array = direction_row(signal, assembly) @ motion
    return other


def direction_row(signal: _Signal, assembly: Assembly) -> Array:
    """Return the (6,) direction of a signal in global axes.

    Raises
    ------
    ModelError : off the axis of a 1-D model, or with a position in one.
    """
    row = np.zeros(6)
    if isinstance(signal.direction, str):
        if assembly.axis is not None and signal.direction != assembly.axis:
            raise ModelError(
                f"{signal.name}: the model is 1-D along {assembly.axis}; {signal.direction!r} does not exist in it."
            )
        row[DIRECTIONS.index(signal.direction)] = 1.0
    elif assembly.axis is not None:
        raise ModelError(f"{signal.name}: the model is 1-D along {assembly.axis}; give that as direction.")
    elif isinstance(signal, Torque):
        row[3:] = signal.direction
    else:
        row[:3] = signal.direction
    if assembly.axis is not None and getattr(signal, "position", None) is not None:
        raise ModelError(f"{signal.name}: a 1-D model has no positions.")
    return row


def _set(target: _Signal, field: str, value: object) -> None:
    object.__setattr__(target, field, value)  # frozen: this is its constructor


def _item(value: object, what: str) -> str:
    if not isinstance(value, str) or not value:
        raise ModelError(f"{what}: the item must be a name, as 'mirror' or 'flexure.tip', got {value!r}.")
    return value


def _direction(value: Direction, what: str, known: tuple[str, ...], hint: str) -> str | Point:
    if isinstance(value, str):
        if value not in known:
            if value[:1] == "-" and value[1:] in known:
                hint = f"{value[1:]!r} and change the sign, or a 3-vector as (0, 0, -1)"
            elif value not in DIRECTIONS:
                hint = ""
            hint = f" Use {hint}." if hint else ""
            raise ModelError(f"{what}: direction {value!r} is not known. {nearest(value, known)}{hint}")
        return value
    vector = np.array(numbers_of(value, 3, f"{what}: direction", "x, y, z"))
    length = float(np.linalg.norm(vector))
    if not np.isfinite(length) or length == 0.0:
        raise ModelError(f"{what}: direction must be a finite vector that is not zero, got {value!r}.")
    if abs(length - 1.0) > UNIT_ROUNDING:  # what has length 1 stays as it is, to the last digit
        vector = vector / length
    x, y, z = (float(v) for v in vector)
    return x, y, z


def _quantity(value: object, what: str) -> str:
    if value not in QUANTITIES or not isinstance(value, str):
        raise ModelError(f"{what}: quantity {value!r} is not known. {nearest(str(value), QUANTITIES)}")
    return value


def _place(position: Point | None) -> str:
    return "" if position is None else f" at ({', '.join(f'{v:.4g}' for v in position)})"
