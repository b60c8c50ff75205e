"""The sparse solver and what stands on it: against dense algebra, with and without the optional wheels."""

import importlib
import os

import numpy as np
import pytest
from own_fe import brick_block, flexure_block, frequencies
from scipy import sparse
from scipy.linalg import eigh

import fem_import as fi
from fem_import import factorization, mkl, ordering, pardiso
from fem_import.factorization import factorize
from fem_import.sparse_blocks import RowParallel, absolute_product, principal_submatrix
from fem_import.threads import one_blas_thread

FLEXURE = flexure_block()
ENDS = {"base": "LEFT", "tip": "RIGHT"}
SOLVERS = ["pardiso", "superlu", "superlu without pymetis", "pardiso without pymetis", "pardiso in single precision"]


@pytest.fixture(scope="module")
def flexure():
    return fi.FEModel.from_arrays(**FLEXURE.arrays)


@pytest.fixture(params=SOLVERS)
def solver(request, monkeypatch):
    """Each solver a platform may have, by hiding the wheels it has not."""
    if request.param.startswith("pardiso") and not mkl.is_available():
        pytest.skip("the mkl wheel is not installed")
    if request.param.startswith("superlu"):
        monkeypatch.setattr(mkl, "is_available", lambda: False)
    if "single" in request.param:
        monkeypatch.setattr(factorization, "_SHARE_IN_DOUBLE", 0.0)
    if "without" in request.param:
        monkeypatch.setattr(ordering, "pymetis", None)
    elif ordering.pymetis is None:
        pytest.skip("pymetis is not installed")
    return request.param


def held(model):
    """K and M with both ends held, by dense indexing."""
    inner = ~np.isin(model.dofs[:, 0], np.concatenate([model.node_sets["LEFT"], model.node_sets["RIGHT"]]))
    return model.K.toarray()[np.ix_(inner, inner)], model.M.toarray()[np.ix_(inner, inner)]


def test_solves_are_those_of_dense_algebra(solver):
    K, _ = held(FLEXURE)
    loads = np.random.default_rng(3).standard_normal((len(K), 5))
    expected = np.linalg.solve(K, loads)
    for given in (sparse.csr_array(K), sparse.csr_array(np.triu(K))):
        factor = factorize(given)
        np.testing.assert_allclose(factor.solve(loads), expected, rtol=1e-8, atol=1e-10 * abs(expected).max())
        assert solver.split()[0] in factor.solver.casefold()
        assert ("METIS on nodes" in factor.solver) == (solver == "superlu")
        assert ("in single precision" in factor.solver) == ("single" in solver)


def test_the_reduction_is_the_same_with_every_solver(flexure, solver, held_eigenvalues):
    body = fi.reduce(flexure, ENDS, 60e3)
    assert solver.split()[0] in body.solver.casefold()
    assert ("METIS on nodes" in body.solver) == ("without" not in solver)
    exact = np.sqrt(held_eigenvalues) / (2 * np.pi)
    plain = fi.reduce(flexure, ENDS, 60e3, inertia_vectors=False)
    np.testing.assert_allclose(plain.frequencies, exact[exact < 60e3], rtol=1e-8)


@pytest.fixture(scope="module")
def held_eigenvalues():
    with one_blas_thread():
        return eigh(*held(FLEXURE), eigvals_only=True)


@pytest.mark.parametrize("offset", [0.5, 7.5, 30.5])
def test_the_count_of_negative_eigenvalues_is_that_of_dense_algebra(solver, held_eigenvalues, offset):
    K, M = held(FLEXURE)
    values = held_eigenvalues
    sigma = np.interp(offset, np.arange(len(values)), values)
    factor = factorize(sparse.csr_array(K - sigma * M), definite=False)
    assert factor.n_negative in (int(offset) + 1, None)
    assert factor.n_negative is not None or "superlu" in solver


@pytest.mark.parametrize("tie", ["rigid", "average"])
def test_the_sturm_count_finds_a_missing_mode(flexure, tie, monkeypatch):
    body = fi.reduce(flexure, ENDS, 60e3, tie=tie)
    assert fi.mode_check(flexure, body, n_modes=5).missed == 0
    mode_check = importlib.import_module("fem_import.mode_check")
    complete = mode_check.lowest_modes

    def forgetful(*arguments):
        values, shapes = complete(*arguments)
        kept = np.arange(len(values)) != 8
        return values[kept], shapes[:, kept]

    monkeypatch.setattr(mode_check, "lowest_modes", forgetful)
    short = fi.mode_check(flexure, body, n_modes=4)
    assert short.missed == 1
    assert "1 modes are missing" in str(short)


def test_singular_and_indefinite_matrices_are_refused(solver, held_eigenvalues):
    free = FLEXURE.K
    with pytest.raises(fi.ReductionError, match="singular or not positive definite"):
        factorize(free)
    K, M = held(FLEXURE)
    sigma = 1.5 * held_eigenvalues[0]
    indefinite = sparse.csr_array(K - sigma * M)
    if solver.startswith("pardiso"):
        with pytest.raises(fi.ReductionError, match="a pivot is zero or negative"):
            factorize(indefinite)


@pytest.mark.skipif(not mkl.is_available(), reason="the mkl wheel is not installed")
def test_a_part_that_does_not_fit_is_refused_with_both_sizes(flexure, monkeypatch):
    monkeypatch.setattr(factorization, "physical_memory", lambda: 1e5)
    with pytest.raises(fi.ReductionError, match=r"even in single precision: 0\.00\d+ GB of 0\.0001 GB"):
        fi.reduce(flexure, ENDS, 60e3)


@pytest.mark.skipif(not mkl.is_available(), reason="the mkl wheel is not installed")
def test_a_slender_part_too_ill_conditioned_for_single_precision_is_factored_in_double(monkeypatch):
    """Its Cholesky factor breaks down in single precision though the part is whole; 0.7 of the memory is enough."""
    wire = brick_block((200, 1, 1), (1.0, 0.002, 0.002))
    part = fi.FEModel.from_arrays(**wire.arrays)
    expected = fi.reduce(part, {"left": "LEFT"}, 100.0)
    sizes = []

    class Factor(pardiso.PardisoFactor):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            sizes.append(self.n_bytes)

    with monkeypatch.context() as spied:
        spied.setattr(factorization, "PardisoFactor", Factor)
        fi.reduce(part, {"left": "LEFT"}, 100.0)
    monkeypatch.setattr(factorization, "physical_memory", lambda: sizes[0] / 0.6)
    body = fi.reduce(part, {"left": "LEFT"}, 100.0)
    assert "single" not in body.solver
    np.testing.assert_array_equal(body.K, expected.K)
    monkeypatch.setattr(factorization, "physical_memory", lambda: sizes[0] / 0.8)
    with pytest.raises(fi.ReductionError, match="too ill-conditioned for a factor in single precision"):
        fi.reduce(part, {"left": "LEFT"}, 100.0)


def test_the_memory_of_this_machine_is_known():
    assert 2**28 < factorization.physical_memory() < 2**50


@pytest.mark.skipif(not mkl.is_available(), reason="the mkl wheel is not installed")
def test_64_bit_indices_solve_the_same(monkeypatch):
    K, _ = held(FLEXURE)
    loads = np.random.default_rng(3).standard_normal((len(K), 12))
    narrow = factorize(sparse.csr_array(K)).solve(loads)
    monkeypatch.setattr(pardiso, "_MOST_ENTRIES_OF_32_BITS", 10)
    wide = factorize(sparse.csr_array(K))
    assert wide._factor._integer == np.int64
    np.testing.assert_allclose(wide.solve(loads), narrow, rtol=1e-9, atol=1e-12 * abs(narrow).max())


@pytest.mark.skipif(ordering.pymetis is None, reason="pymetis is not installed")
def test_the_order_is_a_permutation_that_keeps_the_rows_of_a_node_together():
    node_of_row = np.repeat(np.arange(len(FLEXURE.positions)), 3)
    graph = ordering.node_graph(FLEXURE.K, node_of_row)
    coupled = abs(FLEXURE.K).toarray().reshape(len(node_of_row) // 3, 3, -1, 3).max(axis=(1, 3)) > 0
    np.testing.assert_array_equal(graph.toarray(), coupled)
    np.testing.assert_array_equal(
        ordering.node_graph(sparse.csr_array(sparse.triu(FLEXURE.K)), node_of_row).toarray(), coupled
    )
    order = ordering.elimination_order(graph, node_of_row)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(node_of_row)))
    nodes = node_of_row[order].reshape(-1, 3)
    assert np.all(nodes == nodes[:, :1])


def test_blocks_of_sparse_matrices(monkeypatch):
    from fem_import import sparse_blocks

    monkeypatch.setattr(sparse_blocks, "_WORTH_A_THREAD", 100)
    monkeypatch.setattr(sparse_blocks, "_ROWS_AT_ONCE", 7)
    monkeypatch.setattr(sparse_blocks, "n_threads", lambda: 3)
    random = np.random.default_rng(5)
    block = random.standard_normal((FLEXURE.K.shape[1], 4))
    product = RowParallel(FLEXURE.K)
    assert len(product._parts) == 3
    np.testing.assert_array_equal(product @ block, FLEXURE.K @ block)
    np.testing.assert_array_equal(product @ np.asfortranarray(block), FLEXURE.K @ block)
    np.testing.assert_allclose(absolute_product(FLEXURE.K, abs(block[:, 0])), abs(FLEXURE.K) @ abs(block[:, 0]))
    rows = np.sort(random.choice(len(block), len(block) // 2, replace=False))
    expected = FLEXURE.K.toarray()[np.ix_(rows, rows)]
    np.testing.assert_array_equal(principal_submatrix(FLEXURE.K, rows).toarray(), expected)
    np.testing.assert_array_equal(principal_submatrix(FLEXURE.K, rows, upper=True).toarray(), np.triu(expected))
    assert principal_submatrix(FLEXURE.K, np.empty(0, dtype=np.int64)).shape == (0, 0)


@pytest.mark.parametrize("inertia_vectors", [True, False])
@pytest.mark.parametrize("tie", ["rigid", "average"])
def test_the_error_estimate_is_the_error(tie, inertia_vectors):
    """df/f of a free part against its full model, up to half of where the basis ends."""
    block = brick_block((9, 4, 3), (0.09, 0.03, 0.02))
    part = fi.FEModel.from_arrays(**block.arrays)
    body = fi.reduce(part, ENDS, 90e3, tie=tie, inertia_vectors=inertia_vectors)
    with one_blas_thread():
        values, shapes = eigh(body.K, body.M)
    reduced = np.sqrt(values[6:]) / (2 * np.pi)
    L = np.eye(len(block.dofs))
    if tie == "rigid":
        inner = ~np.isin(block.dofs[:, 0], np.concatenate(list(block.node_sets.values())))
        L = np.hstack([L[:, inner], body.basis[:, :12]])
    full = frequencies(L.T @ block.K @ L, L.T @ block.M @ L)[6:]
    judged = reduced < 0.5 * 90e3
    judged &= reduced / full[: len(reduced)] - 1 > 1e-9  # smaller ones are rounding of the dense solution
    assert np.count_nonzero(judged) >= 4
    estimate = body.reduction_errors(reduced, shapes[:, 6:])[judged]
    true = (reduced / full[: len(reduced)] - 1)[judged]
    np.testing.assert_allclose(estimate, true, rtol=0.15)


def test_work_side_by_side_keeps_its_order_and_nests(monkeypatch):
    from fem_import import threads

    monkeypatch.setattr(threads, "n_threads", lambda: 3)
    threads._workers.cache_clear()
    try:

        def nested(item):
            return sum(threads.side_by_side(lambda k: item * k, range(5)))

        assert threads.side_by_side(nested, range(8)) == [10 * item for item in range(8)]

        def failing(item):
            if item in (2, 5):
                raise ValueError(f"item {item}")
            return item

        with pytest.raises(ValueError, match="item 2"):
            threads.side_by_side(failing, range(8))
        if hasattr(os, "fork"):
            child = os.fork()
            if child == 0:  # a forked process has none of the threads
                os._exit(0 if threads.side_by_side(abs, [-1, -2, -3]) == [1, 2, 3] else 1)
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    finally:
        threads._workers.cache_clear()
