"""The lowest modes of a symmetric eigenproblem by block Lanczos with solves in blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ReductionError
from fem_import.sparse_blocks import RowParallel
from fem_import.tall_blocks import combine, in_rows, inner, put, subtract
from fem_import.threads import one_blas_thread

FloatArray: TypeAlias = NDArray[np.float64]

_BLOCK = 12  # above the multiplicity of any eigenvalue of a real part; solves in blocks of 8 to 12 are the fastest
_RESIDUAL = 1e-8  # of a Ritz vector; its eigenvalue is then right to the square of it
_RANK = 1e-7  # of a column's own size; a Gram matrix in doubles sees no further
_THIN = 1e-3  # of a column's own size: what is left of it then is orthogonal to 1e-13
_CLEAN = 1e-2  # what one more projection may still take from a vector that counts as orthogonal
_LARGEST_BASIS = 4000
_COLUMNS_OF_A_CHUNK = 8 * _BLOCK


def lowest_modes(
    solve: Callable[[FloatArray], FloatArray],
    M: sparse.csr_array[Any, tuple[int, int]],
    wanted: Callable[[FloatArray], int],
) -> tuple[FloatArray, FloatArray]:
    """Return the lowest modes of K x = lambda M x.

    Parameters
    ----------
    solve
        Loads (n, b) -> K^-1 loads, b > 1, symmetric; its range may be a subspace.
    M
        Mass matrix (n, n).
    wanted
        The number of modes asked for, given the ascending eigenvalue estimates. Those and one more must
        converge, so that the first mode beyond proves that the list is complete up to there.

    Returns
    -------
    eigenvalues, modes
        Ascending (k,), and (n, k) with unit modal mass; those beyond the wanted ones that have converged too.

    Raises
    ------
    ReductionError
        If more vectors would be needed than are sensible.

    Notes
    -----
    Block Lanczos on K^-1 M in the M inner product (Grimes, Lewis and Simon, SIAM J. Matrix Anal. Appl. 15(1),
    1994) with full reorthogonalisation. The start vectors are fixed, so the result is reproducible. When the
    Krylov space closes, a fresh random block looks for what it missed.
    """
    with one_blas_thread():
        return _lowest_modes(solve, RowParallel(M), wanted)


def _lowest_modes(
    solve: Callable[[FloatArray], FloatArray], mass: RowParallel, wanted: Callable[[FloatArray], int]
) -> tuple[FloatArray, FloatArray]:
    n = mass.shape[0]
    random = np.random.default_rng(20240229)
    basis = _Basis(n)
    projected = np.empty((0, 0))
    eigenvalues, n_settled, coefficients = np.empty(0), 0, np.empty((0, 0))
    restarts, next_look = 0, 0
    block, mass_block = _fresh_block(solve, mass, random, basis)
    while block.shape[1]:
        basis.append(block)
        images = in_rows(solve(mass_block))
        following, mass_following, column, left_over = _next_block(images, mass, basis)
        projected = _grown(projected, column)
        closed = following.shape[1] == 0
        if closed or basis.size >= next_look:
            next_look = basis.size + max(_BLOCK, basis.size // 20)  # a look costs the cube of the size
            eigenvalues, n_settled, coefficients = _ritz(projected, left_over)
            if n_settled > wanted(eigenvalues):
                break
        if basis.size > _LARGEST_BASIS:
            raise ReductionError(
                f"More than {_LARGEST_BASIS} Lanczos vectors and still modes missing. Lower max_frequency."
            )
        block, mass_block = following, mass_following
        if closed and restarts < 2:
            restarts += 1
            block, mass_block = _fresh_block(solve, mass, random, basis)
    else:
        n_settled = len(eigenvalues)
    return eigenvalues[:n_settled], basis.combine(coefficients[:, :n_settled])


class _Basis:
    """M-orthonormal vectors (n, size) that grow by blocks without being copied."""

    def __init__(self, n: int) -> None:
        self._n, self.size = n, 0
        self._chunks: list[FloatArray] = []

    def append(self, block: FloatArray) -> None:
        taken = 0
        while taken < block.shape[1]:
            place = self.size % _COLUMNS_OF_A_CHUNK
            if place == 0:
                self._chunks.append(np.empty((self._n, _COLUMNS_OF_A_CHUNK), order="F"))
            count = min(_COLUMNS_OF_A_CHUNK - place, block.shape[1] - taken)
            put(self._chunks[-1][:, place : place + count], block[:, taken : taken + count])
            taken += count
            self.size += count

    def coefficients(self, mass_block: FloatArray, first: int = 0) -> FloatArray:
        """Return those of the vectors from `first` on in a block, given M times it."""
        parts = [inner(chunk, mass_block) for chunk in self._used(first)]
        return np.vstack(parts) if parts else np.empty((0, mass_block.shape[1]))

    def combine(self, coefficients: FloatArray) -> FloatArray:
        """Return the linear combinations (n, k) with coefficients (size, k)."""
        total = np.zeros((self._n, coefficients.shape[1]))
        self.subtract(total, -coefficients)
        return total

    def subtract(self, block: FloatArray, coefficients: FloatArray, first: int = 0) -> None:
        """Take the vectors from `first` on times coefficients from the block, in place."""
        for chunk in self._used(first):
            count = chunk.shape[1]
            subtract(block, chunk, coefficients[:count])
            coefficients = coefficients[count:]

    def _used(self, first: int) -> list[FloatArray]:
        starts = range(0, self.size, _COLUMNS_OF_A_CHUNK)
        return [
            chunk[:, max(first - start, 0) : self.size - start]
            for start, chunk in zip(starts, self._chunks, strict=True)
            if first < start + _COLUMNS_OF_A_CHUNK
        ]


def _fresh_block(
    solve: Callable[[FloatArray], FloatArray], mass: RowParallel, random: np.random.Generator, basis: _Basis
) -> tuple[FloatArray, FloatArray]:
    images = in_rows(solve(mass @ random.standard_normal((mass.shape[0], _BLOCK))))
    block, mass_block, _, _ = _next_block(images, mass, basis)
    return block, mass_block


def _next_block(
    images: FloatArray, mass: RowParallel, basis: _Basis
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Orthonormalise images (n, b) = K^-1 M block, in place, against the basis.

    Its last two blocks take nearly all of it (the three-term recurrence); the sweep over the whole basis that follows
    only removes rounding. Returns the next block, M times it, the images'
    coefficients in the basis (size, b) and the Gram matrix (b, b) of what was left of them.
    """
    mass_images = mass @ images
    size = np.sqrt(np.maximum(np.diag(inner(images, mass_images)), 0.0))
    column = np.zeros((basis.size, images.shape[1]))
    recent = max(0, basis.size - 2 * _BLOCK)
    column[recent:] = basis.coefficients(mass_images, recent)
    basis.subtract(images, column[recent:], recent)
    for _ in range(3):
        mass_images = mass @ images
        rest = basis.coefficients(mass_images)
        gram = inner(images, mass_images) - rest.T @ rest
        basis.subtract(images, rest)
        column += rest
        if np.all(np.einsum("ij,ij->j", rest, rest) <= _CLEAN * np.maximum(np.diag(gram), (_RANK * size) ** 2)):
            break
    gram = 0.5 * (gram + gram.T)
    inverse_size = np.divide(1.0, size, out=np.zeros_like(size), where=size > 1e-150)
    values, vectors = np.linalg.eigh(inverse_size[:, None] * gram * inverse_size)
    kept = values > _RANK**2
    block = combine(images, inverse_size[:, None] * vectors[:, kept] / np.sqrt(values[kept]))
    mass_block = mass @ block
    is_thin = bool(np.any(values[kept] < _THIN**2))
    for _ in range(2):
        if is_thin:  # it was blown up, and its rounding with it
            rest = basis.coefficients(mass_block)
            if np.max(abs(rest), initial=0.0) > 1e-13:
                basis.subtract(block, rest)
                mass_block = mass @ block
        own = inner(block, mass_block)
        error = np.max(abs(own - np.eye(len(own))), initial=0.0)
        if error < 1e-13:
            break
        values, vectors = np.linalg.eigh(0.5 * (own + own.T))
        kept = values > 0.25
        whitening = vectors[:, kept] / np.sqrt(values[kept])
        block, mass_block = combine(block, whitening), combine(mass_block, whitening)
        if error < 1e-6:
            break
    return block, mass_block, column, gram


def _grown(projected: FloatArray, column: FloatArray) -> FloatArray:
    done, size = len(projected), len(column)
    grown = np.zeros((size, size))
    grown[:done, :done] = projected
    grown[:, done:] = column
    grown[done:, :done] = column[:done].T
    grown[done:, done:] = 0.5 * (column[done:] + column[done:].T)
    return grown


def _ritz(projected: FloatArray, left_over: FloatArray) -> tuple[FloatArray, int, FloatArray]:
    """Return the eigenvalue estimates, how many of the first have converged, and all coefficients."""
    inverse, coefficients = np.linalg.eigh(projected)
    inverse, coefficients = inverse[::-1], coefficients[:, ::-1]
    usable = inverse > 1e-14 * inverse[0]
    last = coefficients[-len(left_over) :]
    residuals = np.sqrt(np.maximum(np.einsum("ij,ij->j", last, left_over @ last), 0.0))
    settled = usable & (residuals < _RESIDUAL * np.maximum(inverse, 1e-300))
    n_settled = len(settled) if np.all(settled) else int(np.argmin(settled))
    return 1.0 / inverse[usable], n_settled, coefficients
