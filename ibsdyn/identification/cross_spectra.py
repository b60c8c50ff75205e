"""The matrix of auto and cross spectra, and the sums it is made of, by FFT on all cores."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from os import cpu_count

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ibsdyn.axes import Array
from ibsdyn.identification.effective_averages import Averages

ComplexArray = NDArray[np.complex128]
# Samples of all channels that one thread holds at a time; the spectra and their turned copy take four times as much.
BLOCK_SAMPLES = 1 << 22


@dataclass(frozen=True, eq=False)
class CrossSpectra:
    """Averaged spectra of the channels, inputs first.

    Attributes
    ----------
    frequencies : (n_freq,) [Hz].
    matrix : (n_freq, count, count) S[f, a, b] = E[x_a conj(x_b)]; only ratios matter, so its scale is free.
    averages : the terms averaged.
    resolution : width of the spectral window at half height [Hz].
    """

    frequencies: Array
    matrix: ComplexArray
    averages: Averages
    resolution: float


def summed_products(
    blocks: Iterable[tuple[int, int]],
    spectra_of: Callable[[int, int], tuple[ComplexArray, ComplexArray]],
    shape: tuple[int, int, int],
) -> ComplexArray:
    """Return the sum over blocks of X Y^H at each frequency.

    Parameters
    ----------
    blocks : what ``spectra_of`` takes.
    spectra_of : returns X and Y, (count, pieces, n_freq) each, of a block.
    shape : (n_freq, count, count).

    Notes
    -----
    Every thread sums blocks of its own; numpy and scipy release the interpreter while they transform and multiply.
    """
    listed = list(blocks)
    workers = max(1, min(cpu_count() or 1, 4, len(listed)))

    def partial(first: int) -> ComplexArray:
        total = np.zeros(shape, dtype=np.complex128)
        for block in islice(listed, first, None, workers):
            left, right = spectra_of(*block)
            turned = np.ascontiguousarray(left.transpose(2, 0, 1))
            other = turned if right is left else np.ascontiguousarray(right.transpose(2, 0, 1))
            total += turned @ other.conj().transpose(0, 2, 1)
        return total

    if workers == 1:
        return partial(0)
    with threadpool_limits(1), ThreadPoolExecutor(workers) as pool:
        parts = list(pool.map(partial, range(workers)))
    for other in parts[1:]:
        parts[0] += other
    return parts[0]


def half_height_width(window: Array, spacing: float) -> float:
    """Return the width at half height of a spectral window [Hz].

    Parameters
    ----------
    window : (n,) values of the window's transform over frequency from its peak on, falling.
    spacing : distance of the values [Hz].
    """
    level = window / window[0]
    below = int(np.argmax(level < 0.5))
    fraction = (level[below - 1] - 0.5) / (level[below - 1] - level[below])
    return float(2 * (below - 1 + fraction) * spacing)
