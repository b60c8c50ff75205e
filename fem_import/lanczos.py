"""The lowest modes of a symmetric eigenproblem by block Lanczos with solves in blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ReductionError

FloatArray: TypeAlias = NDArray[np.float64]

_BLOCK = 8  # above the multiplicity of any eigenvalue of a real part; solves in blocks of 8 to 12 are the fastest
_RESIDUAL = 1e-9  # of a Ritz vector; its eigenvalue is then right to the square of it
_RANK = 1e-7  # of a column's own size; a Gram matrix in doubles sees no further
_LARGEST_BASIS = 4000


def lowest_modes(
    solve: Callable[[FloatArray], FloatArray],
    M: sparse.csr_array[Any, tuple[int, int]],
    wanted: Callable[[FloatArray], int],
) -> tuple[FloatArray, FloatArray]:
    """Return (eigenvalues ascending, modes (n, k) with unit modal mass) of K x = lambda M x.

    solve: loads (n, b) -> K^-1 loads, b > 1, symmetric, its range may be a subspace. wanted: the number of
    modes asked for, given the ascending eigenvalue estimates; those and one more must converge, so that the
    first mode beyond proves that the list is complete up to there. The returned list includes those beyond
    that have converged. Operator K^-1 M in the M inner product, full reorthogonalisation, fixed start vectors
    (the result is reproducible). When the Krylov space closes, a fresh random block looks for what it missed.
    """
    n = M.shape[0]
    random = np.random.default_rng(20240229)
    basis = np.empty((n, 0), order="F")
    projected = np.empty((0, 0))
    block = _orthonormal(solve(M @ random.standard_normal((n, _BLOCK))), M, basis)
    restarts = 0
    while block.shape[1]:
        basis = np.hstack([basis, block])
        images = solve(M @ block)
        weighted = M @ images
        column = basis.T @ weighted
        done = projected.shape[0]
        grown = np.zeros((basis.shape[1], basis.shape[1]))
        grown[:done, :done] = projected
        grown[:, done:] = column
        grown[done:, :done] = column[:done].T
        grown[done:, done:] = 0.5 * (column[done:] + column[done:].T)
        projected = grown
        remainder = images - basis @ column
        following = _orthonormal(remainder, M, basis, reference=images)
        inverse, coefficients = np.linalg.eigh(projected)
        inverse, coefficients = inverse[::-1], coefficients[:, ::-1]
        usable = inverse > 1e-14 * inverse[0]
        left_over = remainder.T @ (M @ remainder)
        last = coefficients[done:]
        residuals = np.sqrt(np.maximum(np.einsum("ij,ij->j", last, left_over @ last), 0.0))
        residuals /= np.maximum(inverse, 1e-300)
        settled = usable & (residuals < _RESIDUAL)
        n_settled = len(settled) if np.all(settled) else int(np.argmin(settled))
        eigenvalues = 1.0 / inverse[usable]
        if n_settled > wanted(eigenvalues):
            break
        if basis.shape[1] > _LARGEST_BASIS:
            raise ReductionError(
                f"More than {_LARGEST_BASIS} Lanczos vectors and still modes missing. Lower max_frequency."
            )
        if following.shape[1] == 0 and restarts < 2:
            restarts += 1
            following = _orthonormal(solve(M @ random.standard_normal((n, _BLOCK))), M, basis)
        block = following
    else:
        if basis.shape[1] == 0:
            return np.empty(0), np.empty((n, 0))
        n_settled = int(np.count_nonzero(usable))
    modes = basis @ coefficients[:, :n_settled]
    return eigenvalues[:n_settled], modes


def _orthonormal(
    block: FloatArray,
    M: sparse.csr_array[Any, tuple[int, int]],
    basis: FloatArray,
    reference: FloatArray | None = None,
) -> FloatArray:
    """Return an M-orthonormal basis of what `block` adds to `basis`, less the rounding of `reference`."""
    reference = block if reference is None else reference
    size = np.sqrt(np.maximum(np.einsum("ij,ij->j", reference, M @ reference), 0.0))
    largest = float(size.max(initial=0.0))
    if largest == 0.0:
        return np.empty((block.shape[0], 0))
    block = block / np.where(size > 0.0, size, 1.0)
    # numpy's eigh, as scipy's before 1.13 does not take the empty matrix of a space that has closed
    for sweep in range(3):  # the first removes, the second cleans, the third makes up for a bad Gram matrix
        block = block - basis @ (basis.T @ (M @ block))
        gram = block.T @ (M @ block)
        values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
        kept = values > (_RANK**2 if sweep == 0 else 0.25)
        block = block @ (vectors[:, kept] / np.sqrt(values[kept]))
    return block
