"""Locked directions: exact elimination, and what they may not do."""

import math

import numpy as np
import pytest
from analytic import lever

import ibsdyn as ibs

INF = math.inf


def two_boxes(stiffness, axes=None):
    model = ibs.Model("two boxes")
    model.fixation("ground", position=(0, 0, -0.1))
    model.rigid_body("lower", mass=3.0, cog=(0, 0, 0), inertia=(0.02, 0.03, 0.04, 0.001, 0, 0))
    model.rigid_body("upper", mass=1.0, cog=(0.02, 0.01, 0.2), inertia=(0.005, 0.006, 0.007, 0, 0, 0.0005))
    model.connection(
        "mount",
        "ground",
        "lower",
        position1=(0, 0, -0.05),
        stiffness=(1e5, 2e5, 3e5, 100, 200, 300),
        zeta=0.01,
    )
    model.connection("joint", "lower", "upper", position1=(0.01, 0, 0.1), stiffness=stiffness, axes=axes, zeta=0.01)
    return model


def test_two_bodies_locked_are_one_body():
    system = two_boxes((INF,) * 6).linearize()
    assert system.coordinates == tuple(f"lower.{d}" for d in ("x", "y", "z", "rx", "ry", "rz"))
    carried = lever([0.02, 0.01, 0.2])
    upper = np.zeros((6, 6))
    upper[:3, :3] = np.eye(3)
    upper[3:, 3:] = [[0.005, 0, 0], [0, 0.006, 0.0005], [0, 0.0005, 0.007]]
    expected = carried.T @ upper @ carried
    expected[:3, :3] += 3 * np.eye(3)
    expected[3:, 3:] += [[0.02, 0.001, 0], [0.001, 0.03, 0], [0, 0, 0.04]]
    np.testing.assert_allclose(system.M, expected, atol=1e-14)
    # what was eliminated can still be looked at
    frf = system.frf(ibs.Force("upper", "x"), ibs.Sensor("upper", "x"), [1e4])
    compliance = carried[0] @ np.linalg.solve(expected, carried[0])
    assert frf.response[0, 0, 0].real == pytest.approx(compliance, rel=2e-3)


def test_a_lock_is_the_limit_of_a_stiff_spring():
    rotation = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    locked = two_boxes((INF, 1e5, INF, 50, INF, 0), rotation).linearize()
    stiff = two_boxes((1e13, 1e5, 1e13, 50, 1e11, 0), rotation).linearize()
    assert len(locked.coordinates) == 9
    np.testing.assert_allclose(locked.modes().frequencies, stiff.modes().frequencies[:9], rtol=1e-5)
    inputs = [ibs.Force("upper", "y"), ibs.BaseMotion("ground", "rx")]
    outputs = [ibs.Sensor("upper", "z"), ibs.Sensor("lower", "ry")]
    f = [1.0, 20.0, 80.0]
    a, b = (s.frf(inputs, outputs, f).response for s in (locked, stiff))
    np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-6 * np.abs(b).max())


def test_a_body_locked_to_a_fixation_brings_base_mass():
    model = ibs.Model("bolted down")
    model.fixation("table")
    model.rigid_body("plate", mass=5.0, cog=(0.1, 0, 0.05), inertia=(0.05, 0.05, 0.05, 0, 0, 0))
    model.rigid_body("mirror", mass=1.0, cog=(0, 0, 0.2), inertia=(0.001, 0.001, 0.001, 0, 0, 0))
    model.connection("bolts", "table", "plate", position1=(0, 0, 0), stiffness=(INF,) * 6)
    model.connection(
        "flexure",
        "plate",
        "mirror",
        position1=(0, 0, 0.1),
        stiffness=(1e5, 1e5, 1e6, 500, 500, 300),
        zeta=0.01,
    )
    system = model.linearize()
    assert all(name.startswith("mirror.") for name in system.coordinates)
    low = system.frf(
        ibs.BaseMotion("table", "rx"),
        [ibs.Sensor("plate", "z", (0, 0.3, 0)), ibs.Sensor("mirror", "y")],
        [1e-3],
    )
    np.testing.assert_allclose(low.response[:, 0, 0], [0.3, -0.2], rtol=1e-6)


def test_parallel_locks_are_redundant_and_said():
    model = two_boxes((INF,) * 6)
    model.connection("second joint", "lower", "upper", position1=(0.05, 0, 0.1), stiffness=(INF,) * 6)
    assert model.linearize().redundant_locks == 6
    assert any("over-constrained 6 times" in finding for finding in model.check())


def test_locks_that_tie_fixations_or_leave_nothing_are_refused():
    model = ibs.Model("tied")
    model.fixation("left")
    model.fixation("right", position=(1, 0, 0))
    model.rigid_body("bar", mass=1.0, cog=(0.5, 0, 0), inertia=(0.01, 0.01, 0.01, 0, 0, 0))
    model.connection("a", "left", "bar", position1=(0, 0, 0), stiffness=(INF,) * 6)
    with pytest.raises(ibs.ModelError, match="nothing in the model can move"):
        model.linearize()
    model.connection("b", "right", "bar", position1=(1, 0, 0), stiffness=(INF, 0, 0, 0, 0, 0))
    with pytest.raises(ibs.ModelError, match="left and right"):
        model.linearize()
    assert any("left and right" in finding for finding in model.check())


def test_one_dimensional_lock():
    model = ibs.Model("locked", axis="rz")
    model.fixation("frame")
    model.rigid_body("holder", inertia=1e-4)
    model.rigid_body("mirror", inertia=2e-4)
    model.connection("flexure", "frame", "holder", stiffness=300.0)
    model.connection("glue", "holder", "mirror", stiffness=INF)
    system = model.linearize()
    np.testing.assert_allclose(system.M, [[3e-4]])
