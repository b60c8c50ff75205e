"""FEModel.from_arrays: what it gives, what it refuses; the report against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from own_fe import brick_block, euler_beam, frequencies
from scipy import sparse
from scipy.spatial.transform import Rotation

import fem_import as fi

BLOCK = brick_block((4, 2, 2), (0.04, 0.012, 0.02), origin=(0.1, -0.2, 0.3))
BEAM = euler_beam(2.0, 6, 2e11, 8e10, 7850.0, 1e-2, 1e-5, 2e-5)


def test_report_gives_the_closed_forms_of_a_block():
    report = fi.FEModel.from_arrays(**BLOCK.arrays).report()
    a, b, c = 0.04, 0.012, 0.02
    mass = 7850.0 * a * b * c
    np.testing.assert_allclose(report.mass_per_axis, mass, rtol=1e-12)
    np.testing.assert_allclose(report.centre_of_mass, [0.12, -0.194, 0.31], rtol=1e-12)
    # A consistent mass matrix integrates linear fields exactly, so even a coarse mesh gives the exact inertia.
    np.testing.assert_allclose(
        report.inertia, mass / 12 * np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2]), rtol=1e-9, atol=1e-15
    )
    assert report.is_free
    assert report.rigid_body_residual.max() < 1e-12
    assert report.findings == ()
    for words in ("kg", "centre of gravity", "LEFT", "free"):
        assert words in str(report)


def test_a_held_part_says_so():
    kept = np.flatnonzero(~np.isin(BLOCK.dofs[:, 0], BLOCK.node_sets["LEFT"]))
    part = fi.FEModel.from_arrays(BLOCK.K[kept][:, kept], BLOCK.M[kept][:, kept], BLOCK.positions, BLOCK.dofs[kept])
    report = part.report()
    assert report.support == "held"
    assert not report.is_free
    assert "held to ground" in report.findings[0]


def test_soft_springs_to_ground_are_not_taken_for_free():
    soft = BLOCK.K + sparse.diags_array(1e-7 * BLOCK.K.diagonal())
    report = fi.FEModel.from_arrays(**{**BLOCK.arrays, "K": soft}).report()
    assert report.support == "unclear"
    assert "Soft springs" in report.findings[0]


@pytest.mark.parametrize(
    ("units", "length", "force"),
    [("mm-t-s", 1e-3, 1.0), ("mm-kg-s", 1e-3, 1e-3), ("in-lbf-s", 0.0254, 4.4482216152605)],
)
def test_units_convert_translations_and_rotations(units, length, force):
    """The same beam, assembled in the other system: numbers in must give SI out, in every block of K and M."""
    mass = force / length
    other = euler_beam(
        2.0 / length,
        6,
        2e11 / force * length**2,
        8e10 / force * length**2,
        7850.0 / mass * length**3,
        1e-2 / length**2,
        1e-5 / length**4,
        2e-5 / length**4,
    )
    here = fi.FEModel.from_arrays(**BEAM.arrays)
    there = fi.FEModel.from_arrays(**other.arrays, C=1e-4 * other.K, units=units)
    for name, factor in (("K", 1.0), ("M", 1.0)):
        ours, theirs = getattr(here, name).toarray(), getattr(there, name).toarray()
        np.testing.assert_allclose(
            theirs, ours * factor, rtol=1e-9, atol=1e-9 * abs(ours).min(where=ours != 0, initial=1)
        )
    np.testing.assert_allclose(there.C.toarray(), 1e-4 * here.K.toarray(), rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(there.positions, here.positions)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_frequencies_and_mass_do_not_depend_on_the_frame(seed):
    random = np.random.default_rng(seed)
    turn = Rotation.random(random_state=random).as_matrix()
    block = brick_block((2, 1, 1), (0.04, 0.012, 0.02))
    spin = sparse.kron(sparse.eye_array(len(block.positions)), turn)
    part = fi.FEModel.from_arrays(
        spin @ block.K @ spin.T, spin @ block.M @ spin.T, block.positions @ turn.T + random.standard_normal(3), dofs=3
    )
    report, plain = part.report(), fi.FEModel.from_arrays(**block.arrays).report()
    assert abs(part.K - part.K.T).max() == 0.0
    assert report.is_free
    assert report.mass == pytest.approx(plain.mass, rel=1e-9)
    np.testing.assert_allclose(
        turn.T @ report.inertia @ turn, plain.inertia, rtol=1e-6, atol=1e-9 * plain.inertia.max()
    )
    np.testing.assert_allclose(frequencies(part.K, part.M)[6:], frequencies(block.K, block.M)[6:], rtol=1e-9)


def change(name, value):
    return {**BLOCK.arrays, name: value}


def with_entry(matrix, row, column, value):
    changed = matrix.tolil()
    changed[row, column] = value
    return changed.tocsr()


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        (change("K", sparse.triu(BLOCK.K)), "only its upper triangle"),
        (change("M", sparse.tril(BLOCK.M)), "only its lower triangle"),
        (change("K", with_entry(BLOCK.K, 0, 1, 1e9)), "K is not symmetric.*nodes 1 and 1|not positive semi-definite"),
        (change("K", with_entry(BLOCK.K, 3, 4, np.nan)), r"K\[3, 4\] is nan"),
        (change("K", with_entry(BLOCK.K, 4, 4, 1e36)), "penalty.*Remove|row 4 .*penalty"),
        (change("M", with_entry(BLOCK.M, 4, 4, 1e36)), "penalty"),
        (change("M", with_entry(BLOCK.M, 4, 4, -1.0)), "row 4 .node 2, direction 2.*negative"),
        (change("M", BLOCK.M[:9, :9]), r"M is \(9, 9\)"),
        (change("M", None), "M is missing"),
        (change("M", 0 * BLOCK.M), "density"),
        (change("K", "text"), "sparse or dense"),
        (change("positions", BLOCK.positions[:, :2]), r"\(n_nodes, 3\)"),
        (change("positions", BLOCK.positions * np.inf), "not finite"),
        (change("dofs", np.vstack([BLOCK.dofs[1:2], BLOCK.dofs[1:]])), r"1\.2 .node\.direction. occurs 2 times"),
        (change("dofs", BLOCK.dofs + [0, 4]), "direction 7"),
        (change("dofs", BLOCK.dofs + [500, 0]), "no position"),
        (change("dofs", BLOCK.dofs + 0.5), "whole numbers"),
        (change("dofs", 4), "3 or 6"),
        (change("node_sets", {"A": [1, 999]}), "'A' names node 999"),
        ({**BLOCK.arrays, "node_ids": np.ones(len(BLOCK.positions), int)}, "unique"),
        ({**BLOCK.arrays, "node_ids": [1, 2]}, "one label for each"),
    ],
)
def test_bad_arrays_are_refused_in_words(arrays, words):
    with pytest.raises(fi.ExportError, match=words):
        fi.FEModel.from_arrays(**arrays)


def test_null_rows_name_the_degree_of_freedom():
    n = len(BLOCK.dofs)
    hole = sparse.diags_array(np.where(np.arange(n) == 7, 0.0, 1.0))
    with pytest.raises(fi.ExportError, match=r"1 rows, first row 7 \(node 3, direction 2\)"):
        fi.FEModel.from_arrays(**change("K", hole @ BLOCK.K @ hole))


def test_dense_arrays_and_rounding_asymmetry_are_accepted():
    noisy = BLOCK.K.toarray()
    noisy[0, 1] *= 1 + 1e-8
    part = fi.FEModel.from_arrays(**{**BLOCK.arrays, "K": noisy, "M": BLOCK.M.toarray()})
    assert 0 < part.symmetry_residual < 1e-7
    assert "unsymmetric" in part.report().findings[-1]


def test_unknown_names_answer_with_the_nearest():
    part = fi.FEModel.from_arrays(**BLOCK.arrays)
    assert part.node_sets["left"] is part.node_sets["LEFT"]
    with pytest.raises(KeyError, match=r"no node set 'RIGTH'. Did you mean 'RIGHT'"):
        part.node_sets["RIGTH"]
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'node_sets'"):
        fi.FEModel.from_arrays(**BLOCK.arrays, node_set={})


def test_the_callers_matrices_stay_as_they_were():
    K, M = BLOCK.K.copy(), BLOCK.M.copy()
    K.data[5] = 0.0  # an explicit zero and its mirror image, which the model drops
    K = sparse.csr_array(0.5 * (K + K.T))
    before = K.toarray()
    fi.FEModel.from_arrays(**{**BLOCK.arrays, "K": K, "M": M})
    np.testing.assert_array_equal(K.toarray(), before)
    np.testing.assert_array_equal(M.toarray(), BLOCK.M.toarray())


def test_arrays_are_frozen():
    part = fi.FEModel.from_arrays(**BLOCK.arrays)
    for array in (part.positions, part.dofs, part.node_ids, part.node_sets["LEFT"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_complex_matrices_and_indices_out_of_range_are_refused():
    eye = np.eye(9)
    with pytest.raises(fi.ExportError, match="complex"):
        fi.FEModel.from_arrays(eye * (1 + 0.01j), eye, np.eye(3), 3)
    broken = sparse.csr_array(eye)
    broken.indices[4] = 77
    with pytest.raises(fi.ExportError, match="K must be"):
        fi.FEModel.from_arrays(broken, eye, np.eye(3), 3)


def test_matrices_may_be_taken_over_or_copied():
    """copy=False and symmetric=True spare time and memory and change nothing of the model; the default keeps yours."""
    before = BLOCK.K.copy()
    model = fi.FEModel.from_arrays(**BLOCK.arrays, units="mm-t-s")
    assert (before != BLOCK.K).nnz == 0
    assert not np.shares_memory(model.K.data, BLOCK.K.data)
    upper = sparse.triu(BLOCK.K)
    K, M = (sparse.csr_array(upper + upper.T - sparse.diags_array(BLOCK.K.diagonal())), BLOCK.M.copy())
    taken = fi.FEModel.from_arrays(
        K, M, BLOCK.positions, 3, node_sets=BLOCK.node_sets, units="mm-t-s", copy=False, symmetric=True
    )
    assert np.shares_memory(taken.K.data, K.data)
    assert abs(taken.K - model.K).max() <= 1e-15 * abs(model.K).max()
    assert abs(taken.M - model.M).max() <= 1e-15 * abs(model.M).max()
