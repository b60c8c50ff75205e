"""The work of a study: chunks of variants, calculated wherever an executor puts them."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import cloudpickle
import numpy as np

from fem_import.threads import one_blas_thread
from ibsdyn.axes import Array
from ibsdyn.errors import StudyError
from ibsdyn.quantities import Quantity
from ibsdyn.study_file import VariantResult

if TYPE_CHECKING:
    from ibsdyn.linear_system import LinearSystem
    from ibsdyn.model import Model

# A chunk carries the whole model, so it holds many variants; but a kill must not lose minutes, nor one worker wait.
LARGEST_CHUNK = 50
CHUNKS_PER_WORKER = 8
# Chunks handed out beyond those at work, so that no worker waits; more would only be kept in memory.
AHEAD = 2
# An executor that does not say how many workers it has is taken for a cluster of these.
UNKNOWN_WORKERS = 64
# Seconds without work after which the default worker processes end; the next study in a notebook finds them ready.
IDLE = 60


@dataclass(frozen=True)
class Task:
    """What all variants of a study have in common.

    Attributes
    ----------
    model : that the parameters change.
    addresses : p parameters.
    quantities : what is evaluated.
    """

    model: Model
    addresses: tuple[str, ...]
    quantities: tuple[Quantity, ...]

    def evaluate(self, variant: int, values: Sequence[float]) -> VariantResult:
        """Return what one variant comes to; what goes wrong is told, not raised."""
        try:
            changed = self.model.with_parameters(dict(zip(self.addresses, values, strict=True)))
            system = changed.linearize()
        except Exception as error:  # whatever a variant does, the others are calculated
            return VariantResult(variant, (None,) * len(self.quantities), {"": _words(error)})
        return evaluated(system, self.quantities, variant)


def evaluated(system: LinearSystem, quantities: Sequence[Quantity], variant: int) -> VariantResult:
    """Return the quantities of one system."""
    values: list[float | None] = []
    failures: dict[str, str] = {}
    for quantity in quantities:
        try:
            value = float(quantity.evaluate(system))
            if not np.isfinite(value):
                raise ArithmeticError(f"the value is {value}")
        except Exception as error:  # quantities may be the user's own
            failures[quantity.name] = _words(error)
            values.append(None)
        else:
            values.append(value)
    return VariantResult(variant, tuple(values), failures)


def packed(task: Task) -> bytes:
    """Return a task as bytes that any process with this package can unpack, quantities of the user's script too."""
    content: bytes = cloudpickle.dumps(task)
    return content


def evaluate_chunk(content: bytes, variants: Sequence[int], values: Array) -> list[VariantResult]:
    """Return the results of some variants; runs in a worker.

    Parameters
    ----------
    content : from ``packed``.
    variants : (n,) numbers.
    values : (n, p) parameter values.
    """
    task = _unpacked(content)
    # The nominal model has warned the user; ten thousand neighbours of it need not.
    with warnings.catch_warnings(), one_blas_thread():
        warnings.simplefilter("ignore")
        return [task.evaluate(variant, row.tolist()) for variant, row in zip(variants, values, strict=True)]


def run_chunks(
    content: bytes, variants: np.ndarray, values: Array, executor: Executor | None, workers: int | None
) -> Iterator[list[VariantResult]]:
    """Yield the results of chunks in the order in which they are finished.

    Parameters
    ----------
    content : from ``packed``.
    variants : (n,) numbers of the variants to calculate.
    values : (n, p) of these.
    executor : any ``concurrent.futures.Executor``; worker processes of this machine if None.
    workers : how many of those; as many as cores if None; 1 calculates here, without another process.

    Raises
    ------
    StudyError : a worker process died.
    """
    count = workers or (_workers_of(executor) if executor is not None else n_cores())
    chunks = _chunks(variants, values, count)
    if executor is None and count == 1:
        for numbers, rows in chunks:
            yield evaluate_chunk(content, numbers, rows)
        return
    pool = executor if executor is not None else _processes(count)
    try:
        yield from _completed(pool, content, chunks, AHEAD * count)
    except BrokenExecutor as error:
        raise StudyError(
            "a worker process died: killed, out of memory, or crashed. What is finished is kept in the results file, "
            "where one was given: run the study again to go on. workers=1 shows where it happens."
        ) from error


def n_cores() -> int:
    """Return how many worker processes the default takes: the cores that this process may use."""
    import loky

    cores: int = loky.cpu_count()
    return cores


def _completed(
    pool: Executor, content: bytes, chunks: Iterable[tuple[list[int], Array]], ahead: int
) -> Iterator[list[VariantResult]]:
    pending: set[Future[list[VariantResult]]] = set()
    waiting = iter(chunks)
    try:
        while True:
            for numbers, rows in waiting:
                pending.add(pool.submit(evaluate_chunk, content, numbers, rows))
                if len(pending) >= ahead:
                    break
            if not pending:
                return
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    finally:
        # Interrupted: what has not begun need not.
        for future in pending:
            future.cancel()


def _processes(count: int) -> Executor:
    # loky's processes start afresh, so they neither inherit locks of threads that a fork would (BLAS, notebooks), nor
    # run the user's script again as spawn does where it has no `if __name__ == "__main__"`.
    from loky import get_reusable_executor

    pool: Executor = get_reusable_executor(max_workers=count, timeout=IDLE, env={"OMP_NUM_THREADS": "1"})
    return pool


def _workers_of(executor: Executor) -> int:
    own = getattr(executor, "_max_workers", None)
    return own if isinstance(own, int) and own > 0 else UNKNOWN_WORKERS


def _chunks(variants: np.ndarray, values: Array, workers: int) -> Iterator[tuple[list[int], Array]]:
    size = int(np.clip(-(-len(variants) // (workers * CHUNKS_PER_WORKER)), 1, LARGEST_CHUNK))
    for start in range(0, len(variants), size):
        yield variants[start : start + size].tolist(), values[start : start + size]


@lru_cache(maxsize=4)
def _unpacked(content: bytes) -> Task:
    task: Task = pickle.loads(content)
    return task


def _words(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
