"""Products of tall, narrow blocks on all cores: by MKL, else by NumPy with a range of rows on each core.

Memory limits them, not arithmetic: a BLAS that splits the few columns among its threads gains nothing. To be called
with NumPy's BLAS on one thread (`threads.one_blas_thread`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from fem_import import mkl
from fem_import.threads import n_threads, side_by_side

FloatArray: TypeAlias = NDArray[np.float64]
Result = TypeVar("Result")

_WORTH_A_THREAD = 20_000  # rows
_ROWS_AT_ONCE = 4096  # the narrow block's share then stays in the cache while the tall one streams past


def inner(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return first^T second (k, m) of blocks (n, k) and (n, m)."""
    whole = np.empty((first.shape[1], second.shape[1]))
    if mkl.add_product(whole, first.T, second, 1.0, 0.0):
        return whole

    def partial(start: int, end: int) -> FloatArray:
        total = np.zeros((second.shape[1], first.shape[1]))
        for row in range(start, end, _ROWS_AT_ONCE):
            last = min(row + _ROWS_AT_ONCE, end)
            total += second[row:last].T @ first[row:last]  # the narrow one first takes a fifth less time
        return np.asarray(total.T)

    total, *others = _by_rows(len(first), partial)
    for other in others:
        total += other
    return total


def combine(block: FloatArray, coefficients: FloatArray, out: FloatArray | None = None) -> FloatArray:
    """Return block @ coefficients (n, m); written to `out` where it is given, which may be the block itself."""
    product = np.empty((len(block), coefficients.shape[1])) if out is None else out
    if out is not block and mkl.add_product(product, block, coefficients, 1.0, 0.0):
        return product

    def some(start: int, end: int) -> None:
        for row in range(start, end, _ROWS_AT_ONCE):
            last = min(row + _ROWS_AT_ONCE, end)
            product[row:last] = block[row:last] @ coefficients

    _by_rows(len(block), some)
    return product


def subtract(target: FloatArray, block: FloatArray, coefficients: FloatArray) -> None:
    """Take block @ coefficients from the target (n, m), in place."""
    if mkl.add_product(target, block, coefficients, -1.0, 1.0):
        return

    def some(start: int, end: int) -> None:
        for row in range(start, end, _ROWS_AT_ONCE):
            last = min(row + _ROWS_AT_ONCE, end)
            target[row:last] -= block[row:last] @ coefficients

    _by_rows(len(block), some)


def put(target: FloatArray, block: FloatArray) -> None:
    """Copy a block (n, k) to a place of its size; the first touch of fresh memory costs more than the copy."""

    def some(start: int, end: int) -> None:
        target[start:end] = block[start:end]

    _by_rows(len(block), some)


def in_rows(block: FloatArray) -> FloatArray:
    """Return a block (n, k) in row order, as sparse products want it; itself if it is so already."""
    return block if block.flags.c_contiguous else _copied(block, "C")


def in_columns(block: FloatArray) -> FloatArray:
    """Return a block (n, k) in column order, as direct solvers want it; itself if it is so already."""
    return block if block.flags.f_contiguous else _copied(block, "F")


def _copied(block: FloatArray, order: Literal["C", "F"]) -> FloatArray:
    copy = np.empty(block.shape, dtype=block.dtype, order=order)

    def some(start: int, end: int) -> None:
        for row in range(start, end, _ROWS_AT_ONCE):
            last = min(row + _ROWS_AT_ONCE, end)
            copy[row:last] = block[row:last]

    _by_rows(len(block), some)
    return copy


def _by_rows(n_rows: int, work: Callable[[int, int], Result]) -> list[Result]:
    """Return what the work gives for ranges that cover all rows, in their order."""
    count = max(1, min(n_threads(), n_rows // _WORTH_A_THREAD))
    limits = [n_rows * index // count for index in range(count + 1)]
    ranges = list(itertools.pairwise(limits))
    return side_by_side(lambda limits: work(*limits), ranges)
