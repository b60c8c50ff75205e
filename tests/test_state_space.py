"""State spaces against the FRFs of the same inputs and outputs."""

import numpy as np
import pytest
import scipy.signal
from analytic import RandomAssembly

import ibsdyn as ibs

FREQUENCIES = np.geomspace(0.5, 300, 12)


def response(space, frequencies):
    eye = np.eye(len(space.A))
    return np.stack(
        [space.C @ np.linalg.solve(2j * np.pi * f * eye - space.A, space.B) + space.D for f in frequencies],
        axis=-1,
    )


@pytest.mark.parametrize("damper", [False, True])
@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_base_motion_and_forces(damper, quantity):
    system = RandomAssembly(3, count=3, zeta=0.01, damper=damper, k=(4, 6)).model(ibs).linearize()
    inputs = [
        ibs.Force("b0", "x"),
        ibs.BaseMotion("ground", "ry", quantity),
        ibs.BaseMotion("ground", "z", quantity),
    ]
    outputs = [ibs.Sensor("b1", "y", quantity="displacement"), ibs.Sensor("b2", "rx", quantity=quantity)]
    if damper and quantity == "displacement":
        outputs = outputs[:1]
    space = system.to_state_space(inputs, outputs)
    expected = system.frf(inputs, outputs, FREQUENCIES).response
    got = response(space, FREQUENCIES)
    for o, i in np.ndindex(expected.shape[:2]):
        np.testing.assert_allclose(got[o, i], expected[o, i], atol=1e-7 * np.abs(expected[o, i]).max())
    assert np.isrealobj(space.A)
    assert len(space.states) == len(space.A)


def test_locked_base_brings_mass_coupling():
    """A flexible chain whose first body is locked to the base: M_base is not zero."""
    model = ibs.Model("locked")
    model.fixation("ground")
    model.rigid_body("plate", mass=2.0, cog=(0.1, 0, 0), inertia=(0.1, 0.1, 0.1, 0, 0, 0))
    model.rigid_body("top", mass=1.0, cog=(0, 0.1, 0.2), inertia=(0.01, 0.01, 0.01, 0, 0, 0))
    model.connection(
        "bolts",
        "ground",
        "plate",
        position1=(0, 0, 0),
        stiffness=(np.inf, np.inf, np.inf, 1e3, 1e3, 1e3),
        zeta=0.01,
    )
    model.connection("spring", "plate", "top", position1=(0, 0, 0.1), stiffness=(1e4, 1e4, 1e4, 50, 60, 70), zeta=0.02)
    system = model.linearize()
    assert system.M_base.any()
    for quantity in ("velocity", "acceleration"):
        inputs = [ibs.BaseMotion("ground", "x", quantity), ibs.BaseMotion("ground", "rz", quantity)]
        outputs = [
            ibs.Sensor("top", "y", quantity="displacement"),
            ibs.Sensor("plate", "x", quantity="velocity"),
        ]
        got = response(system.to_state_space(inputs, outputs), FREQUENCIES)
        expected = system.frf(inputs, outputs, FREQUENCIES).response
        np.testing.assert_allclose(got, expected, atol=1e-8 * np.abs(expected).max())


def test_an_improper_output_is_refused_with_the_cure():
    system = RandomAssembly(3, count=2, damper=True).model(ibs).linearize()
    with pytest.raises(ibs.AnalysisError, match="quantity='acceleration'"):
        system.to_state_space(ibs.BaseMotion("ground", "x", "displacement"), ibs.Sensor("b0", "x"))


def test_scipy_takes_it():
    model = ibs.Model("sdof", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    model.connection("s", "wall", "m", stiffness=50.0, zeta=0.1)
    space = model.linearize().to_state_space(ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="displacement"))
    _, y = scipy.signal.step(scipy.signal.StateSpace(space.A, space.B, space.C, space.D), T=np.linspace(0, 40, 2000))
    assert y[-1] == pytest.approx(1 / 50, rel=1e-3)
    assert y.max() == pytest.approx((1 + np.exp(-np.pi * 0.1 / np.sqrt(0.99))) / 50, rel=1e-3)
