"""M, C, K out of Exudyn against matrices assembled by hand, and the invariants of mechanics."""

import pickle

import numpy as np
import pytest
import scipy.linalg
from analytic import RandomAssembly, lever, random_rotation, scaled_error
from hypothesis import given, settings
from hypothesis import strategies as st

import ibsdyn as ibs

seeds = st.integers(0, 10_000)
few = settings(max_examples=15, deadline=None)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_frequencies_of_ten_random_bodies_are_those_of_the_assembly_by_hand(seed, validated):
    random = RandomAssembly(seed, apart=0.05)
    M, K, _ = random.matrices()
    by_hand = np.sqrt(scipy.linalg.eigh(K[:60, :60], M[:60, :60], eigvals_only=True)) / (2 * np.pi)
    validated(
        f"ten random bodies, springs between distinct points: 60 frequencies (assembly {seed})",
        "NumPy assembly, SciPy eigenvalues",
        by_hand,
        random.model(ibs).linearize().modes().frequencies,
        rtol=1e-9,
        against="calculations by hand",
        unit="Hz",
    )


@few
@given(seeds, st.sampled_from([0.0, 0.05, 1.0]))
def test_ten_random_bodies_equal_the_assembly_by_hand(seed, apart):
    random = RandomAssembly(seed, damper=True, apart=apart)
    system = random.model(ibs).linearize()
    M, K, C = random.matrices()
    n = len(system.coordinates)
    assert n == 60
    assert scaled_error(system.M, M[:n, :n]) < 1e-12
    assert scaled_error(system.K, K[:n, :n]) < 1e-12
    assert scaled_error(system.C, C[:n, :n]) < 1e-9
    scale = np.sqrt(np.outer(np.diag(K)[:n], np.diag(K)[n:]))
    assert np.max(np.abs(system.K_base - K[:n, n:]) / scale) < 1e-12
    scale = np.sqrt(np.outer(np.diag(C)[:n], np.diag(C)[n:]))
    assert np.max(np.abs(system.C_base - C[:n, n:]) / scale) < 1e-9
    assert not system.M_base.any()


@few
@given(seeds)
def test_free_assembly_has_six_rigid_body_modes_and_no_force_in_them(seed):
    random = RandomAssembly(seed, fixed=False, damper=True, apart=0.5)
    system = random.model(ibs).linearize()
    rigid = np.vstack([lever(p) for p in random.cog])  # lever about the origin, carried to each CoG
    scale = np.sqrt(np.diag(system.K))[:, None] * np.linalg.norm(np.sqrt(np.diag(system.K))[:, None] * rigid, axis=0)
    assert np.max(np.abs(system.K @ rigid) / scale) < 1e-12
    assert np.max(np.abs(rigid.T @ system.K).T / scale) < 1e-12
    np.testing.assert_array_equal(system.K, system.K.T)
    modes = system.modes()
    assert modes.rigid.sum() == 6
    assert not modes.frequencies[:6].any()
    assert modes.frequencies[6] > 0
    total = rigid.T @ system.M @ rigid
    np.testing.assert_allclose(total[:3, :3], random.mass.sum() * np.eye(3), rtol=1e-12, atol=1e-12)


@few
@given(seeds)
def test_base_and_bodies_moved_together_strain_nothing(seed):
    random = RandomAssembly(seed, zeta=(0.001, 0.05))
    model = random.model(ibs)
    system = model.linearize()
    motion = model.assembly().rigid_motion()
    n = len(system.coordinates)
    for free, base in ((system.K, system.K_base), (system.C, system.C_base)):
        forces = free @ motion[:n] + base @ motion[n:]
        size = np.abs(free) @ np.abs(motion[:n]) + np.abs(base) @ np.abs(motion[n:])
        assert np.max(np.abs(forces) / size.max(axis=0)) < 1e-9


@few
@given(seeds)
def test_frequencies_and_ratios_do_not_depend_on_the_frame(seed):
    rng = np.random.default_rng(seed)
    random = RandomAssembly(seed, count=4, zeta=(0.001, 0.1), k=(4, 7))
    here = random.model(ibs).linearize().modes()
    there = random.model(ibs, turn=random_rotation(rng), shift=rng.normal(size=3)).linearize().modes()
    np.testing.assert_allclose(there.frequencies, here.frequencies, rtol=1e-9)
    np.testing.assert_allclose(there.damping_ratios, here.damping_ratios, rtol=1e-6)


@few
@given(seeds)
def test_swapping_the_ends_of_connections_changes_nothing(seed):
    random = RandomAssembly(seed, count=4, zeta=(0.001, 0.1))
    one, other = random.model(ibs).linearize(), random.model(ibs, swap=True).linearize()
    assert scaled_error(one.M, other.M) < 1e-12
    assert scaled_error(one.K, other.K) < 1e-12
    assert scaled_error(one.C, other.C) < 1e-8  # through an eigenproblem of stiffnesses over five decades


def test_order_of_components_only_orders_the_coordinates():
    random = RandomAssembly(3, count=5, zeta=0.02)
    one = random.model(ibs).linearize()
    other = random.model(ibs, order=[3, 1, 4, 0, 2]).linearize()
    place = [other.coordinates.index(c) for c in one.coordinates]
    assert scaled_error(other.K[np.ix_(place, place)], one.K) < 1e-12
    assert scaled_error(other.C[np.ix_(place, place)], one.C) < 1e-9


def test_coordinates_are_named_and_results_cannot_be_written_over():
    system = RandomAssembly(0, count=2).model(ibs).linearize()
    assert system.coordinates[:6] == ("b0.x", "b0.y", "b0.z", "b0.rx", "b0.ry", "b0.rz")
    assert system.base_coordinates == tuple(f"ground.{d}" for d in ("x", "y", "z", "rx", "ry", "rz"))
    with pytest.raises(ValueError, match="read-only"):
        system.K[0, 0] = 1.0
    assert "12 free coordinates" in repr(system)


def test_several_fixations_each_have_their_columns():
    model = ibs.Model("two bases")
    model.fixation("left", position=(-1, 0, 0))
    model.fixation("right", position=(1, 0, 0))
    model.rigid_body("bar", mass=2.0, cog=(0, 0, 0), inertia=(0.1, 0.2, 0.2, 0, 0, 0))
    model.connection("l", "left", "bar", position1=(-0.5, 0, 0), stiffness=(1e5, 2e5, 3e5, 0, 0, 0))
    model.connection("r", "right", "bar", position1=(0.5, 0, 0), stiffness=(4e5, 5e5, 6e5, 0, 0, 10.0))
    system = model.linearize()
    assert system.K_base.shape == (6, 12)
    by_name = dict(zip(system.base_coordinates, system.K_base.T, strict=True))
    assert by_name["left.x"][0] == pytest.approx(-1e5)
    assert by_name["right.z"][2] == pytest.approx(-6e5)
    # right.rz turns about (1, 0, 0): at x = 0.5 that moves the spring's end by -0.5 along y
    assert by_name["right.rz"][1] == pytest.approx(0.5 * 5e5)


def test_a_hundred_bodies_are_linearised_sparsely_and_right():
    random = RandomAssembly(1, count=100)
    system = random.model(ibs).linearize()
    M, K, _ = random.matrices()
    assert scaled_error(system.K, K[:600, :600]) < 1e-12
    assert scaled_error(system.M, M[:600, :600]) < 1e-12


def test_the_table_of_modes_writes_kilohertz_without_powers_of_ten():
    model = ibs.Model("stiff", axis="x")
    model.fixation("floor")
    model.rigid_body("box", mass=1.0)
    model.connection("spring", "floor", "box", stiffness=(2 * np.pi * 12345.0) ** 2, zeta=0.01)
    assert " 12340 " in str(model.linearize().modes())


def test_a_system_and_its_modes_travel_between_processes():
    """Also once modes and energies have been asked for, which are kept."""
    system = RandomAssembly(2, apart=0.05).model(ibs).linearize()
    modes = system.modes()
    assert modes.kinetic_energy
    there = pickle.loads(pickle.dumps(system))
    np.testing.assert_array_equal(there.K, system.K)
    np.testing.assert_array_equal(there.modes().frequencies, modes.frequencies)
    assert list(there.modes().strain_energy) == list(modes.strain_energy)
    for name, shares in modes.kinetic_energy.items():
        np.testing.assert_array_equal(there.modes().kinetic_energy[name], shares)
    with pytest.raises(TypeError):
        there.modes().strain_energy["k"] = 0.0
