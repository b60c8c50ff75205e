"""The components of Table 1: fixation, rigid body, flexible body, spring/damper connection."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_import import ReducedBody
from ibsdyn.axes import INERTIA_NAMES, STIFFNESS_NAMES, Array, rotate_six
from ibsdyn.errors import ModelError, nearest
from ibsdyn.validation import number, numbers_of, point, rotation_matrix, valid_name

Point = tuple[float, float, float]

# A thin plate has Izz = Ixx + Iyy exactly; CAD prints it with a few digits.
TRIANGLE_TOLERANCE = 1e-3
GLOBAL_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Fixation:
    """A point of the environment that holds the machine, still or moving in all its six directions.

    Attributes
    ----------
    name : its name in the model.
    position : (3,) centre of rotation, global axes [m].
    """

    name: str
    position: Point

    @staticmethod
    def of(name: object, position: object) -> Fixation:
        """Return a checked fixation.

        Raises
        ------
        ModelError : the name or the position cannot be one.
        """
        checked = valid_name(name, "fixation")
        return Fixation(checked, point(position, f"fixation {checked!r}: position"))


@dataclass(frozen=True)
class RigidBody:
    """A rigid body: mass, centre of gravity, inertia tensor about it.

    Attributes
    ----------
    name : its name in the model.
    mass : [kg].
    cog : (3,) centre of gravity, global axes [m].
    inertia : Ixx, Iyy, Izz, Ixy, Ixz, Iyz: elements of the tensor about the CoG, global axes [kg m²].
    """

    name: str
    mass: float
    cog: Point
    inertia: tuple[float, ...]

    @property
    def inertia_tensor(self) -> Array:
        """The (3, 3) inertia tensor about the CoG [kg m²]."""
        return tensor(self.inertia)

    @staticmethod
    def of(
        name: object,
        mass: object,
        cog: object,
        inertia: object,
        products: object = "tensor",
    ) -> RigidBody:
        """Return a checked rigid body.

        Raises
        ------
        ModelError : a value is missing, of the wrong length, not finite, not positive, or the inertia is one
            that no distribution of mass can have.
        """
        checked = valid_name(name, "rigid body")
        what = f"rigid body {checked!r}"
        for value, label in ((mass, "mass= [kg]"), (cog, "cog=(x, y, z) [m]")):
            if value is None:
                raise ModelError(f"{what}: {label} is missing.")
        if inertia is None:
            raise ModelError(
                f"{what}: inertia=({', '.join(INERTIA_NAMES)}) [kg m²] about the CoG is missing; a 1-D model "
                "(axis=...) needs only one number per body."
            )
        kilograms = number(mass, f"{what}: mass", "kg", above=0.0)
        centre = point(cog, f"{what}: cog")
        six = _inertia(inertia, products, what)
        return RigidBody(checked, kilograms, centre, six)


@dataclass(frozen=True)
class Inertia1D:
    """The one inertia of a body in a 1-D model.

    Attributes
    ----------
    name : its name in the model.
    inertia : mass [kg] on a translation axis, moment of inertia [kg m²] on a rotation axis.
    """

    name: str
    inertia: float

    @staticmethod
    def of(name: object, mass: object, inertia: object, axis: str) -> Inertia1D:
        """Return a checked body of a 1-D model along ``axis``.

        Raises
        ------
        ModelError : not exactly the one positive number that the axis needs.
        """
        checked = valid_name(name, "rigid body")
        what = f"rigid body {checked!r}"
        rotation = axis.startswith("r")
        value, other = (inertia, mass) if rotation else (mass, inertia)
        label, unit, wrong = ("inertia", "kg m²", "mass") if rotation else ("mass", "kg", "inertia")
        if value is None or other is not None:
            got = f"got {wrong}={other!r}" if other is not None else "got none"
            raise ModelError(f"{what}: a 1-D model along {axis} needs {label}= [{unit}] and only that; {got}.")
        return Inertia1D(checked, number(value, f"{what}: {label}", unit, above=0.0))


@dataclass(frozen=True)
class FlexibleBody:
    """A reduced finite-element part with frames of six at its interfaces.

    Attributes
    ----------
    name : its name in the model.
    reduced : the reduced matrices, positions in the model's global frame.
    zeta : relative damping ratio of its elastic part; unused where the export brought a damping matrix.
    """

    name: str
    reduced: ReducedBody
    zeta: float = 0.0

    def __eq__(self, other: object) -> bool:
        """Tell whether another body has the same name, ratio and reduced part, to the last digit."""
        if not isinstance(other, FlexibleBody):
            return NotImplemented
        if (self.name, self.zeta) != (other.name, other.zeta):
            return False
        return self.reduced is other.reduced or self.reduced.checksum == other.reduced.checksum

    def __hash__(self) -> int:
        """Return a hash that agrees with equality."""
        return hash((self.name, self.zeta, self.reduced.mass, len(self.reduced.M)))

    @staticmethod
    def of(name: object, reduced: object, zeta: object) -> FlexibleBody:
        """Return a checked flexible body.

        Raises
        ------
        ModelError : not a ReducedBody, or a ratio that is negative or not finite.
        """
        checked = valid_name(name, "flexible body")
        what = f"flexible body {checked!r}"
        if not isinstance(reduced, ReducedBody):
            raise ModelError(
                f"{what}: expects a fem_import.ReducedBody, got {type(reduced).__name__}; make one with "
                "fem_import.reduce(part, interfaces=..., max_frequency=...) or ReducedBody.from_arrays(...)."
            )
        ratio = number(zeta, f"{what}: zeta", "", minimum=0.0)
        return FlexibleBody(checked, reduced, ratio)

    def interface(self, name: str) -> str:
        """Return an interface's name after checking that the part has it.

        Raises
        ------
        ModelError : the part has no such interface.
        """
        if name in self.reduced.sensors:
            raise ModelError(
                f"flexible body {self.name!r}: {name!r} is a sensor point, which carries no connection; list it under "
                "interfaces= of fem_import.reduce instead."
            )
        if name not in self.reduced.interfaces:
            raise ModelError(
                f"flexible body {self.name!r} has no interface {name!r}. {nearest(name, self.reduced.interfaces)}"
            )
        return name


@dataclass(frozen=True)
class Connection:
    """A spring/damper between two items, acting at its elastic centre along its own axes.

    Attributes
    ----------
    name : its name in the model.
    item1, item2 : a body, a fixation, or an interface as ``"flexure.tip"``.
    position1, position2 : (3,) interface positions, global axes [m]; None in a 1-D model.
    stiffness : kx ky kz [N/m] kxx kyy kzz [N·m/rad] along ``axes``; one number in a 1-D model. ``inf`` locks.
    zeta : relative damping ratio (loss factor 2 zeta).
    axes : rows of the 3x3 rotation whose columns are the local axes.
    damping : cx cy cz [N·s/m] cxx cyy czz [N·m·s/rad] in place of zeta, or None.
    elastic_centre : (3,) where it acts [m]; half way between the positions unless given.
    """

    name: str
    item1: str
    item2: str
    position1: Point | None
    position2: Point | None
    stiffness: tuple[float, ...]
    zeta: float = 0.0
    axes: tuple[Point, ...] = GLOBAL_AXES
    damping: tuple[float, ...] | None = None
    elastic_centre: Point | None = None

    @property
    def locked(self) -> tuple[bool, ...]:
        """Which of its directions are rigid."""
        return tuple(math.isinf(k) for k in self.stiffness)

    @property
    def axes_matrix(self) -> Array:
        """The (3, 3) rotation whose columns are the local axes."""
        return np.array(self.axes)

    def global_stiffness(self) -> Array:
        """Return the finite stiffness at the elastic centre, (6, 6) in global axes."""
        return self._in_global_axes([0.0 if math.isinf(k) else k for k in self.stiffness])

    def global_damping(self) -> Array:
        """Return the explicit damping at the elastic centre, (6, 6) in global axes."""
        if self.damping is None:
            return np.zeros((6, 6))
        return self._in_global_axes([0.0 if lock else c for c, lock in zip(self.damping, self.locked, strict=True)])

    def _in_global_axes(self, diagonal: Sequence[float]) -> Array:
        if self.axes == GLOBAL_AXES:
            return np.diag(diagonal)
        turn = rotate_six(self.axes_matrix)
        turned = turn * np.array(diagonal) @ turn.T
        symmetric: Array = 0.5 * (turned + turned.T)
        return symmetric


Item = Fixation | RigidBody | FlexibleBody | Inertia1D


def stiffness_values(value: object, what: str) -> tuple[float, ...]:
    """Return six stiffnesses, each zero, positive or inf.

    Raises
    ------
    ModelError : wrong length, NaN, negative, or minus infinity.
    """
    names = ", ".join(STIFFNESS_NAMES)
    six = numbers_of(value, 6, f"{what}: stiffness", names)
    for name, k in zip(STIFFNESS_NAMES, six, strict=True):
        _not_negative(k, f"{what}: {name}", "inf locks the direction, 0 leaves it free")
    return six


def damping_values(value: object, what: str) -> tuple[float, ...]:
    """Return six viscous dampers, each zero or positive and finite.

    Raises
    ------
    ModelError : wrong length, not finite, or negative.
    """
    names = ("cx", "cy", "cz", "cxx", "cyy", "czz")
    six = numbers_of(value, 6, f"{what}: damping", ", ".join(names))
    return tuple(
        number(c, f"{what}: {name}", unit, minimum=0.0)
        for name, c, unit in zip(names, six, ("N·s/m",) * 3 + ("N·m·s/rad",) * 3, strict=True)
    )


def scalar_stiffness(value: object, what: str, unit: str) -> tuple[float]:
    """Return the one stiffness of a connection in a 1-D model; inf locks.

    Raises
    ------
    ModelError : not one number, NaN or negative.
    """
    single = np.asarray(value).ravel()[:1].tolist() if np.size(value) == 1 else value  # type: ignore[arg-type]  # checked next
    (k,) = numbers_of(single, 1, f"{what}: stiffness", f"[{unit}], as a 1-D model needs it")
    _not_negative(k, f"{what}: stiffness", "inf locks the direction, 0 leaves it free")
    return (k,)


def scalar_damping(value: object, what: str) -> tuple[float]:
    """Return the one viscous damper of a connection in a 1-D model.

    Raises
    ------
    ModelError : not one number, not finite or negative.
    """
    return (number(value, f"{what}: damping", "N·s/m or N·m·s/rad", minimum=0.0),)


def checked_axes(value: object, what: str) -> tuple[Point, ...]:
    """Return the local axes as rows of a rotation; global axes for None."""
    return GLOBAL_AXES if value is None else rotation_matrix(value, f"{what}: axes")


def tensor(six: Sequence[float]) -> Array:
    """Return the (3, 3) tensor of Ixx, Iyy, Izz, Ixy, Ixz, Iyz."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _not_negative(k: float, what: str, hint: str) -> None:
    if k < 0:
        raise ModelError(f"{what} must not be negative, got {k:g}; {hint}.")


def _inertia(value: object, products: object, what: str) -> tuple[float, ...]:
    signs: dict[object, float] = {"tensor": 1.0, "integral": -1.0}
    if not isinstance(products, str) or products not in signs:
        raise ModelError(
            f"{what}: products={products!r} is not known; 'tensor' when Ixy = -integral(x y dm) is given, 'integral' "
            "when the CAD program prints Ixy = +integral(x y dm)."
        )
    raw = numbers_of(value, 6, f"{what}: inertia", ", ".join(INERTIA_NAMES) + " [kg m²]")
    six = raw[:3] + tuple(signs[products] * v for v in raw[3:])
    if not all(math.isfinite(v) for v in six):
        raise ModelError(f"{what}: inertia must be finite [kg m²], got {raw}.")
    moments = np.linalg.eigvalsh(tensor(six)).tolist() if any(six[3:]) else sorted(six[:3])
    smallest, middle, largest = moments
    if smallest > 0 and largest <= (smallest + middle) * (1 + TRIANGLE_TOLERANCE):
        return six
    shown = ", ".join(f"{v:.6g}" for v in moments)
    if smallest <= 0:
        raise ModelError(
            f"{what}: inertia {raw} is not positive definite (principal moments {shown} kg m²); a point mass gets a "
            "small sphere's inertia, and CAD programs that print +integral(x y dm) need products='integral'."
        )
    raise ModelError(
        f"{what}: no body has the inertia {raw}: its largest principal moment is above the sum of the other two "
        f"(principal moments {shown} kg m²). Check the order {', '.join(INERTIA_NAMES)}, the sign of the "
        "products (products='integral') and that it is taken about the CoG."
    )
