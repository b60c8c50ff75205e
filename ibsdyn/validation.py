"""Numbers and names as users type them, turned into what the model keeps, or refused in words."""

from __future__ import annotations

import math
import numbers
from collections.abc import Sequence
from typing import Any

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.errors import ModelError

# Axes typed with four digits (0.7071) miss orthonormality by 2e-5; a mistyped one misses by far more.
AXES_TOLERANCE = 1e-4
# Below this axes are orthonormal to rounding and stay as they are, so that reading what was written changes nothing.
ORTHONORMAL = 1e-14


def valid_name(name: object, what: str) -> str:
    """Return a component's name.

    Raises
    ------
    ModelError : not a string, empty, or with a dot (a dot separates body and interface) or outer blanks.
    """
    if not isinstance(name, str) or not name.strip():
        raise ModelError(f"{what}: the name must be a non-empty text, got {name!r}.")
    if "." in name or name != name.strip():
        raise ModelError(
            f"{what} {name!r}: a name has no dot and no blanks at its ends; the dot separates a flexible body from "
            "its interface, as in 'flexure.tip'."
        )
    return name


def shown_name(value: object, default: str) -> str:
    """Return how results call something: as given, or the default.

    Raises
    ------
    ModelError : not a text, or an empty one.
    """
    if value is None:
        return default
    if not isinstance(value, str) or not value.strip():
        raise ModelError(f"{default}: name must be a non-empty text, got {value!r}.")
    return value


def number(value: object, what: str, unit: str, *, minimum: float = -math.inf, above: float = -math.inf) -> float:
    """Return one finite real number within its bounds.

    Raises
    ------
    ModelError : not a number, not finite, or below ``minimum`` or not above ``above``.
    """
    if isinstance(value, (np.ndarray, list, tuple)) and np.size(value) == 1:
        value = np.asarray(value).item()  # [500.0] and array(500.0) are one number too
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ModelError(f"{what} must be one number{f' [{unit}]' if unit else ''}, got {value!r}.")
    result = _float(value, what)
    if not math.isfinite(result):
        raise ModelError(f"{what} must be finite{f' [{unit}]' if unit else ''}, got {result}.")
    if result < minimum:
        raise ModelError(f"{what} must not be below {minimum:g} {unit}".rstrip() + f", got {result:g}.")
    if result <= above:
        raise ModelError(f"{what} must be above {above:g} {unit}, got {result:g}.")
    return result


def _float(value: numbers.Real, what: str) -> float:
    """Return a float; ModelError for a whole number that none can hold, which is no infinity."""
    try:
        return float(value)
    except OverflowError:
        raise ModelError(f"{what}: a whole number of more than 308 digits is too large.") from None


def checked_seed(value: object) -> int:
    """Return the seed of something random.

    Raises
    ------
    ModelError : no whole number from 0.
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < 0:
        raise ModelError(f"seed must be a whole number from 0, got {value!r}.")
    return int(value)


def numbers_of(value: object, count: int, what: str, names: str) -> tuple[float, ...]:
    """Return ``count`` real numbers (NaN refused, infinities left to the caller).

    Raises
    ------
    ModelError : not a sequence of ``count`` numbers, or one of them is NaN.
    """
    if type(value) is tuple and len(value) == count and all(type(v) is float and v == v for v in value):
        return value  # as a checked component keeps them
    wanted = f"{what} must be {'one number' if count == 1 else f'{count} numbers'} ({names})"
    items: list[Any] = []
    try:
        # A set has no order, a dict keys; neither are coordinates.
        if not isinstance(value, (set, frozenset, dict, str, bytes)):
            items = list(value)  # type: ignore[call-overload]  # whatever was given; the except answers it
    except TypeError:
        pass
    if len(items) != count:
        raise ModelError(f"{wanted}, got {value!r}.")
    result = []
    for item in items:
        if isinstance(item, bool) or not isinstance(item, numbers.Real) or math.isnan(_float(item, what)):
            raise ModelError(f"{wanted}, got {item!r} among {value!r}.")
        result.append(float(item))
    return tuple(result)


def point(value: object, what: str) -> tuple[float, float, float]:
    """Return a position in global axes [m].

    Raises
    ------
    ModelError : not three finite numbers.
    """
    x, y, z = numbers_of(value, 3, what, "x, y, z [m]")
    if not all(math.isfinite(v) for v in (x, y, z)):
        raise ModelError(f"{what} must be finite [m], got {(x, y, z)}.")
    return x, y, z


def rotation_matrix(value: object, what: str) -> tuple[tuple[float, float, float], ...]:
    """Return a 3x3 rotation, made exactly orthonormal where it was typed with few digits.

    Raises
    ------
    ModelError : not 3x3, not finite, columns not orthonormal within 1e-4, or left-handed.
    """
    try:
        matrix = np.array(value, dtype=float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise ModelError(f"{what} must be a 3x3 rotation whose columns are the local axes, got {value!r}.")
    error = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
    if error > AXES_TOLERANCE:
        raise ModelError(
            f"{what} must have orthogonal columns of length 1; axes^T axes misses the identity by {error:.2g} in "
            f"{matrix.tolist()}."
        )
    if np.linalg.det(matrix) < 0:
        raise ModelError(f"{what} must be right-handed (x cross y = z); swap or flip one column of it.")
    if error < ORTHONORMAL:
        return as_rows(matrix)
    left, _, right = np.linalg.svd(matrix)
    return as_rows(left @ right)


def as_rows(matrix: Array) -> tuple[tuple[float, float, float], ...]:
    """Return a (3, 3) array as a hashable tuple of rows."""
    return tuple((float(a), float(b), float(c)) for a, b, c in matrix)


def checked_names(value: object, what: str) -> list[str]:
    """Return a list of different names.

    Raises
    ------
    ModelError : not a list of names, empty, or with a name twice.
    """
    names = list(value) if isinstance(value, (list, tuple, set, frozenset)) else None
    if not names or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise ModelError(f"{what} must be a list of different names, got {value!r}.")
    return names


def in_words(names: Sequence[str]) -> str:
    """Return ``a, b and c``."""
    listed = list(names)
    return listed[0] if len(listed) == 1 else ", ".join(listed[:-1]) + " and " + listed[-1]
