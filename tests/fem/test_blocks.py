"""Products of tall blocks, parts of large sparse matrices, work on several threads: against plain NumPy and SciPy."""

import threading

import numpy as np
import pytest
from scipy import sparse

from fem_import import mkl, tall_blocks, threads
from fem_import.sparse_blocks import RowParallel, absolute_product, diagonal_of, principal_submatrix

RANDOM = np.random.default_rng(5)
WAYS = {
    "rows": np.ascontiguousarray,
    "columns": np.asfortranarray,
    "some of more columns": lambda block: np.asfortranarray(np.hstack([block, block]))[:, : block.shape[1]],
    "every second row": lambda block: np.repeat(block, 2, axis=0)[::2],
    "every second entry": lambda block: np.repeat(np.repeat(block, 2, axis=0), 2, axis=1)[::2, ::2],
}


@pytest.fixture(params=["mkl", "numpy"], autouse=True)
def library(request, monkeypatch):
    if request.param == "numpy":
        monkeypatch.setattr(mkl, "library", lambda: None)
    elif not mkl.is_available():
        pytest.skip("the mkl wheel is not installed")


@pytest.mark.parametrize("first", WAYS)
@pytest.mark.parametrize("second", WAYS)
@pytest.mark.parametrize("n", [1, 7, 50_001])
def test_products_do_not_depend_on_how_the_blocks_lie(first, second, n):
    a, b, c = (RANDOM.standard_normal(shape) for shape in ((n, 5), (n, 3), (5, 3)))
    one, other = WAYS[first](a), WAYS[second](b.copy())
    np.testing.assert_allclose(tall_blocks.inner(one, other), a.T @ b, rtol=1e-12, atol=1e-11)
    np.testing.assert_allclose(tall_blocks.combine(one, WAYS[second](c)), a @ c, rtol=1e-12, atol=1e-12)
    tall_blocks.subtract(other, one, WAYS[first](c))
    np.testing.assert_allclose(other, b - a @ c, rtol=1e-12, atol=1e-12)


def test_blocks_without_rows_or_columns():
    assert tall_blocks.inner(np.empty((4, 0)), np.ones((4, 2))).shape == (0, 2)
    np.testing.assert_array_equal(tall_blocks.inner(np.empty((0, 2)), np.empty((0, 3))), np.zeros((2, 3)))
    np.testing.assert_array_equal(tall_blocks.combine(np.empty((4, 0)), np.empty((0, 2))), np.zeros((4, 2)))
    target = np.ones((4, 2))
    tall_blocks.subtract(target, np.empty((4, 0)), np.empty((0, 2)))
    np.testing.assert_array_equal(target, np.ones((4, 2)))


def test_a_block_may_be_combined_in_its_own_place():
    block, coefficients = RANDOM.standard_normal((50_000, 4)), RANDOM.standard_normal((4, 4))
    expected = block @ coefficients
    assert tall_blocks.combine(block, coefficients, out=block) is block
    np.testing.assert_allclose(block, expected, rtol=1e-12, atol=1e-12)


@pytest.fixture(scope="module")
def matrix():
    """Return a symmetric matrix with empty rows and more entries than one thread is given."""
    size, chance = 40_000, np.random.default_rng(1)
    rows, columns = chance.integers(0, size, (2, 500_000))
    used = (rows % 7 != 3) & (columns % 7 != 3)
    values = chance.standard_normal(len(rows))
    half = sparse.coo_array((values[used], (rows[used], columns[used])), shape=(size, size))
    return sparse.csr_array(half + half.T)


def test_parts_and_products_of_a_sparse_matrix(matrix):
    vectors = RANDOM.standard_normal((matrix.shape[1], 3))
    np.testing.assert_allclose(RowParallel(matrix) @ vectors, matrix @ vectors, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(absolute_product(-matrix, abs(vectors[:, 0])), abs(matrix) @ abs(vectors[:, 0]))
    np.testing.assert_array_equal(diagonal_of(matrix), matrix.diagonal())
    rows = np.flatnonzero(RANDOM.random(matrix.shape[0]) < 0.7)
    expected = matrix[rows][:, rows]
    for upper, part in ((False, expected), (True, sparse.triu(expected, format="csr"))):
        found = principal_submatrix(matrix, rows, upper=upper)
        np.testing.assert_array_equal(found.indptr, part.indptr)
        np.testing.assert_array_equal(found.indices, part.indices)
        np.testing.assert_array_equal(found.data, part.data)


@pytest.mark.parametrize("n_threads", [1, 2])
def test_the_second_step_of_one_runs_beside_the_first_of_the_next(monkeypatch, n_threads):
    monkeypatch.setattr(threads, "n_threads", lambda: n_threads)
    second_began = threading.Event()

    def first(number):
        if number == 2 and n_threads > 1:
            assert second_began.wait(10.0)  # for ever, if the steps went one after the other
        return 10 * number

    def then(number):
        second_began.set()
        return number + 1

    assert threads.one_behind_another(first, then, iter([1, 2, 3])) == [11, 21, 31]


@pytest.mark.parametrize("n_threads", [1, 2])
def test_of_two_items_that_fail_the_first_is_told(monkeypatch, n_threads):
    monkeypatch.setattr(threads, "n_threads", lambda: n_threads)

    def fail(text):
        raise ValueError(text)

    with pytest.raises(ValueError, match="K is damaged"):
        threads.one_behind_another(
            lambda name: name if name == "K" else fail("M is cut"), lambda name: fail(f"{name} is damaged"), ["K", "M"]
        )
    with pytest.raises(ValueError, match="M is cut"):
        threads.one_behind_another(lambda name: name if name == "K" else fail("M is cut"), str, ["K", "M"])
