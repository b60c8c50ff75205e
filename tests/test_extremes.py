"""Stiff beside soft, heavy beside light, few springs: where an assembled matrix has lost its digits."""

import numpy as np
import pytest
from analytic import RandomAssembly, lever
from hypothesis import given, settings
from hypothesis import strategies as st
from test_bad_input import two_interfaces

import ibsdyn as ibs

INF = np.inf
point = st.tuples(*[st.floats(-0.4, 0.4)] * 3)


@settings(max_examples=60, deadline=None)
@given(
    point,
    point,
    point,
    st.sampled_from(
        [
            (0, 1e6, 0, 100, 100, 100),
            (1e6, 1e6, 0, 0, 0, 0),
            (1e6, 0, 0, 0, 0, 0),
            (0, 0, 1e6, 0, 0, 0),
            (1e6, 0, 1e5, 10, 0, 0),
            (INF, 1e7, INF, INF, 1e3, INF),
        ]
    ),
)
def test_a_spring_that_leaves_directions_free_is_no_error(ground, cog, at, stiffness):
    model = ibs.Model("one spring")
    model.fixation("f", position=ground)
    model.rigid_body("b", mass=1.0, cog=cog, inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    model.connection("s", "f", "b", position1=at, stiffness=stiffness, zeta=0.01)
    modes = model.linearize().modes()
    assert modes.rigid.sum() == sum(k == 0 for k in stiffness)
    np.testing.assert_allclose(modes.damping_ratios[~modes.rigid], 0.01, rtol=1e-9)


@pytest.mark.parametrize("glue", [1e10, 1e11, 1e13, 1e15])
def test_a_prism_glued_to_a_heavy_table(glue):
    """1000 kg on four mounts, 0.1 g glued on top: the table's frequencies by hand, whatever the glue."""
    model = ibs.Model("table")
    model.fixation("floor")
    model.rigid_body("table", mass=1000.0, cog=(0, 0, 0.5), inertia=(100, 100, 100, 0, 0, 0))
    model.rigid_body("prism", mass=1e-4, cog=(0, 0, 1.0), inertia=(1e-9, 1e-9, 1e-9, 0, 0, 0))
    for i, (x, y) in enumerate(((0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5))):
        model.connection(f"mount {i}", "floor", "table", (x, y, 0), stiffness=(1e5, 1e5, 1e5, 0, 0, 0), zeta=0.01)
    model.connection("glue", "table", "prism", (0, 0, 1), stiffness=(glue,) * 6, zeta=0.01)
    modes = model.linearize().modes()
    assert modes.frequencies[2] == pytest.approx(np.sqrt(4e5 / 1000.0001) / (2 * np.pi), rel=1e-8)  # straight up
    # sideways and tilting in one: 2x2 by hand, the prism carried along
    m, height = 1000.0001, 0.5
    z = 1e-4 * 0.5 / m  # the common CoG above the table's
    inertia = 100 + 1000 * z**2 + 1e-9 + 1e-4 * (0.5 - z) ** 2
    arm = height + z
    K = np.array([[4e5, -4e5 * arm], [-4e5 * arm, 4e5 * arm**2 + 4e5 * 0.25]])
    omega = np.sqrt(np.linalg.eigvals(np.linalg.solve(np.diag([m, inertia]), K)))
    np.testing.assert_allclose(modes.frequencies[:2], min(omega) / (2 * np.pi), rtol=1e-8)
    np.testing.assert_allclose(modes.damping_ratios[:3], 0.01, rtol=1e-6)


@pytest.mark.parametrize("soft", [1e3, 1.0, 1e-3])
def test_a_part_on_isolators_that_hardly_hold_it_is_not_free(soft):
    model = ibs.Model("isolated")
    model.fixation("f")
    model.flexible_body("flexure", two_interfaces(), zeta=0.01)
    model.connection("isolator", "f", "flexure.base", stiffness=(soft,) * 3 + (soft / 100,) * 3, zeta=0.01)
    modes = model.linearize().modes()
    assert not modes.rigid.any()
    scaled = modes.frequencies[:6] / np.sqrt(soft)
    reference = ibs.Model("isolated")
    reference.fixation("f")
    reference.flexible_body("flexure", two_interfaces(), zeta=0.01)
    reference.connection("isolator", "f", "flexure.base", stiffness=(1e-6,) * 3 + (1e-8,) * 3, zeta=0.01)
    limit = reference.linearize().modes().frequencies[:6] / np.sqrt(1e-6)  # the part as a rigid body
    np.testing.assert_allclose(scaled, limit, rtol=0.01 if soft > 1 else 1e-4)


def test_a_loose_body_beside_a_stiff_machine():
    random = RandomAssembly(2, count=3, zeta=0.01, k=(7, 9))
    model = random.model(ibs)
    held = model.linearize().modes().frequencies
    model.rigid_body("loose", mass=1.0, cog=(0, 0, 1), inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    modes = model.linearize().modes()
    assert modes.rigid.sum() == 6
    np.testing.assert_allclose(modes.frequencies[6:], held, rtol=1e-9)
    assert any("loose is not connected" in finding for finding in model.check())


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000))
def test_what_lags_behind_a_slow_base_keeps_its_digits(seed):
    """Relative motion under slow base acceleration tends to -K^-1 M R, also where the absolute motions cancel."""
    random = RandomAssembly(seed, count=4, zeta=0.01, k=(5, 9))
    system = random.model(ibs).linearize()
    sensors = [
        ibs.Sensor("b3", d, quantity="displacement", relative_to="ground") for d in ("x", "y", "z", "rx", "ry", "rz")
    ]
    inputs = [ibs.BaseMotion("ground", d) for d in ("x", "ry")]
    got = system.frf(inputs, sensors, [0.0, 1e-4, 1e-3]).response
    M, K, _ = random.matrices()
    rigid = np.vstack([lever(p - random.fixation) for p in random.cog])[:, [0, 4]]
    expected = -np.linalg.solve(K[:24, :24], M[:24, :24] @ rigid)[18:24]
    for f in range(3):
        np.testing.assert_allclose(got[:, :, f].real, expected, rtol=1e-5, atol=1e-7 * np.abs(expected).max())


def test_a_free_machine_with_dampers_costs_no_solve_per_frequency(monkeypatch):
    system = RandomAssembly(3, count=12, fixed=False, damper=True).model(ibs).linearize()
    solved = []
    solve = np.linalg.solve
    monkeypatch.setattr(np.linalg, "solve", lambda a, b: solved.append(np.prod(np.shape(a)[:-2])) or solve(a, b))
    system.frf(ibs.Force("b0", "x"), ibs.Sensor("b5", "z"), np.linspace(1, 500, 3000))
    assert sum(solved) < 20


def test_check_and_modes_agree_on_what_is_free():
    model = ibs.Model("two springs")
    model.fixation("f", position=(0.3, -2, 0.7))
    model.rigid_body("car", mass=100.0, cog=(0, 0, 0), inertia=(1600, 1600, 1600, 0, 0, 0))
    for name, x, k in (("rear", -4.5, 2400), ("front", 5.5, 2600)):
        model.connection(name, "f", "car", position1=(x, -1, 0.3), stiffness=(0, k, 0, 0, 0, 0), zeta=0.02)
    modes = model.linearize().modes()
    assert modes.rigid.sum() == 4
    found = " ".join(model.check())
    assert sum(found.count(words) for words in ("to move along", "to rotate about")) == 4
