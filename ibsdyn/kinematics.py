"""Where points of a body are and how they move, from the coordinates of its frame over time; rotations of any size.

Every array begins with the order of differentiation: 0 alone, 0 and 1, or 0 to 2, as many as are wanted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ibsdyn.axes import Array, skew

# Rotation matrix of Euler parameters (e0, e1, e2, e3) as a quadratic form: R_ij = e^T _QUADRATIC[i, j] e.
_QUADRATIC = np.zeros((3, 3, 4, 4))
for _i in range(3):
    _QUADRATIC[_i, _i] -= np.diag([-1.0, 1.0, 1.0, 1.0])
    for _j in range(3):
        _QUADRATIC[_i, _j, 1 + _i, 1 + _j] += 1.0
        _QUADRATIC[_i, _j, 1 + _j, 1 + _i] += 1.0
for _i, _j, _k, _sign in ((0, 1, 2, -1), (1, 0, 2, 1), (0, 2, 1, 1), (2, 0, 1, -1), (1, 2, 0, -1), (2, 1, 0, 1)):
    _QUADRATIC[_i, _j, 0, 1 + _k] += _sign
    _QUADRATIC[_i, _j, 1 + _k, 0] += _sign


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """A frame that moves: at each time displacement and rotation and their derivatives.

    Attributes
    ----------
    displacement : (orders, n, 3) of the origin from its undeformed position, its velocity, its acceleration; global
        axes.
    turn : (orders, n, 3, 3) the rotation matrix minus the identity, and the rotation matrix's derivatives.
    """

    displacement: Array
    turn: Array

    def point(self, lever: Array) -> Array:
        """Return (orders, n, 3) displacement, velocity and acceleration of a point that moves with the frame.

        Parameters
        ----------
        lever : (3,) from the origin to the point in the undeformed position [m].
        """
        moved: Array = self.displacement + self.turn @ lever
        return moved

    def rotation(self) -> Array:
        """Return (orders, n, 3) rotation vector (below half a turn), angular velocity and acceleration; global axes."""
        whole = self.turn[0] + np.eye(3)
        vector = Rotation.from_matrix(whole).as_rotvec()
        transposed = np.swapaxes(whole, 1, 2)
        return np.stack([vector, *(_axial(rate @ transposed) for rate in self.turn[1:])])

    def carried(self, offset: Array, motion: Array) -> FrameMotion:
        """Return the motion of a frame that moves a little in this one.

        Parameters
        ----------
        offset : (3,) of its origin in this frame, undeformed [m].
        motion : (orders, n, 6) its small displacement and rotation in this frame, their first and second derivatives.
        """
        small = np.zeros((*motion.shape[:2], 3, 3))
        small[..., [2, 0, 1], [1, 2, 0]] = motion[..., 3:]
        small[..., [1, 2, 0], [2, 0, 1]] = -motion[..., 3:]
        place = motion[..., :3].copy()
        place[0] += offset
        whole = self.turn.copy()
        whole[0] += np.eye(3)
        moved = _product(whole, place[..., None])[..., 0]
        moved[0] -= offset
        turned = _product(whole, small) + self.turn
        return FrameMotion(self.displacement + moved, turned)


def tait_bryan_frame(coordinates: Array) -> FrameMotion:
    """Return the motion of a frame of six: displacement and the angles of R = Rx Ry Rz.

    Parameters
    ----------
    coordinates : (orders, n, 6) and their first and second derivatives.
    """
    rotations = [_about(axis, coordinates[:, :, 3 + axis]) for axis in range(3)]
    whole = _product(_product(rotations[0], rotations[1]), rotations[2])
    whole[0] -= np.eye(3)
    return FrameMotion(coordinates[:, :, :3], whole)


def euler_parameter_frame(coordinates: Array) -> FrameMotion:
    """Return the motion of a frame of seven: displacement and Euler parameters minus (1, 0, 0, 0).

    Parameters
    ----------
    coordinates : (orders, n, 7) and their first and second derivatives.
    """
    e = coordinates[:, :, 3:].copy()
    small = e[0].copy()
    e[0, :, 0] += 1.0

    def form(a: Array, b: Array) -> Array:
        value: Array = np.einsum("na,ijab,nb->nij", a, _QUADRATIC, b, optimize=True)
        return value

    identity = np.array([1.0, 0.0, 0.0, 0.0])
    unit = np.broadcast_to(identity, small.shape)
    # R(1 + d) - R(1), so that small rotations keep their digits
    turn = [2 * form(unit, small) + form(small, small)]
    if len(e) > 1:
        turn.append(2 * form(e[0], e[1]))
    if len(e) > 2:
        turn.append(2 * form(e[1], e[1]) + 2 * form(e[0], e[2]))
    return FrameMotion(coordinates[:, :, :3], np.stack(turn))


def linear_frame(motion: Array) -> FrameMotion:
    """Return the motion of a frame of six that turns little.

    Parameters
    ----------
    motion : (orders, n, 6) displacement and rotation vector, and their first and second derivatives.
    """
    still = FrameMotion(np.zeros((*motion.shape[:2], 3)), np.zeros((*motion.shape[:2], 3, 3)))
    return still.carried(np.zeros(3), motion)


def _about(axis: int, angle: Array) -> Array:
    """Return (orders, n, 3, 3) the rotation about a global axis and its derivatives from (orders, n) angle and its."""
    generator = skew(np.eye(3)[axis])
    square = generator @ generator
    sine, cosine = np.sin(angle[0])[:, None, None], np.cos(angle[0])[:, None, None]
    turned = [np.eye(3) + sine * generator + (1 - cosine) * square]
    slope = cosine * generator + sine * square
    if len(angle) > 1:
        rate = angle[1][:, None, None]
        turned.append(rate * slope)
    if len(angle) > 2:
        turned.append(angle[2][:, None, None] * slope + rate**2 * (cosine * square - sine * generator))
    return np.stack(turned)


def _product(a: Array, b: Array) -> Array:
    """Return (orders, ...) a product of matrices and its derivatives from those of its factors."""
    product = [a[0] @ b[0]]
    if len(a) > 1:
        product.append(a[1] @ b[0] + a[0] @ b[1])
    if len(a) > 2:
        product.append(a[2] @ b[0] + 2 * (a[1] @ b[1]) + a[0] @ b[2])
    return np.stack(product)


def _axial(matrix: Array) -> Array:
    """Return the vector of the antisymmetric part of (n, 3, 3) matrices."""
    vector: Array = 0.5 * np.stack(
        [
            matrix[:, 2, 1] - matrix[:, 1, 2],
            matrix[:, 0, 2] - matrix[:, 2, 0],
            matrix[:, 1, 0] - matrix[:, 0, 1],
        ],
        axis=1,
    )
    return vector
