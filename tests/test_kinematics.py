"""Frames in large rotation: against SciPy's rotations, and rates against differences over time."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ibsdyn.kinematics import euler_parameter_frame, linear_frame, tait_bryan_frame

STEP = 1e-4
TIME = np.arange(2000) * STEP
LEVER = np.array([0.3, -0.2, 0.5])


def smooth(columns, amplitude):
    """Smooth functions of time with their derivatives, (3, n, columns)."""
    rate = 20.0 + 3.0 * np.arange(columns)
    phase = rate * TIME[:, None] + np.arange(columns)
    return amplitude * np.stack([np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase)])


def tait_bryan():
    coordinates = smooth(6, 0.7)
    rotation = Rotation.from_euler("XYZ", coordinates[0, :, 3:])
    return tait_bryan_frame(coordinates), coordinates[0, :, :3], rotation


def euler_parameters():
    """Unit quaternions of a rotation vector that swings, differentiated by splines of high order."""
    from scipy.interpolate import make_interp_spline

    translation = smooth(3, 0.1)
    rotation = Rotation.from_rotvec(smooth(3, 0.6)[0])
    x, y, z, w = rotation.as_quat(canonical=True).T
    spline = make_interp_spline(TIME, np.stack([w - 1, x, y, z], axis=1), k=7)
    parameters = np.stack([spline(TIME), spline.derivative()(TIME), spline.derivative(2)(TIME)])
    return euler_parameter_frame(np.concatenate([translation, parameters], axis=2)), translation[0], rotation


def carried():
    """A frame that moves a little inside one that moves far; its own rotation is exact to the second order."""
    outer, origin, rotation = tait_bryan()
    offset, inside = np.array([0.1, 0.2, -0.1]), smooth(6, 1e-6)
    frame = outer.carried(offset, inside)
    place = origin + rotation.apply(offset + inside[0, :, :3]) - offset
    return frame, place, rotation * Rotation.from_rotvec(inside[0, :, 3:])


@pytest.mark.parametrize("made", [tait_bryan, euler_parameters, carried])
def test_points_and_rotations_and_their_rates(made):
    frame, origin, rotation = made()
    point = frame.point(LEVER)
    np.testing.assert_allclose(point[0], origin + rotation.apply(LEVER) - LEVER, atol=1e-9)
    vector, spin, change = frame.rotation()
    np.testing.assert_allclose((Rotation.from_rotvec(vector).inv() * rotation).magnitude(), 0.0, atol=1e-9)
    inner = slice(5, -5)
    for rate, values in ((point[1], point[0]), (point[2], point[1]), (change, spin)):
        expected = np.gradient(values, STEP, axis=0)
        np.testing.assert_allclose(rate[inner], expected[inner], atol=2e-4 * np.abs(rate).max())
    turned = (rotation[2:] * rotation[:-2].inv()).as_rotvec() / (2 * STEP)
    np.testing.assert_allclose(spin[1:-1][inner], turned[inner], atol=2e-4 * np.abs(spin).max())


def test_nanoradians_keep_their_digits():
    angles = np.zeros((3, 1, 6))
    angles[0, 0] = [1e-12, 2e-12, 3e-12, 1e-12, -2e-12, 3e-12]
    moved = angles[0, 0, :3] + np.cross(angles[0, 0, 3:], LEVER)
    for frame in (tait_bryan_frame(angles), linear_frame(angles)):
        np.testing.assert_allclose(frame.point(LEVER)[0, 0], moved, rtol=1e-3)
        np.testing.assert_allclose(frame.rotation()[0, 0], angles[0, 0, 3:], rtol=1e-3)
    parameters = np.zeros((3, 1, 7))
    parameters[0, 0] = [1e-12, 2e-12, 3e-12, 0.0, *(angles[0, 0, 3:] / 2)]
    np.testing.assert_allclose(euler_parameter_frame(parameters).point(LEVER)[0, 0], moved, rtol=1e-3)
