"""Units as people write them over columns, converted to SI: ``g mm^2``, ``N/µm``, ``Nm/deg``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ibsdyn.errors import ModelError, nearest


@dataclass(frozen=True)
class _Unit:
    factor: float
    length: int = 0
    mass: int = 0
    time: int = 0

    @property
    def dimension(self) -> tuple[int, int, int]:
        return self.length, self.mass, self.time

    def times(self, other: _Unit, power: int) -> _Unit:
        return _Unit(
            self.factor * other.factor**power,
            self.length + power * other.length,
            self.mass + power * other.mass,
            self.time + power * other.time,
        )


_ONE = _Unit(1.0)
# Those that take prefixes, and those that do not.
_PREFIXED = {
    "m": _Unit(1.0, 1),
    "g": _Unit(1e-3, 0, 1),
    "s": _Unit(1.0, 0, 0, 1),
    "N": _Unit(1.0, 1, 1, -2),
    "Nm": _Unit(1.0, 2, 1, -2),
    "Nmm": _Unit(1e-3, 2, 1, -2),
    "Ns": _Unit(1.0, 1, 1, -1),
    "rad": _ONE,
    "Hz": _Unit(1.0, 0, 0, -1),
}
_PLAIN = {
    "": _ONE,
    "-": _ONE,
    "1": _ONE,
    "%": _Unit(1e-2),
    "deg": _Unit(math.pi / 180),
    "°": _Unit(math.pi / 180),
    "t": _Unit(1e3, 0, 1),
    # By definition: international inch, foot, avoirdupois pound, pound-force at standard gravity.
    "in": _Unit(0.0254, 1),
    "inch": _Unit(0.0254, 1),
    "ft": _Unit(0.3048, 1),
    "lb": _Unit(0.45359237, 0, 1),
    "lbm": _Unit(0.45359237, 0, 1),
    "lbf": _Unit(0.45359237 * 9.80665, 1, 1, -2),
}
# The micro sign and the Greek letter are two characters.
_PREFIXES = {"n": 1e-9, "u": 1e-6, "\u00b5": 1e-6, "\u03bc": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6, "G": 1e9}
_SUPERSCRIPTS = str.maketrans("²³⁴⁻¹", "234-1")
_FACTOR = re.compile(r"\s*([/*·⋅.]?)\s*([^\W\d_]+|[%°]|1(?!\d)|-(?!\d))\s*(?:(?:\^|\*\*)?\s*(-?[1-4]))?(?!\w)")

DIMENSIONS = {
    "mass": (_Unit(1.0, 0, 1), "kg"),
    "length": (_Unit(1.0, 1), "m"),
    "inertia": (_Unit(1.0, 2, 1), "kg m^2"),
    "stiffness": (_Unit(1.0, 0, 1, -2), "N/m"),
    "rotational stiffness": (_Unit(1.0, 2, 1, -2), "N m/rad"),
    "damping": (_Unit(1.0, 0, 1, -1), "N s/m"),
    "rotational damping": (_Unit(1.0, 2, 1, -1), "N m s/rad"),
    "ratio": (_ONE, "-"),
}


def si_factor(unit: str, dimension: str) -> float:
    """Return the number that turns values in a unit into SI.

    Parameters
    ----------
    unit : symbols joined by blanks, ``*``, ``·`` or ``/``, each with a power: "kg mm^2", "N/µm", "Nm/rad". A slash
        divides by the one symbol after it.
    dimension : one of `DIMENSIONS`; rad and deg count as ratios.

    Raises
    ------
    ModelError : an unknown unit, or one of another dimension.
    """
    wanted, example = DIMENSIONS[dimension]
    found = _parsed(unit)
    if found.dimension != wanted.dimension:
        raise ModelError(f"unit {unit!r} is not one of {dimension}, which is in {example} or alike.")
    return found.factor


def _parsed(unit: str) -> _Unit:
    text = unit.strip().translate(_SUPERSCRIPTS)
    if text in _PLAIN:
        return _PLAIN[text]
    product, place = _ONE, 0
    while place < len(text):
        match = _FACTOR.match(text, place)
        if match is None or match.end() == place:
            raise ModelError(
                f"unit {unit!r} is not understood at {text[place:]!r}; write it as 'kg mm^2' or 'N m/rad'."
            )
        sign, symbol, power = match.groups()
        exponent = int(power or 1) * (-1 if sign == "/" else 1)
        product = product.times(_symbol(symbol, unit), exponent)
        place = match.end()
    return product


def _symbol(symbol: str, unit: str) -> _Unit:
    if symbol in _PLAIN:
        return _PLAIN[symbol]
    if symbol in _PREFIXED:
        return _PREFIXED[symbol]
    prefix, rest = symbol[0], symbol[1:]
    if prefix in _PREFIXES and rest in _PREFIXED:
        return _Unit(_PREFIXES[prefix], 0).times(_PREFIXED[rest], 1)
    known = ["kg", "mm", "µm", *[s for s in (*_PREFIXED, *_PLAIN) if s.isalpha()]]
    raise ModelError(f"unit {unit!r}: {symbol!r} is not known. {nearest(symbol, known)}")
