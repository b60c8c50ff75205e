"""reduce(): against the full model, closed forms and the published rotor and FV4 cases."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from own_fe import brick_block, euler_beam, flexure_block, frequencies
from scipy import sparse
from scipy.linalg import eigh, null_space
from scipy.spatial.transform import Rotation

import fem_import as fi

FLEXURE = flexure_block()
ENDS = {"base": "LEFT", "tip": "RIGHT"}


@pytest.fixture(scope="module")
def flexure():
    return fi.FEModel.from_arrays(**FLEXURE.arrays)


def rigid_tie(model, sets, points):
    """L: all DoF per free DoF and rigid frames, written out by hand."""
    tied = np.isin(model.dofs[:, 0], np.concatenate([model.node_sets[name] for name in sets]))
    columns = [sparse.eye_array(len(tied)).tocsc()[:, np.flatnonzero(~tied)].toarray()]
    for name, point in zip(sets, points, strict=True):
        frame = np.zeros((len(tied), 6))
        for node in model.node_sets[name]:
            arm = model.positions[node - 1] - point
            frame[3 * (node - 1) : 3 * node] = np.hstack([np.eye(3), np.cross(np.eye(3), arm).T @ -np.eye(3)])
            for axis in range(3):
                frame[3 * (node - 1) : 3 * node, 3 + axis] = np.cross(np.eye(3)[axis], arm)
        columns.append(frame)
    return np.hstack(columns)


@pytest.mark.parametrize("inertia_vectors", [True, False])
def test_rigid_interfaces_reproduce_the_tied_full_model(flexure, inertia_vectors):
    points = [FLEXURE.positions[FLEXURE.node_sets[name] - 1].mean(axis=0) for name in ("LEFT", "RIGHT")]
    tie = rigid_tie(FLEXURE, ("LEFT", "RIGHT"), points)
    full = frequencies(tie.T @ FLEXURE.K @ tie, tie.T @ FLEXURE.M @ tie)[6:]
    cutoff = 1.8 * full[5]
    body = fi.reduce(flexure, ENDS, cutoff, inertia_vectors=inertia_vectors)
    reduced = frequencies(body.K, body.M)[6:]
    trusted = full < cutoff / 1.5
    assert np.count_nonzero(trusted) >= 5
    np.testing.assert_allclose(reduced[: trusted.sum()], full[trusted], rtol=1e-4 if inertia_vectors else 5e-2)
    assert np.all(reduced[: trusted.sum()] >= full[trusted] * (1 - 1e-9))  # Ritz: from above


def test_average_interfaces_leave_the_part_as_it_is(flexure):
    full = frequencies(FLEXURE.K, FLEXURE.M)[6:]
    body = fi.reduce(flexure, ENDS, 1.8 * full[5], tie="average")
    np.testing.assert_allclose(frequencies(body.K, body.M)[6:11], full[:5], rtol=1e-4)


@pytest.mark.parametrize("tie", ["rigid", "average"])
def test_fixed_interface_modes_and_static_stiffness(flexure, tie):
    """Interior frequencies by dense null spaces, and K of the frames as a dense static condensation."""
    K, M = FLEXURE.K.toarray(), FLEXURE.M.toarray()
    points = [FLEXURE.positions[FLEXURE.node_sets[name] - 1].mean(axis=0) for name in ("LEFT", "RIGHT")]
    body = fi.reduce(flexure, ENDS, 60e3, tie=tie, inertia_vectors=False)
    if tie == "rigid":
        T = rigid_tie(FLEXURE, ("LEFT", "RIGHT"), points)
        n = T.shape[1] - 12
        Kt, Mt = T.T @ K @ T, T.T @ M @ T
        held = frequencies(Kt[:n, :n], Mt[:n, :n])
        static = Kt[n:, n:] - Kt[n:, :n] @ np.linalg.solve(Kt[:n, :n], Kt[:n, n:])
    else:
        A = np.zeros((12, len(K)))
        for index, name in enumerate(("LEFT", "RIGHT")):
            only = rigid_tie(FLEXURE, (name,), points[index : index + 1])[:, -6:]
            A[6 * index : 6 * index + 6] = np.linalg.pinv(only)
        Z = null_space(A)
        held = frequencies(Z.T @ K @ Z, Z.T @ M @ Z)
        particular = np.linalg.pinv(A)
        inner = np.linalg.solve(Z.T @ K @ Z, Z.T @ K @ particular)
        constrained = particular - Z @ inner
        static = constrained.T @ K @ constrained
    below = held[held < 60e3]
    np.testing.assert_allclose(body.frequencies, below, rtol=1e-8)
    np.testing.assert_allclose(body.K[:12, :12], static, rtol=1e-6, atol=1e-7 * np.max(abs(static)))
    np.testing.assert_allclose(body.K[:12, 12:], 0.0)
    np.testing.assert_allclose(body.M[12:, 12:], np.eye(len(below)))


@pytest.mark.parametrize(
    "ties", [("rigid", "rigid"), ("average", "average"), ("rigid", "average"), ("average", "rigid")]
)
def test_rigid_motion_is_exact_in_any_tie(flexure, ties):
    interfaces = {
        "base": fi.Interface("LEFT", tie=ties[0]),
        "tip": fi.Interface("RIGHT", position=(0.05, 0.01, 0.0), tie=ties[1]),
    }
    body = fi.reduce(flexure, interfaces, 60e3)
    motion = body.rigid_body_motion
    full = flexure.rigid_body_motion()
    assert body.is_free
    assert np.max(abs(body.K @ motion)) < 1e-12 * np.max(abs(body.K[:12, :12]))
    np.testing.assert_allclose(motion.T @ body.M @ motion, full.T @ (flexure.M @ full), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(body.basis @ motion, full, atol=1e-9)
    report = flexure.report()
    assert body.mass == report.mass
    np.testing.assert_array_equal(body.inertia, report.inertia)


def test_frf_from_tip_to_tip_is_right_to_a_percent(flexure):
    """Receptance of a free part at its averaged tip, against direct solves of the full model."""
    body = fi.reduce(flexure, ENDS, 60e3, tie="average")
    A = np.linalg.pinv(rigid_tie(FLEXURE, ("RIGHT",), [body.interfaces["tip"].position])[:, -6:])
    K, M = FLEXURE.K.toarray(), FLEXURE.M.toarray()
    for frequency in np.geomspace(200.0, 30e3, 12):
        omega2 = (2 * np.pi * frequency) ** 2
        full = A @ np.linalg.solve(K * (1 + 0.02j) - omega2 * M, A.T)
        reduced = np.linalg.inv(body.K * (1 + 0.02j) - omega2 * body.M)[6:12, 6:12]
        scale = np.sqrt(np.outer(abs(np.diag(full)), abs(np.diag(full))))
        assert np.max(abs(reduced - full) / scale) < 1e-2


def test_the_leaf_spring_holds_its_frequencies_below_the_cut_off(leaf_spring):
    body = fi.reduce(leaf_spring, {"base": "IF_BASE", "tip": "IF_TIP"}, 4000.0, tie="average")
    check = fi.mode_check(leaf_spring, body)
    assert len(check.full) == 6
    assert np.max(abs(check.differences)) < 1e-3
    assert np.max(abs(check.differences[:5])) < 1e-6
    assert np.min(np.diag(check.mac)) > 0.999
    stiff = fi.mode_check(leaf_spring, fi.reduce(leaf_spring, {"base": "IF_BASE", "tip": "IF_TIP"}, 4000.0))
    assert np.max(abs(stiff.differences)) < 1e-3
    assert np.all(stiff.tie_stiffening > -1e-9)
    assert body.mass == pytest.approx(0.22464, rel=1e-9)


def test_a_single_interface_of_a_free_part(flexure):
    body = fi.reduce(flexure, {"base": "LEFT"}, 60e3)
    np.testing.assert_array_equal(body.K[:6, :6], 0.0)
    assert body.is_free


def test_two_runs_agree_bit_for_bit(flexure):
    first, second = (fi.reduce(flexure, ENDS, 60e3, tie="average") for _ in range(2))
    for name in ("M", "K", "basis"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_a_square_bar_has_degenerate_pairs_and_none_is_missed():
    bar = brick_block((6, 2, 2), (0.1, 0.01, 0.01))
    body = fi.reduce(fi.FEModel.from_arrays(**bar.arrays), ENDS, 30e3, inertia_vectors=False)
    inner = ~np.isin(bar.dofs[:, 0], np.concatenate([bar.node_sets["LEFT"], bar.node_sets["RIGHT"]]))
    held = frequencies(bar.K.toarray()[np.ix_(inner, inner)], bar.M.toarray()[np.ix_(inner, inner)])
    np.testing.assert_allclose(body.frequencies, held[held < 30e3], rtol=1e-9)
    assert np.any(np.diff(body.frequencies) < 1e-8 * body.frequencies[:-1])


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6), tie=st.sampled_from(["rigid", "average"]))
def test_a_turned_part_has_the_same_frequencies_mass_and_six_rigid_modes(seed, tie):
    random = np.random.default_rng(seed)
    turn = Rotation.random(random_state=random).as_matrix()
    block = brick_block((4, 1, 2), (0.04, 0.012, 0.02))
    spin = sparse.kron(sparse.eye_array(len(block.positions)), turn)
    moved = fi.FEModel.from_arrays(
        spin @ block.K @ spin.T,
        spin @ block.M @ spin.T,
        block.positions @ turn.T + random.standard_normal(3),
        dofs=3,
        node_sets=block.node_sets,
    )
    plain = fi.reduce(fi.FEModel.from_arrays(**block.arrays), ENDS, 150e3, tie=tie)
    body = fi.reduce(moved, ENDS, 150e3, tie=tie)
    motion = body.rigid_body_motion
    assert np.max(abs(body.K @ motion)) < 1e-10 * np.max(abs(body.K[:12, :12]))
    assert np.max(abs(body.M - body.M.T)) == 0.0
    np.testing.assert_allclose(motion[:, :3].T @ body.M @ motion[:, :3], plain.mass * np.eye(3), atol=1e-9 * plain.mass)
    np.testing.assert_allclose(frequencies(body.K, body.M)[6:16], frequencies(plain.K, plain.M)[6:16], rtol=1e-7)


def test_exported_damping_is_projected(flexure):
    damped = fi.FEModel.from_arrays(**FLEXURE.arrays, C=1e-6 * FLEXURE.K)
    body = fi.reduce(damped, ENDS, 60e3)
    np.testing.assert_allclose(body.C, 1e-6 * body.K, rtol=1e-6, atol=1e-9 * np.max(abs(body.K)) * 1e-6)
    assert fi.reduce(flexure, ENDS, 60e3).C is None


def test_fv4_cantilever_with_masses_off_its_tip():
    """NAFEMS FV4 (case 07): Euler beam clamped in the export, one tip interface, two masses on rigid arms."""
    area, inertia = np.pi * 0.25**2, np.pi * 0.25**4 / 4
    beam = euler_beam(10.0, 24, 2e11, 2e11 / 2.6, 8000.0, area, inertia, 2 * inertia)
    kept = np.flatnonzero(beam.dofs[:, 0] != 1)
    part = fi.FEModel.from_arrays(
        beam.K[kept][:, kept], beam.M[kept][:, kept], beam.positions, beam.dofs[kept], node_sets=beam.node_sets
    )
    with pytest.warns(fi.ExportWarning, match="fixed to ground"):
        body = fi.reduce(part, {"tip": "TIP"}, max_frequency=300.0)
    assert not body.is_free
    assert len(body.frequencies) >= 6
    M = np.array(body.M)
    for mass, y in ((10000.0, 2.0), (1000.0, -2.0)):
        arm = np.hstack([np.eye(3), [[0, 0, -y], [0, 0, 0], [y, 0, 0]]])  # u + theta x (0, y, 0)
        M[:6, :6] += mass * arm.T @ arm
    found = np.sqrt(eigh(body.K, M, eigvals_only=True))[:6] / (2 * np.pi)
    np.testing.assert_allclose(found, [1.723, 1.727, 7.413, 9.972, 18.155, 26.957], rtol=5e-4)


def test_the_published_rotor_on_springs(shared, validated):
    """Case 09: frequencies on springs at averaged and rigid interfaces, K unscaled, 20 modes and more."""
    folder = shared / "data" / "rotor"
    table = np.loadtxt(folder / "rotorDiscTestSTIF1.mtx")
    n = int(table[:, 0].max())
    read = [np.loadtxt(folder / f"rotorDiscTest{kind}1.mtx") for kind in ("STIF", "MASS")]
    K, M = (
        sparse.coo_array((t[:, 2], (t[:, 0].astype(int) - 1, t[:, 1].astype(int) - 1)), shape=(n, n)).tocsr()
        for t in read
    )
    deck = (folder / "rotorDiscTest.inp").read_text().split("*Node")[1].split("*Element")[0]
    rows = [line.split(",") for line in deck.splitlines()[1:] if line.count(",") == 3]
    positions = np.array([[float(word) for word in row[1:]] for row in rows])
    part = fi.FEModel.from_arrays(K, M, positions, dofs=3)
    assert part.report().mass == pytest.approx(77.96605, rel=1e-6)
    bottom = part.node_ids[abs(positions[:, 2]) < 1e-9]
    top = part.node_ids[abs(positions[:, 2] - 0.5) < 1e-9]
    assert (len(bottom), len(top)) == (9, 9)
    expected = {
        "average": [252.7166, 311.1018, 311.1018, 568.8229, 568.8229, 1225.9215, 1225.9215, 1878.2409],
        "rigid": [253.0184, 311.2793, 311.2793, 569.1614, 569.1614, 1226.5024, 1226.5024, 1878.2413],
    }
    for tie, reference in expected.items():
        body = fi.reduce(part, {"low": bottom, "high": top}, max_frequency=7000.0, tie=tie)
        stiffness = np.array(body.K)
        for row in (0, 1, 2, 6, 7):
            stiffness[row, row] += 2e8
        found = np.sqrt(np.maximum(eigh(stiffness, body.M, eigvals_only=True), 0))[1:9] / (2 * np.pi)
        validated(
            f"rotor on springs, Craig-Bampton with {tie} interfaces",
            "Exudyn's test models: the rotor exported by Abaqus",
            reference,
            found,
            rtol=1e-4,
            against="other programs",
            unit="Hz",
        )


def test_a_low_cut_off_warns_with_a_figure(flexure):
    free = frequencies(FLEXURE.K, FLEXURE.M)[6]
    with pytest.warns(fi.ExportWarning, match=r"too low.*1 % rule.*Ask for at least") as caught:
        fi.reduce(flexure, ENDS, 0.9 * free)
    assert caught[0].filename == __file__


def test_a_cut_off_without_a_held_mode_warns():
    # Stiff ends of a thin leaf: the first free mode lies far below the first held one of a massless middle.
    block = flexure_block()
    held_first = fi.reduce(fi.FEModel.from_arrays(**block.arrays), ENDS, 60e3).frequencies[0]
    free_first = frequencies(block.K, block.M)[6]
    assert 1.5 * free_first < held_first
    with pytest.warns(fi.ExportWarning, match="keeps no mode.*held; the first is at"):
        fi.reduce(fi.FEModel.from_arrays(**block.arrays), ENDS, 0.5 * (1.5 * free_first + held_first))


@pytest.mark.filterwarnings("error")
def test_a_sensible_cut_off_is_silent(flexure):
    fi.reduce(flexure, ENDS, 60e3)


@pytest.mark.parametrize("frequency", [0, -1.0, np.inf, np.nan, "2 kHz", True, None])
def test_bad_cut_offs(flexure, frequency):
    with pytest.raises(fi.ReductionError, match="max_frequency must be a positive number"):
        fi.reduce(flexure, ENDS, frequency)


def test_unknown_words_name_the_nearest(flexure):
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'craig-bampton'"):
        fi.reduce(flexure, ENDS, 1e4, method="craig bampton")
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'average'"):
        fi.reduce(flexure, ENDS, 1e4, tie="averaged")
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'max_frequency'"):
        fi.reduce(flexure, ENDS, 1e4, max_freq=3)
    with pytest.raises(fi.ReductionError, match=r"must be a fi\.FEModel"):
        fi.reduce("job.inp", ENDS, 1e4)


@pytest.mark.parametrize("tie", ["rigid", "average"])
def test_a_loose_piece_is_refused(tie):
    def keep(centre):
        return (centre[:, 0] < 0.02) | (centre[:, 0] > 0.03)

    pieces = brick_block((5, 1, 1), (0.05, 0.01, 0.01), keep=keep)
    part = fi.FEModel.from_arrays(**pieces.arrays)
    with pytest.raises(fi.ReductionError, match=r"2 pieces.*loose"):
        fi.reduce(part, {"base": "LEFT"}, 1e4, tie=tie)


@pytest.mark.parametrize("tie", ["rigid", "average"])
def test_two_bodies_in_one_export_are_refused_unless_an_interface_joins_them(tie):
    block = brick_block((2, 1, 1), (0.02, 0.01, 0.01))
    n, left, right = len(block.positions), block.node_sets["LEFT"], block.node_sets["RIGHT"]
    K, M = (sparse.csr_array(sparse.block_diag([matrix, matrix])) for matrix in (block.K, block.M))
    both = fi.FEModel.from_arrays(K, M, np.vstack([block.positions, block.positions + (0.1, 0, 0)]), 3, units="SI")
    for ends in (
        {"a": left, "b": right + n},
        {"a": left, "b": right, "c": right + n},
        {"a": np.arange(1, n + 1), "b": right + n},
    ):
        with pytest.raises(fi.ReductionError, match="is 2 bodies that nothing joins: interface 'a' is on one and"):
            fi.reduce(both, ends, 300e3, tie=tie)
    joined = fi.reduce(both, {"ab": fi.Interface(np.concatenate([right, left + n]), tie="rigid")}, 300e3)
    found = frequencies(joined.K, joined.M)
    assert np.count_nonzero(found < 1.0) == 6


def test_everything_rigid_leaves_no_interior():
    block = brick_block((1, 1, 1), (0.01, 0.01, 0.01))
    body = fi.reduce(fi.FEModel.from_arrays(**block.arrays), {"all": np.arange(1, 9)}, 1e4)
    assert body.M.shape == (6, 6)
    assert len(body.frequencies) == 0


def test_inertia_integrals_are_those_of_the_nodal_sums(flexure):
    body = fi.reduce(flexure, ENDS, 60e3)
    integrals = body.inertia_integrals
    m = FLEXURE.M.toarray()[::3, ::3]
    x = FLEXURE.positions
    psi = body.basis.reshape(len(x), 3, -1)
    assert integrals.mass == pytest.approx(m.sum())
    np.testing.assert_allclose(integrals.first_moment, np.einsum("ab,bk->k", m, x))
    np.testing.assert_allclose(integrals.second_moment, np.einsum("ab,ak,bl->kl", m, x, x), atol=1e-18)
    np.testing.assert_allclose(integrals.translation, np.einsum("ab,bkj->kj", m, psi), atol=1e-12)
    np.testing.assert_allclose(integrals.rotation, np.einsum("ab,ak,blj->klj", m, x, psi, optimize=True), atol=1e-12)
    np.testing.assert_allclose(
        integrals.flexible, np.einsum("ab,aki,blj->klij", m, psi, psi, optimize=True), atol=1e-10
    )
    beam = euler_beam(1.0, 4, 2e11, 8e10, 7850.0, 1e-2, 1e-5, 2e-5)
    part = fi.FEModel.from_arrays(**beam.arrays)
    assert fi.reduce(part, {"tip": "TIP"}, 1e4).inertia_integrals is None
