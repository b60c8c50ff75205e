"""Unit systems of FEA exports and their conversion to SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError, UnknownNameError, nearest_known


@dataclass(frozen=True)
class UnitSystem:
    """Length [m], force [N] and time [s] of a consistent unit system; mass is force time^2 / length."""

    name: str
    length: float
    force: float
    time: float

    def stiffness_scale(self, directions: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return s (n,) with K_SI = diag(s) K diag(s); M takes a factor time^2 more, C time.

        A translation is a length and a rotation is in rad in every system, so an entry is
        force/length, force or force*length by what its row and column are.
        """
        root = np.sqrt(self.force * self.length)
        return np.asarray(np.where(np.asarray(directions) <= 3, root / self.length, root))


UNIT_SYSTEMS: dict[str, UnitSystem] = {
    system.name: system
    for system in (
        UnitSystem("SI", 1.0, 1.0, 1.0),
        UnitSystem("mm-t-s", 1e-3, 1.0, 1.0),
        UnitSystem("mm-kg-s", 1e-3, 1e-3, 1.0),
        UnitSystem("in-lbf-s", 0.0254, 4.4482216152605, 1.0),  # exact by definition of inch and pound-force
    )
}


def unit_system(name: str) -> UnitSystem:
    """Return the unit system of that name; UnknownNameError names the nearest known one."""
    if not isinstance(name, str) or name not in UNIT_SYSTEMS:
        raise UnknownNameError(f"Unknown unit system {name!r}.{nearest_known(name, UNIT_SYSTEMS)}")
    return UNIT_SYSTEMS[name]


def required_units(name: str | None, source: str) -> UnitSystem:
    """Return the unit system of a file that does not say which it is; ExportError where the user does not either."""
    if name is None:
        raise ExportError(
            f"{source} does not say its units. Give units=, one of {', '.join(map(repr, UNIT_SYSTEMS))}: those of the "
            "model it was exported from."
        )
    return unit_system(name)
