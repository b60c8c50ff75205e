"""How the bodies follow a base that moves infinitely slowly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibsdyn.assembly import Assembly
from ibsdyn.axes import Array, rigid_transfer
from ibsdyn.components import FlexibleBody

# A motion seen by a sensor that is below this share of what it is summed from is rounding of zero.
ROUNDING = 1e-13


@dataclass(frozen=True, eq=False)
class QuasiStaticMotion:
    """The motion of all independent coordinates per unit of each base coordinate.

    Attributes
    ----------
    motion : (n + n_base, n_base), the base's own last (the identity).
    strain_free : whether it strains nothing at all: a single fixation carries everything along as one rigid body.
    """

    motion: Array
    strain_free: bool

    def seen_by(self, rows: Array, base_rows: Array) -> Array:
        """Return (n_out, n_base) what sensors with rows over free (n_out, n) and base coordinates see of it.

        A sensor that is relative to what moves along sees exactly nothing.
        """
        whole = np.hstack([rows, base_rows])
        seen: Array = whole @ self.motion
        seen[np.abs(seen) <= ROUNDING * (np.abs(whole) @ np.abs(self.motion))] = 0.0
        return seen


def quasi_static_motion(assembly: Assembly, rows: Array, independent: np.ndarray, count: int) -> QuasiStaticMotion:
    """Return how the free coordinates follow the base.

    Parameters
    ----------
    assembly : the model.
    rows : (m, n + n_base) of what stores strain energy, over the independent coordinates.
    independent : (n + n_base,) places of the independent coordinates among all, the base's last.
    count : n.

    Notes
    -----
    One fixation and no part with a ground of its own: the rigid motion, exactly. Else the least strain energy.
    """
    n_base = len(independent) - count
    grounded = any(isinstance(body, FlexibleBody) and not body.reduced.is_free for body in assembly.bodies)
    if len(assembly.fixations) == 1 and not grounded:
        if assembly.axis is not None:
            return QuasiStaticMotion(np.ones((len(independent), 1)), strain_free=True)
        about_fixation = rigid_transfer(-assembly.frames[assembly.fixations[0].name])
        return QuasiStaticMotion(assembly.rigid_motion()[independent] @ about_fixation, strain_free=True)
    motion = np.vstack([np.zeros((count, n_base)), np.eye(n_base)])
    if n_base:
        motion[:count] = np.linalg.lstsq(rows[:, :count], -rows[:, count:], rcond=None)[0]
    return QuasiStaticMotion(motion, strain_free=False)
