"""How many threads the work of this package takes."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager
from typing import TypeVar

from threadpoolctl import ThreadpoolController

_Item = TypeVar("_Item")
_Between = TypeVar("_Between")
_Result = TypeVar("_Result")


@functools.cache
def n_threads() -> int:
    """Return OMP_NUM_THREADS where it is set, else the number of cores this process may run on."""
    asked = os.environ.get("OMP_NUM_THREADS", "")
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def side_by_side(function: Callable[[_Item], _Result], items: Iterable[_Item]) -> list[_Result]:
    """Apply a function to few large items on as many threads as there are: NumPy and SciPy let go of Python's lock.

    The first item is this thread's own; calls from within the others go one after the other. Raises what the function
    raised for the first item that failed, when all have ended.
    """
    listed = list(items)
    if n_threads() == 1 or len(listed) < 2 or getattr(_here, "is_worker", False):
        return [function(item) for item in listed]
    others = [_workers().submit(_as_worker, function, item) for item in listed[1:]]
    try:
        results = [function(listed[0])]
    finally:
        wait(others)
    return results + [other.result() for other in others]


def one_behind_another(
    first: Callable[[_Item], _Between], then: Callable[[_Between], _Result], items: Iterable[_Item]
) -> list[_Result]:
    """Return then(first(item)) of few large items, the second step of one beside the first step of the next.

    Raises what was raised for the first item that failed.
    """
    if n_threads() == 1 or getattr(_here, "is_worker", False):
        return [then(first(item)) for item in items]
    results: list[Future[_Result]] = []
    try:
        for item in items:
            results.append(_workers().submit(_as_worker, then, first(item)))
    finally:
        wait(results)
        made = [result.result() for result in results]  # of two items that failed the first is told
    return made


_here = threading.local()


def _as_worker(function: Callable[[_Item], _Result], item: _Item) -> _Result:
    _here.is_worker = True  # one that waited for another could wait for itself
    return function(item)


@functools.cache
def _workers() -> ThreadPoolExecutor:
    # Kept: a block of vectors is multiplied some hundred times in a reduction, and to start a thread takes as long as
    # a tenth of such a product.
    return ThreadPoolExecutor(n_threads() - 1, thread_name_prefix="fem_import")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_workers.cache_clear)  # threads do not survive a fork


def one_blas_thread() -> AbstractContextManager[object]:
    """Return a context in which numpy's and scipy's OpenBLAS run on one thread; PARDISO keeps its own.

    The dense work here is an eigenproblem of order 200 and products of tall, narrow blocks, which memory limits. More
    threads gain little on both, and lose much when a core is busy: such an eigenproblem then took 400 ms, not 2.5.
    """
    limited: AbstractContextManager[object] = _openblas().limit(limits=1)
    return limited


@functools.cache
def _openblas() -> ThreadpoolController:
    # Kept, as searching the loaded libraries takes longer than the eigenproblem.
    return ThreadpoolController().select(internal_api="openblas")
