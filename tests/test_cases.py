"""Published cases, with the numbers as published."""

import numpy as np
import pytest
import scipy.linalg

import ibsdyn as ibs


def test_the_papers_matrices_of_two_inertias(validated):
    """Frame - k1 - J1 - k2 - J2 about z: the 1-D mass and stiffness matrices of the paper's concept model."""
    J1, J2, k1, k2 = 3e-4, 2e-4, 800.0, 500.0
    model = ibs.Model("concept", axis="rz")
    model.fixation("frame")
    model.rigid_body("stage", inertia=J1)
    model.rigid_body("mirror", inertia=J2)
    model.connection("mount", "frame", "stage", stiffness=k1)
    model.connection("flexure", "stage", "mirror", stiffness=k2)
    system = model.linearize()
    paper = {"source": "M and K of the 1-D concept model in the paper", "against": "published cases", "atol": 0.0}
    validated("concept model, M", expected=[[J1, 0], [0, J2]], found=system.M, unit="kg m²", **paper)
    validated("concept model, K", expected=[[k1 + k2, -k2], [-k2, k2]], found=system.K, unit="N·m/rad", **paper)
    np.testing.assert_array_equal(system.K_base, [[-k1], [0]])
    assert system.coordinates == ("stage.rz", "mirror.rz")
    assert system.base_coordinates == ("frame.rz",)


@pytest.mark.parametrize("axis", ["x", "y", "z", "rx", "ry", "rz"])
def test_one_dimensional_models_on_all_six_axes(axis):
    model = ibs.Model("1-D", axis=axis)
    model.fixation("frame")
    model.rigid_body("m", **{"inertia" if axis.startswith("r") else "mass": 0.5})
    model.connection("k", "frame", "m", stiffness=200.0, zeta=0.01)
    modes = model.linearize().modes()
    assert modes.frequencies[0] == pytest.approx(np.sqrt(400) / (2 * np.pi), rel=1e-12)
    load = ibs.Torque("m", axis) if axis.startswith("r") else ibs.Force("m", axis)
    frf = model.linearize().frf(load, ibs.Sensor("m", axis, quantity="displacement"), [0.0])
    assert frf.response[0, 0, 0] == pytest.approx(1 / 200.0)


def test_vm89_two_masses_three_springs(validated):
    modes = two_masses(0.5, 1.0, 200, 800, 200).linearize().modes()
    source = "Ansys Verification Manual VM89; Thomson, ex. 6.2-2"
    published = {"source": source, "against": "published cases", "rtol": 1e-4}
    found = modes.frequencies
    validated("two masses, three springs: frequencies", expected=[2.5814, 8.3263], found=found, unit="Hz", **published)
    ratios = modes.shapes[0] / modes.shapes[1]
    validated("two masses, three springs: amplitude ratios", expected=[0.92116, -2.1711], found=ratios, **published)


def test_vm90_harmonic_response(validated):
    system = two_masses(0.5, 0.5, 200, 200, 200).linearize()
    sensors = [ibs.Sensor(m, "x", quantity="displacement") for m in ("m1", "m2")]
    frf = system.frf(ibs.Force("m1", "x"), sensors, [1.5, 4.0, 6.5])
    expected = [[0.82272, 0.51145, 0.58513], [0.46274, 1.2153, 0.26966]]
    validated(
        "harmonic response at 1.5, 4 and 6.5 Hz",
        "Ansys Verification Manual VM90; Thomson, ex. 6.6-1",
        expected,
        200 * frf.magnitude[:, 0],
        rtol=2e-4,
        against="published cases",
        unit="m",
    )


def two_masses(m1, m2, k1, k12, k2):
    model = ibs.Model("two masses", axis="x")
    model.fixation("ground")
    model.rigid_body("m1", mass=m1)
    model.rigid_body("m2", mass=m2)
    model.connection("k1", "ground", "m1", stiffness=k1)
    model.connection("k12", "m1", "m2", stiffness=k12)
    model.connection("k2", "m2", "ground", stiffness=k2)
    return model


def test_vm52_bounce_and_pitch(validated):
    model = ibs.Model("car")
    model.fixation("ground")
    model.rigid_body("car", mass=100.0, cog=(0, 0, 0), inertia=(1600, 1600, 1600, 0, 0, 0))
    model.connection("rear", "ground", "car", position1=(-4.5, -1, 0), stiffness=(0, 2400, 0, 0, 0, 0))
    model.connection("front", "ground", "car", position1=(5.5, -1, 0), stiffness=(0, 2600, 0, 0, 0, 0))
    modes = model.linearize().modes()
    elastic = modes.frequencies[~modes.rigid]
    validated(
        "bounce and pitch of a rigid body on two springs",
        "Ansys Verification Manual VM52; Thomson, ex. 6.7-1",
        [1.0981, 1.4406],
        elastic,
        rtol=1e-4,
        against="published cases",
        unit="Hz",
    )
    assert modes.rigid.sum() == 4


IRVINE = [
    (-0.156972, -0.09779, 0.0762),
    (-0.156972, -0.09779, -0.0762),
    (-0.068072, -0.09779, 0.0762),
    (-0.068072, -0.09779, -0.0762),
]


def irvine(**loss):
    model = ibs.Model("avionics box on four isolators")
    model.fixation("shaker")
    model.rigid_body("box", mass=1.94137534, cog=(0, 0, 0), inertia=(0.01313952, 0.01167632, 0.00550163, 0, 0, 0))
    for i, position in enumerate(IRVINE):
        model.connection(
            f"isolator {i}",
            "shaker",
            "box",
            position1=position,
            stiffness=(14010.147,) * 3 + (0,) * 3,
            **loss,
        )
    return model


def test_irvine_box_on_four_isolators(validated):
    modes = irvine(zeta=0.02).linearize().modes()
    validated(
        "box on four isolators far from its CoG, six coupled modes",
        "T. Irvine, six-DOF isolated avionics component (vibrationdata.com)",
        [7.338, 12.02, 27.04, 27.47, 63.06, 83.19],
        modes.frequencies,
        rtol=5e-4,
        against="published cases",
        unit="Hz",
    )
    validated(
        "the same: equal ratios of the isolators are every mode's",
        "Johnson and Kienholz 1982, modal strain energy",
        np.full(6, 0.02),
        modes.damping_ratios,
        rtol=1e-9,
        against="closed forms",
    )
    assert sum(share[0] for share in modes.strain_energy.values()) == pytest.approx(1.0)


def test_vm71_ratio_of_a_single_mode(validated):
    """zeta 2, 1, 0.2, 0 from c; the free response at 0.09 s from the state space."""
    for c, zeta, x in zip(
        [3.52636, 1.76318, 0.352636, 0.0],
        [2.0, 1.0, 0.2, 0.0],
        [0.4742, 0.18998, -0.52108, -0.99688],
        strict=True,
    ):
        model = ibs.Model("sdof", axis="x")
        model.fixation("wall")
        model.rigid_body("m", mass=0.02590673)
        model.connection("s", "wall", "m", stiffness=30.0, damping=c)
        system = model.linearize()
        published = {"source": "Ansys Verification Manual VM71; Thomson, ex. 2.2-1", "against": "published cases"}
        found = system.modes().damping_ratios
        validated(f"damping ratio of a damper of {c:g} N s/m", expected=zeta, found=found, atol=1e-5, **published)
        space = system.to_state_space(ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="displacement"))
        free = scipy.linalg.expm(0.09 * space.A) @ [1.0, 0.0]
        what = f"free motion at 0.09 s, damping ratio {zeta:g}"
        validated(what, expected=x, found=free[0], atol=2e-4, unit="of its start", **published)


@pytest.mark.filterwarnings("ignore::ibsdyn.ModelWarning", "ignore::ibsdyn.SimulationWarning")  # zeta 2; 500 Hz
@pytest.mark.parametrize("by", ["zeta", "damper"])
@pytest.mark.parametrize(
    ("zeta", "c", "x"),
    [(2.0, 3.52636, 0.4742), (1.0, 1.76318, 0.18998), (0.2, 0.352636, -0.52108), (0.0, 0.0, -0.99688)],
)
def test_vm71_in_time(by, zeta, c, x, validated):
    """A constant force that bends the spring by 1 m: what is left to go is the free response from 1 m."""
    model = ibs.Model("sdof", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=0.02590673)
    loss = {"zeta": zeta} if by == "zeta" else {"damping": c}
    model.connection("s", "wall", "m", stiffness=30.0, **loss)
    record = model.simulate(
        {ibs.Force("m", "x"): np.full(101, 30.0)},
        ibs.Sensor("m", "x", quantity="displacement", name="x"),
        sample_rate=1000.0,
        start="rest",
        steps_per_sample=20,
    )
    what = f"free motion at 0.09 s in a run, damping ratio {zeta:g} by {by}"
    published = {"source": "Ansys Verification Manual VM71; Thomson, ex. 2.2-1", "against": "published cases"}
    validated(what, expected=x, found=1.0 - record["x"][90], atol=2e-4, unit="of its start", **published)


def test_required_stiffness_has_the_unit_of_one():
    assert ibs.required_stiffness(2e-3, 5.0, 5e-6) == pytest.approx(2000.0)
    assert ibs.required_stiffness(2e-3, 5.0, beam_deflection=1e-5) == pytest.approx(2000.0)
    with pytest.raises(ibs.ModelError, match="either"):
        ibs.required_stiffness(2e-3, 5.0)
    with pytest.raises(ibs.ModelError, match="above 0"):
        ibs.required_stiffness(2e-3, 5.0, 0.0)
