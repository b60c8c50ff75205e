"""How many threads the work of this package takes."""

from __future__ import annotations

import functools
import os
from contextlib import AbstractContextManager

from threadpoolctl import ThreadpoolController


@functools.cache
def n_threads() -> int:
    """Return OMP_NUM_THREADS where it is set, else the number of cores this process may run on."""
    asked = os.environ.get("OMP_NUM_THREADS", "")
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def one_blas_thread() -> AbstractContextManager[object]:
    """Return a context in which BLAS and LAPACK run on one thread.

    An eigenproblem of order 200 takes 2.5 ms on one thread; shared with a busy core it was measured at 400.
    """
    return _blas().limit(limits=1, user_api="blas")


@functools.cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()  # it searches the loaded libraries, which takes longer than the eigenproblem
