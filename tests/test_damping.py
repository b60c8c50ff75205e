"""The damping matrix of relative ratios against its definition, written out here."""

import numpy as np
import pytest
import scipy.linalg
from analytic import RandomAssembly, scaled_error
from hypothesis import given, settings
from hypothesis import strategies as st

import ibsdyn as ibs


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.0, 1.0]))
def test_equal_ratios_come_back_as_every_modes_ratio(seed, apart):
    modes = RandomAssembly(seed, zeta=0.013, apart=apart).model(ibs).linearize().modes()
    np.testing.assert_allclose(modes.damping_ratios, 0.013, rtol=1e-9)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000))
def test_matrix_equals_its_definition(seed):
    random = RandomAssembly(seed, count=6, zeta=(0.0, 0.2), apart=0.4)
    system = random.model(ibs).linearize()
    M, K, _ = random.matrices()
    n = 36
    squared, phi = scipy.linalg.eigh(K[:n, :n], M[:n, :n])
    omega = np.sqrt(squared)
    weights = np.zeros(n)
    for s in random.springs:
        deformation = random.strain(s)[:, :n] @ phi
        weights += s["zeta"] * np.einsum("ir,i,ir->r", deformation, s["k"], deformation)
    ratios = weights / squared
    F = K[:, :n] @ phi
    C = F @ np.diag(2 * ratios / omega**3) @ F.T
    assert scaled_error(system.C, C[:n, :n]) < 1e-6
    size = np.sqrt(np.outer(np.diag(C)[:n], np.diag(C)[n:]))
    assert np.max(np.abs(system.C_base - C[:n, n:]) / size) < 1e-6
    np.testing.assert_allclose(system.modes().damping_ratios, ratios, rtol=1e-6)
    assert np.linalg.eigvalsh(system.C).min() > -1e-9 * np.linalg.norm(system.C)


def test_rigid_body_modes_are_not_damped():
    system = RandomAssembly(4, fixed=False, zeta=0.05).model(ibs).linearize()
    modes = system.modes()
    assert not modes.damping_ratios[:6].any()
    np.testing.assert_allclose(modes.damping_ratios[6:], 0.05, rtol=1e-9)


def test_explicit_damper_takes_the_place_of_zeta():
    def chain(**loss):
        model = ibs.Model("chain", axis="x")
        model.fixation("wall")
        model.rigid_body("m", mass=2.0)
        model.connection("spring", "wall", "m", stiffness=200.0, **loss)
        return model

    system = chain(damping=3.0, zeta=0.1).linearize()
    np.testing.assert_allclose(system.C, [[3.0]])
    np.testing.assert_allclose(system.C_base, [[-3.0]])
    assert system.modes().damping_ratios[0] == pytest.approx(3.0 / (2 * np.sqrt(200.0 * 2.0)))
    assert any("replaces zeta" in finding for finding in chain(damping=3.0, zeta=0.1).check())
    assert chain(zeta=0.1).linearize().C[0, 0] == pytest.approx(2 * 0.1 * np.sqrt(400.0))


def test_modal_strain_energy_of_two_different_ratios(validated):
    """Two stages, 140 and 442 Hz, zeta 0.02 and 0.10: the ratios of a published comparison of definitions."""
    model = ibs.Model("two stages", axis="z")
    model.fixation("base")
    ratio = _two_stage_ratio(442 / 140)
    model.rigid_body("lower", mass=1.0)
    model.rigid_body("upper", mass=1.0)
    model.connection("soft", "base", "lower", stiffness=ratio, zeta=0.02)
    model.connection("stiff", "lower", "upper", stiffness=1.0, zeta=0.10)
    modes = model.linearize().modes()
    # By hand: E_1 = k x1², E_2 = (x2 - x1)² of each eigenvector of [[k+1, -1], [-1, 1]]
    for r in range(2):
        lam = (2 * np.pi * modes.frequencies[r]) ** 2
        x1, x2 = 1 - lam, 1.0
        e1, e2 = ratio * x1**2, (x2 - x1) ** 2
        validated(
            f"damping ratio of mode {r + 1} of two stages with 0.02 and 0.10",
            "strain energies of the eigenvectors by hand",
            (0.02 * e1 + 0.10 * e2) / (e1 + e2),
            modes.damping_ratios[r],
            rtol=1e-9,
            against="closed forms",
        )
        assert modes.strain_energy["soft"][r] == pytest.approx(e1 / (e1 + e2), rel=1e-9)


def _two_stage_ratio(wanted):
    """k of [[k+1, -1], [-1, 1]] for which the two natural frequencies have the ratio ``wanted``."""
    trace_squared = (wanted + 1 / wanted) ** 2  # (k+2)²/k = (w1² + w2²)²/(w1 w2)²
    return ((trace_squared - 4) + np.sqrt((trace_squared - 4) ** 2 - 16)) / 2


def test_high_ratio_warns_at_the_users_line():
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=1.0)
    with pytest.warns(ibs.ModelWarning, match="percentage") as caught:
        model.connection("spring", "wall", "m", stiffness=1.0, zeta=2.0)
    assert caught[0].filename == __file__
