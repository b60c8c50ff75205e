"""FRFs against direct partitioned solves and closed forms."""

import numpy as np
import pytest
from analytic import RandomAssembly, lever
from hypothesis import given, settings
from hypothesis import strategies as st

import ibsdyn as ibs


def partitioned(random, system, frequency, hysteretic=False):
    """Dynamic stiffness [free, base] over all coordinates, K and M by hand, C of ratios as the system has it."""
    M, K, C = random.matrices()
    n = len(system.coordinates)
    w = 2 * np.pi * frequency
    Z = K - w**2 * M + 1j * w * C
    if hysteretic:
        for s in random.springs:
            if s["c"] is None:
                rows = random.strain(s)
                Z = Z + 2j * s["zeta"] * rows.T @ np.diag(s["k"]) @ rows
    elif not C.any():
        Z = Z.astype(complex)
        Z[:n, :n] += 1j * w * system.C
        Z[:n, n:] += 1j * w * system.C_base
    return Z[:n, :n], Z[:n, n:]


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["zeta", "damper", "hysteretic", "damper and hysteretic"]))
def test_equals_the_partitioned_solve(seed, kind):
    random = RandomAssembly(seed, count=4, zeta=(0.002, 0.05), damper="damper" in kind, k=(4, 7))
    for s in random.springs[::2]:
        s["c"] = None  # dampers and ratios in one model
    if kind == "damper":
        for s in random.springs:
            s["zeta"] = 0.0
    system = random.model(ibs).linearize()
    hysteretic = "hysteretic" in kind
    frequencies = np.array([0.3, 3.0, 33.0, 150.0])
    inputs = [
        ibs.Force("b0", (1, 2, 3), position=(0.1, 0.2, 0.3)),
        ibs.Torque("b1", "ry"),
        ibs.BaseMotion("ground", "rx", quantity="displacement"),
        ibs.BaseMotion("ground", "z", quantity="acceleration"),
    ]
    outputs = [
        ibs.Sensor("b2", "z", position=(0.4, 0, 0.1), quantity="acceleration"),
        ibs.Sensor("b3", "rz", quantity="displacement"),
        ibs.Sensor("b1", "x", quantity="velocity", relative_to="ground"),
    ]
    got = system.frf(inputs, outputs, frequencies, hysteretic=hysteretic)
    direction = np.array([1, 2, 3]) / np.sqrt(14)
    for f, frequency in enumerate(frequencies):
        s = 2j * np.pi * frequency
        free, base = partitioned(random, system, frequency, hysteretic)
        loads = np.zeros((24, 4), dtype=complex)
        loads[:6, 0] = lever(np.array([0.1, 0.2, 0.3]) - random.cog[0])[:3].T @ direction
        loads[10, 1] = 1.0
        moved = np.zeros((6, 4), dtype=complex)
        moved[3, 2], moved[2, 3] = 1.0, 1 / s**2
        x = np.linalg.solve(free, loads - base @ moved)
        y = np.array(
            [
                s**2 * lever(np.array([0.4, 0, 0.1]) - random.cog[2])[2] @ x[12:18],
                x[23],
                s * (x[6] - (lever(random.cog[1] - random.fixation) @ moved)[0]),
            ]
        )
        np.testing.assert_allclose(got.response[:, :, f], y, rtol=1e-7, atol=1e-9 * np.abs(y).max())


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000))
def test_base_motion_tends_to_the_rigid_motion(seed):
    random = RandomAssembly(seed, count=4, zeta=0.01, k=(5, 8))
    system = random.model(ibs).linearize()
    low = system.modes().frequencies[0] * 1e-4
    point = np.array([0.3, -0.2, 0.1])
    inputs = [ibs.BaseMotion("ground", d) for d in ("x", "y", "z", "rx", "ry", "rz")]
    outputs = [ibs.Sensor("b3", d, position=point) for d in ("x", "y", "z", "rx", "ry", "rz")]
    got = system.frf(inputs, outputs, [low]).response[:, :, 0]
    np.testing.assert_allclose(got, lever(point - random.fixation), atol=1e-6)


def test_free_body_answers_a_force_with_its_mass():
    model = ibs.Model("free")
    model.rigid_body("box", mass=4.0, cog=(0.1, 0, 0), inertia=(0.1, 0.2, 0.25, 0, 0, 0))
    frf = model.linearize().frf(ibs.Force("box", "z"), ibs.Sensor("box", "z"), [0.1, 10.0])
    np.testing.assert_allclose(frf.response[0, 0], 1 / 4.0, rtol=1e-12)
    off = model.linearize().frf(ibs.Force("box", "z", position=(0.3, 0, 0)), ibs.Sensor("box", "ry"), [1.0])
    np.testing.assert_allclose(off.response[0, 0], -0.2 / 0.2, rtol=1e-12)


def test_free_bodies_with_an_explicit_damper_keep_their_rigid_motion():
    """Two free masses and a spring-damper: total acceleration is F / (m1 + m2) at every frequency."""
    model = ibs.Model("dumbbell", axis="x")
    model.rigid_body("a", mass=1.0)
    model.rigid_body("b", mass=3.0)
    model.connection("s", "a", "b", stiffness=1e4, damping=5.0)
    frequencies = np.geomspace(1e-3, 1e3, 50)
    frf = model.linearize().frf(ibs.Force("a", "x"), [ibs.Sensor("a", "x"), ibs.Sensor("b", "x")], frequencies)
    np.testing.assert_allclose(frf.response[0, 0] + 3 * frf.response[1, 0], 1.0, rtol=1e-9)
    s = 2j * np.pi * frequencies
    k = 1e4 + 5 * s
    np.testing.assert_allclose(frf.response[1, 0], k / (3 * s**2 + 4 * k), rtol=1e-9)


def test_body_held_by_a_damper_only():
    model = ibs.Model("dashpot", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    model.connection("dashpot", "wall", "m", stiffness=0.0, damping=8.0)
    w = 2 * np.pi * np.array([0.01, 1.0, 100.0])
    frf = model.linearize().frf(ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="velocity"), w / (2 * np.pi))
    np.testing.assert_allclose(frf.response[0, 0], 1 / (8 + 2j * w), rtol=1e-9)


def test_critically_damped_modes_fall_back_to_direct_solves():
    """zeta = 1 exactly makes the first-order form defective; the response must not notice."""
    model = ibs.Model("critical", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    model.connection("s", "wall", "m", stiffness=200.0, damping=2 * np.sqrt(400.0))
    w = 2 * np.pi * np.geomspace(0.01, 100, 30)
    frf = model.linearize().frf(ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="displacement"), w / (2 * np.pi))
    np.testing.assert_allclose(frf.response[0, 0], 1 / (200 - 2 * w**2 + 40j * w), rtol=1e-9)


def test_hysteretic_single_mode_has_loss_factor_two_zeta():
    model = ibs.Model("h", axis="rz")
    model.fixation("wall")
    model.rigid_body("mirror", inertia=2e-4)
    model.connection("flexure", "wall", "mirror", stiffness=500.0, zeta=0.02)
    f = np.array([1.0, 200.0, 251.6, 400.0])
    w = 2 * np.pi * f
    frf = model.linearize().frf(
        ibs.Torque("mirror", "rz"), ibs.Sensor("mirror", "rz", quantity="displacement"), f, hysteretic=True
    )
    np.testing.assert_allclose(frf.response[0, 0], 1 / (500 * (1 + 0.04j) - 2e-4 * w**2), rtol=1e-10)


def test_order_names_units_and_selection():
    system = RandomAssembly(0, count=3, zeta=0.01).model(ibs).linearize()
    inputs = [ibs.Force("b0", "x"), ibs.BaseMotion("ground", "rx")]
    outputs = [
        ibs.Sensor("b1", "z", name="Y1"),
        ibs.Sensor("b2", "rz"),
        ibs.Sensor("b2", "x", quantity="velocity"),
    ]
    frf = system.frf(inputs, outputs, np.linspace(1, 50, 7))
    assert frf.response.shape == (3, 2, 7)
    assert frf.outputs == ("Y1", "b2.rz acceleration", "b2.x velocity")
    assert frf.inputs == ("force b0.x", "ground.rx acceleration")
    assert frf.output_units == ("m/s²", "rad/s²", "m/s")
    assert frf.unit(0, 0) == "(m/s²)/N"
    assert frf.unit(1, 1) == "-"
    picked = frf.select(outputs="b2.x velocity", inputs="force b0.x")
    np.testing.assert_array_equal(picked.response[0, 0], frf.response[2, 0])
    with pytest.raises(ibs.UnknownNameError, match="Did you mean 'Y1'"):
        frf.select(outputs="y1")


def test_frequencies_that_are_none_are_refused():
    system = RandomAssembly(0, count=2, zeta=0.01).model(ibs).linearize()
    ask = (ibs.Force("b0", "x"), ibs.Sensor("b0", "x"))
    for bad, words in (
        ([-1.0], "-1.0"),
        ([np.nan], "nan"),
        ([], "shape"),
        ("abc", "abc"),
        ([[1.0]], "shape"),
    ):
        with pytest.raises(ibs.AnalysisError, match=words):
            system.frf(*ask, bad)


def test_infinite_responses_are_told_with_their_cause():
    model = ibs.Model("undamped", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=1.0)
    model.connection("s", "wall", "m", stiffness=4.0)
    system = model.linearize()
    static = system.frf(ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="displacement"), [0.0])
    assert static.response[0, 0, 0] == pytest.approx(0.25)
    resonance = 2.0 / (2 * np.pi)
    with pytest.raises(ibs.AnalysisError, match="zeta"):
        system.frf(ibs.Force("m", "x"), ibs.Sensor("m", "x"), [resonance])
    with pytest.raises(ibs.AnalysisError, match="0 Hz"):
        system.frf(ibs.BaseMotion("wall", "x"), ibs.Sensor("m", "x", quantity="displacement"), [0.0])
    free = ibs.Model("free", axis="x")
    free.rigid_body("m", mass=1.0)
    with pytest.raises(ibs.AnalysisError, match="rigid-body"):
        free.linearize().frf(ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="displacement"), [0.0, 1.0])


def test_many_frequencies_cost_no_solve_each(monkeypatch):
    """Thousands of lines must not be thousands of dense solves, with dampers neither."""
    system = RandomAssembly(2, count=10, damper=True).model(ibs).linearize()
    solved = []
    solve = np.linalg.solve
    monkeypatch.setattr(np.linalg, "solve", lambda a, b: solved.append(np.prod(np.shape(a)[:-2])) or solve(a, b))
    system.frf(ibs.Force("b0", "x"), ibs.Sensor("b5", "z"), np.linspace(1, 500, 4000))
    assert sum(solved) < 20
