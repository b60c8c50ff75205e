"""Small rigid-body motions and what they say about a mass matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def cross_matrix(vector: ArrayLike) -> FloatArray:
    """Return X (3, 3) with X @ b = vector x b."""
    x, y, z = np.asarray(vector, dtype=np.float64)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rigid_motion_at(point: ArrayLike, origin: ArrayLike) -> FloatArray:
    """Return X (6, 6): six motions at `point` per translation and small rotation about `origin`.

    u = t + theta x (point - origin), rotation theta; global axes, m and rad.
    """
    transfer = np.eye(6)
    transfer[:3, 3:] = -cross_matrix(np.asarray(point, dtype=np.float64) - np.asarray(origin, dtype=np.float64))
    return transfer


def rigid_motion_of_dofs(positions: FloatArray, directions: NDArray[np.int64], origin: ArrayLike) -> FloatArray:
    """Return R (n, 6): motion of n DoF per translation and small rotation about `origin`.

    positions: (n, 3) the node position of each DoF [m]; directions: (n,) 1..6.
    """
    arm = positions - np.asarray(origin, dtype=np.float64)
    motion = np.zeros((len(directions), 6))
    motion[np.arange(len(directions)), directions - 1] = 1.0
    for axis in range(3):
        rows = directions == axis + 1
        following, last = (axis + 1) % 3, (axis + 2) % 3
        motion[rows, 3 + following] = arm[rows, last]
        motion[rows, 3 + last] = -arm[rows, following]
    return motion


@dataclass(frozen=True)
class MassProperties:
    """Mass along x, y, z [kg] (3,), centre of gravity (3,) [m], inertia tensor about it (3, 3) [kg m2]."""

    mass_per_axis: FloatArray
    centre_of_mass: FloatArray
    inertia: FloatArray

    @property
    def mass(self) -> float:
        """Mean of the masses along the three axes [kg]."""
        return float(np.mean(self.mass_per_axis))


def mass_properties(rigid_mass: FloatArray, origin: ArrayLike) -> MassProperties:
    """Read mass, centre of gravity and inertia out of R^T M R (6, 6), R about `origin`.

    The translation-rotation block is m times the antisymmetric matrix of -c; averaging its two triangles
    keeps the answer sensible where a few DoF are missing.
    """
    mass_per_axis = np.diag(rigid_mass)[:3].copy()
    mass = float(np.mean(mass_per_axis))
    coupling = rigid_mass[:3, 3:]
    moment = np.array(
        [
            coupling[1, 2] - coupling[2, 1],
            coupling[2, 0] - coupling[0, 2],
            coupling[0, 1] - coupling[1, 0],
        ]
    )
    arm = 0.5 * moment / mass if mass > 0.0 else np.zeros(3)
    to_centre = rigid_motion_at(np.zeros(3), arm)
    about_centre = to_centre.T @ rigid_mass @ to_centre
    inertia = 0.5 * (about_centre[3:, 3:] + about_centre[3:, 3:].T)
    return MassProperties(mass_per_axis, np.asarray(origin, dtype=np.float64) + arm, inertia)
