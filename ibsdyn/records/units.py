"""Units as data acquisition programs write them, turned to SI."""

from __future__ import annotations

import math

from ibsdyn.errors import RecordError

STANDARD_GRAVITY = 9.80665  # m/s², CGPM 1901

_SI = {
    "m/s²": (1.0, "m/s²"),
    "mm/s²": (1e-3, "m/s²"),
    "µm/s²": (1e-6, "m/s²"),
    "cm/s²": (1e-2, "m/s²"),
    "g": (STANDARD_GRAVITY, "m/s²"),
    "gn": (STANDARD_GRAVITY, "m/s²"),
    "mg": (1e-3 * STANDARD_GRAVITY, "m/s²"),
    "µg": (1e-6 * STANDARD_GRAVITY, "m/s²"),
    "m/s": (1.0, "m/s"),
    "mm/s": (1e-3, "m/s"),
    "µm/s": (1e-6, "m/s"),
    "m": (1.0, "m"),
    "mm": (1e-3, "m"),
    "µm": (1e-6, "m"),
    "nm": (1e-9, "m"),
    "rad": (1.0, "rad"),
    "mrad": (1e-3, "rad"),
    "µrad": (1e-6, "rad"),
    "deg": (math.pi / 180, "rad"),
    "°": (math.pi / 180, "rad"),
    "rad/s": (1.0, "rad/s"),
    "deg/s": (math.pi / 180, "rad/s"),
    "°/s": (math.pi / 180, "rad/s"),
    "rad/s²": (1.0, "rad/s²"),
    "N": (1.0, "N"),
    "mN": (1e-3, "N"),
    "kN": (1e3, "N"),
    "N·m": (1.0, "N·m"),
    "mN·m": (1e-3, "N·m"),
    "V": (1.0, "V"),
    "mV": (1e-3, "V"),
    "µV": (1e-6, "V"),
    "C": (1.0, "C"),
    "pC": (1e-12, "C"),
    "A": (1.0, "A"),
    "mA": (1e-3, "A"),
    "Pa": (1.0, "Pa"),
    "kPa": (1e3, "Pa"),
    "bar": (1e5, "Pa"),
    "-": (1.0, "-"),
}
_SPELLINGS = {"^2": "²", "**2": "²", "s2": "s²", "μ": "µ", "Nm": "N·m", "N*m": "N·m", "N.m": "N·m", " ": ""}
_MICRO = {"um": "µm", "um/s": "µm/s", "um/s²": "µm/s²", "urad": "µrad", "ug": "µg", "uV": "µV"}

KNOWN = tuple(_SI)


def to_si(unit: str) -> tuple[float, str] | None:
    """Return the factor to SI and the SI unit; None for a unit that is not known."""
    spelled = unit.strip().strip("[]")
    for theirs, ours in _SPELLINGS.items():
        spelled = spelled.replace(theirs, ours)
    return _SI.get(_MICRO.get(spelled, spelled))


def sensitivity_to_si(text: str, what: str) -> tuple[float, str, str]:
    """Return a sensitivity such as ``"102.3 mV/g"`` in SI: number, unit of what is recorded, unit of what is measured.

    Raises
    ------
    RecordError : it is not of that form, zero, or in units that are not known.
    """
    number, _, unit = text.strip().partition(" ")
    recorded, _, measured = unit.partition("/")
    measured = measured.strip().removeprefix("(").removesuffix(")")
    above, below = to_si(recorded), to_si(measured)
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if above is None or below is None or not math.isfinite(value) or value == 0.0:
        raise RecordError(
            f"{what}: sensitivity must be a number and two known units, as '102.3 mV/g' or '10 mV/(m/s²)', got "
            f"{text!r}. Known units: {', '.join(KNOWN)}."
        )
    return value * above[0] / below[0], above[1], below[1]
