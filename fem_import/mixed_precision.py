"""Solves in double precision with a factor in single precision, which takes half the memory and half the time."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ReductionError
from fem_import.pardiso import POSITIVE_DEFINITE, PardisoError, PardisoFactor
from fem_import.threads import side_by_side

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_COLUMNS_AT_ONCE = 12
_ERROR = 1e-13  # of a solution, in the energy norm
_MOST_STEPS = 40
_ZERO_PIVOT = -4  # PARDISO's code
_ILL_CONDITIONED = (
    "The stiffness is singular or not positive definite, or too ill-conditioned for a factor in single precision, and "
    "one in double precision does not fit into the memory of this machine. Does the part have loose pieces? Otherwise "
    "use a machine with more memory, or a coarser mesh away from the interfaces."
)


class MixedPrecisionFactor:
    """A symmetric positive definite matrix, factored in single precision by PARDISO.

    Parameters
    ----------
    upper
        Upper triangle with the whole diagonal (n, n), indices sorted within each row. It must not be changed
        afterwards.
    order
        Rows in the order in which to eliminate them (n,); None leaves it to PARDISO.
    largest
        Bytes that the factor may take.

    Raises
    ------
    PardisoError
        As of `PardisoFactor`; FactorTooLargeError among them.
    ReductionError
        If the matrix is so ill-conditioned that single precision is no help.

    Notes
    -----
    Conjugate gradients, every column on its own, with the single-precision factor of the matrix scaled to a unit
    diagonal in place of its inverse. Solid parts take three to five steps: a step gains as many digits as single
    precision has beyond those that the condition of the matrix costs.
    """

    n_negative = 0

    def __init__(self, upper: SparseMatrix, order: IntArray | None, largest: float = float("inf")) -> None:
        lower = sparse.csc_array((upper.data, upper.indices, upper.indptr), shape=upper.shape, copy=False)
        self._triangles = (upper, lower)
        self._diagonal = upper.diagonal()[:, None]
        self._scale = 1.0 / np.sqrt(self._diagonal)
        values = upper.data * np.repeat(self._scale[:, 0], np.diff(upper.indptr))
        values *= self._scale[upper.indices, 0]
        scaled = sparse.csr_array((values.astype(np.float32), upper.indices, upper.indptr), shape=upper.shape)
        del values
        try:
            self._factor = PardisoFactor(scaled, POSITIVE_DEFINITE, order, largest)
        except PardisoError as error:
            if error.code != _ZERO_PIVOT:
                raise
            raise ReductionError(_ILL_CONDITIONED) from None
        try:
            self.solve(np.random.default_rng(7).standard_normal((upper.shape[0], 1)) / self._scale)
        except ReductionError:
            self._factor.release()
            raise

    def solve(self, right_sides: FloatArray) -> FloatArray:
        """Return A^-1 B, (n, k) in column order.

        Raises
        ------
        ReductionError
            If the matrix is so ill-conditioned that single precision is no help.
        """
        answer = np.empty(right_sides.shape, order="F")
        for first in range(0, right_sides.shape[1], _COLUMNS_AT_ONCE):
            some = slice(first, first + _COLUMNS_AT_ONCE)
            answer[:, some] = self._conjugate_gradients(right_sides[:, some])
        return answer

    def _conjugate_gradients(self, loads: FloatArray) -> FloatArray:
        answer = self._roughly(loads)
        energy = _dots(loads, answer)
        residual = loads - self._times(answer)
        correction = self._roughly(residual)
        direction = correction.copy(order="C")
        error = _dots(residual, correction)
        for _ in range(_MOST_STEPS):
            unfinished = ~(error <= _ERROR**2 * np.abs(energy))  # what is not finite is not finished either
            if not np.any(unfinished):
                return answer
            image = self._times(direction)
            # A column that is done rests: what is left of it is rounding, and would grow.
            step = np.where(unfinished, _ratio(error, _dots(direction, image)), 0.0)
            answer += direction * step
            residual -= image * step
            correction = self._roughly(residual)
            following = _dots(residual, correction)
            direction *= _ratio(following, error)
            direction += correction
            error = np.where(unfinished, following, 0.0)
        raise ReductionError(_ILL_CONDITIONED)

    def _roughly(self, loads: FloatArray) -> FloatArray:
        # A small right side would be lost among numbers that single precision has not.
        size = np.max(np.abs(loads), axis=0, initial=0.0)
        size = np.where(size > 0.0, size, 1.0) * float(np.max(self._scale))
        solved = self._factor.solve(loads * self._scale / size)
        return np.asarray(solved * (self._scale * size), dtype=np.float64)

    def _times(self, block: FloatArray) -> FloatArray:
        """Return A @ block out of the upper triangle."""
        above, below = side_by_side(lambda half: np.asarray(half @ block), self._triangles)
        product: FloatArray = above
        product += below
        product -= self._diagonal * block
        return product


def _dots(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->j", a, b))


def _ratio(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.divide(a, b, out=np.zeros_like(a), where=b != 0.0)
