"""The six directions of a frame, their names, units and rigid-body algebra."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ibsdyn.errors import ModelError, nearest

Array = NDArray[np.float64]

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
STIFFNESS_NAMES = ("kx", "ky", "kz", "kxx", "kyy", "kzz")
INERTIA_NAMES = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


def is_rotation(direction: str) -> bool:
    """Tell whether a direction name is one of rx, ry, rz."""
    return direction.startswith("r")


def axis_index(direction: str, what: str) -> int:
    """Return the place of a direction name in x, y, z, rx, ry, rz.

    Raises
    ------
    ModelError : the name is none of the six; ``what`` says whose it is.
    """
    if direction not in DIRECTIONS:
        raise ModelError(f"{what}: direction {direction!r} is not known. {nearest(direction, DIRECTIONS)}")
    return DIRECTIONS.index(direction)


def skew(r: Sequence[float] | Array) -> Array:
    """Return the (3, 3) matrix of the cross product: ``skew(r) @ v == cross(r, v)``."""
    x, y, z = (float(v) for v in r)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rigid_transfer(lever: Sequence[float] | Array) -> Array:
    """Return the (6, 6) matrix that carries the motion of a frame to a point of the same rigid body.

    Parameters
    ----------
    lever : (3,) from the frame to the point [m].

    Notes
    -----
    Small rotations: u_point = u + theta x lever, theta_point = theta.
    """
    x, y, z = (float(v) for v in lever)
    transfer = np.eye(6)
    transfer[0, 4], transfer[0, 5] = z, -y
    transfer[1, 3], transfer[1, 5] = -z, x
    transfer[2, 3], transfer[2, 4] = y, -x
    return transfer


def rotate_six(rotation: Array) -> Array:
    """Return the (6, 6) block rotation of translations and rotations alike."""
    block = np.zeros((6, 6))
    block[:3, :3] = block[3:, 3:] = rotation
    return block
