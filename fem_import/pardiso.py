"""PARDISO of Intel's Math Kernel Library, called directly.

Calling it ourselves keeps the factor between solves, hands over the matrix without copying or comparing it, and uses
the symmetric matrix types.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import import mkl
from fem_import.errors import ReductionError
from fem_import.tall_blocks import in_columns

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

POSITIVE_DEFINITE: Final = 2
INDEFINITE: Final = -2

_ANALYSE, _FACTOR, _SOLVE, _RELEASE = 11, 22, 33, -1
# Places in PARDISO's table of settings, counted from 0.
_OWN_VALUES, _ORDERING, _GIVEN_ORDER, _PERTURBATION = 0, 1, 4, 9
_FACTOR_ENTRIES, _BUNCH_KAUFMAN, _N_NEGATIVE, _SINGLE, _FROM_ZERO = 17, 20, 22, 27, 34
_PARDISO_METIS = 2
_MOST_ENTRIES_OF_32_BITS = 500_000_000  # in the factor; the manual asks for 64-bit indices beyond

_ERRORS = {
    -1: "its input is inconsistent",
    -2: "there is not enough memory",
    -3: "the reordering failed",
    -4: "a pivot is zero or negative",
    -5: "an internal error occurred",
    -6: "the reordering failed (matrix types 11 and 13)",
    -7: "a diagonal block is singular",
    -8: "its 32-bit indices overflow",
    -9: "there is not enough memory for an out-of-core factor",
    -10: "its temporary files cannot be opened",
    -11: "its files cannot be read or written",
    -12: "64-bit indices are not available",
}


class PardisoError(Exception):
    """PARDISO's error, in words; `code` is its number."""

    def __init__(self, code: int) -> None:
        self.code = code
        super().__init__(f"PARDISO ({code}): {_ERRORS.get(code, 'an unknown error')}")


class FactorTooLargeError(PardisoError):
    """The factor would take more than it may; `size` is its bytes."""

    def __init__(self, size: float) -> None:
        super().__init__(-2)
        self.size = size


class PardisoFactor:
    """A symmetric matrix factored by PARDISO; its memory is given back with the last reference to it.

    Parameters
    ----------
    upper
        Upper triangle with the whole diagonal (n, n), indices sorted within each row; factored and solved in the
        precision of its values, double or single. It must not be changed afterwards.
    matrix_type
        POSITIVE_DEFINITE (Cholesky) or INDEFINITE (L D L^T with Bunch-Kaufman pivots).
    order
        Rows in the order in which to eliminate them (n,); None leaves it to METIS inside PARDISO.
    largest
        Bytes that the factor may take.

    Raises
    ------
    FactorTooLargeError
        If it would take more than that; nothing is factored then.
    PardisoError
        With a code in words.
    ReductionError
        If the factor does not fit into memory.
    """

    def __init__(
        self, upper: SparseMatrix, matrix_type: int, order: IntArray | None, largest: float = float("inf")
    ) -> None:
        self._size, self._type, self._real = upper.shape[0], matrix_type, upper.dtype
        self._matrix: list[NDArray[Any]] = []  # values, row pointers, columns, order
        wide = upper.nnz > np.iinfo(np.int32).max
        try:
            self._start(upper, order, np.dtype(np.int64 if wide else np.int32))
            if not wide and not 0 <= self._settings[_FACTOR_ENTRIES] <= _MOST_ENTRIES_OF_32_BITS:
                raise PardisoError(-8)
        except PardisoError as error:
            if wide or error.code != -8:
                raise
            self.release()
            self._start(upper, order, np.dtype(np.int64))
        if self.n_bytes > largest:
            self.release()
            raise FactorTooLargeError(self.n_bytes)
        self._call(_FACTOR)
        if matrix_type == POSITIVE_DEFINITE:
            # Solves look at the factor alone unless pivots were perturbed (checked: the same bits from emptied arrays).
            # At 1e6 DoF the matrix is half a GiB.
            nothing = np.zeros(1, self._integer)
            self._matrix[:3] = np.zeros(1), nothing, nothing

    @property
    def n_negative(self) -> int:
        """Number of negative eigenvalues of the matrix (Sylvester's law of inertia)."""
        return int(self._settings[_N_NEGATIVE]) if self._type == INDEFINITE else 0

    @property
    def n_entries(self) -> int:
        """Number of entries in the factor."""
        return int(self._settings[_FACTOR_ENTRIES])

    @property
    def n_bytes(self) -> float:
        """Bytes of the factor."""
        return float(self.n_entries * self._real.itemsize)

    def solve(self, right_sides: FloatArray) -> FloatArray:
        """Return A^-1 B, (n, k) in column order and in the factor's precision."""
        loads = in_columns(np.asarray(right_sides, dtype=self._real))
        answer = np.empty_like(loads, order="F")
        self._call(_SOLVE, loads, answer)
        return answer

    def release(self) -> None:
        """Give the memory of the factor back."""
        self._finalizer()

    def _start(self, upper: SparseMatrix, order: IntArray | None, integer: np.dtype[Any]) -> None:
        self._integer = integer
        self._routine = mkl.library().pardiso_64 if integer.itemsize == 8 else mkl.library().pardiso
        rows, columns = (indices.astype(integer, copy=False) for indices in (upper.indptr, upper.indices))
        turn = np.zeros(self._size, integer) if order is None else order.astype(integer)
        self._matrix = [upper.data, rows, columns, turn]
        settings = np.zeros(64, integer)
        settings[_OWN_VALUES] = settings[_FROM_ZERO] = 1
        settings[_ORDERING] = _PARDISO_METIS
        settings[_GIVEN_ORDER] = order is not None
        settings[_SINGLE] = self._real == np.float32
        settings[_FACTOR_ENTRIES] = -1  # asks for the count
        if self._type == INDEFINITE:
            settings[_BUNCH_KAUFMAN] = 1
            settings[_PERTURBATION] = 13  # pivots below 1e-13 of the matrix are noise and would be lifted
        self._settings = settings
        self._handle = np.zeros(64, np.int64)
        self._finalizer = weakref.finalize(
            self, _release, self._routine, self._handle, self._type, self._size, integer, settings
        )
        self._call(_ANALYSE)

    def _call(self, phase: int, loads: FloatArray | None = None, answer: FloatArray | None = None) -> None:
        n_loads = 1 if loads is None else loads.shape[1]
        code = _run(
            self._routine, self._handle, self._type, phase, self._size, self._integer, self._matrix, n_loads,
            self._settings, loads, answer,
        )  # fmt: skip
        if code == -2:
            raise ReductionError(
                f"A matrix of {self._size} DoF does not fit into memory when factored "
                f"({self.n_bytes * 1e-9:.3g} GB for the factor alone). Use a machine with more memory, or a coarser "
                "mesh away from the interfaces."
            )
        if code:
            raise PardisoError(code)


def _run(
    routine: Any,
    handle: NDArray[np.int64],
    matrix_type: int,
    phase: int,
    size: int,
    integer: np.dtype[Any],
    arrays: Sequence[NDArray[Any]],
    n_loads: int,
    settings: NDArray[Any],
    loads: FloatArray | None,
    answer: FloatArray | None,
) -> int:
    """Call PARDISO, which takes every argument by address; return its error code."""
    one = np.ones(1, integer)
    silent, code = np.zeros(1, integer), np.zeros(1, integer)
    numbers = [np.array([value], integer) for value in (matrix_type, phase, size, n_loads)]
    arguments: tuple[NDArray[Any] | None, ...] = (
        handle, one, one, *numbers[:3], *arrays, numbers[3], settings, silent, loads, answer, code,
    )  # fmt: skip
    routine(*[None if item is None else ctypes.c_void_p(item.ctypes.data) for item in arguments])
    return int(code[0])


def _release(
    routine: Any, handle: NDArray[np.int64], matrix_type: int, size: int, integer: np.dtype[Any], settings: NDArray[Any]
) -> None:
    nothing = (np.zeros(1), np.zeros(1, integer), np.zeros(1, integer), np.zeros(1, integer))
    _run(routine, handle, matrix_type, _RELEASE, size, integer, nothing, 1, settings, None, None)
