"""Cross spectra by the spectral analysis method (Blackman-Tukey): transforms of lag-windowed covariances."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.fft

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError
from ibsdyn.identification.channels import Channels
from ibsdyn.identification.cross_spectra import (
    BLOCK_SAMPLES,
    ComplexArray,
    CrossSpectra,
    half_height_width,
    summed_products,
)
from ibsdyn.identification.effective_averages import Averages

LAG_WINDOWS = ("hann", "bartlett", "parzen")


def lag_window(name: str, lags: int) -> Array:
    """Return a lag window at lags 0 to ``lags``, where it is zero.

    Notes
    -----
    Sum of squares over both sides, times 1 / lags: 0.75 (Hann), 2/3 (Bartlett), 0.539 (Parzen). Jenkins and Watts,
    Spectral Analysis and its Applications.
    """
    x = np.arange(lags + 1) / lags
    if name == "hann":
        return np.asarray(0.5 + 0.5 * np.cos(np.pi * x))
    if name == "bartlett":
        return 1.0 - x
    return np.where(x <= 0.5, 1.0 - 6.0 * x**2 * (1.0 - x), 2.0 * (1.0 - x) ** 3)


def blackman_tukey_spectra(channels: Channels, lags: int, window: str, frequencies: Array | None) -> CrossSpectra:
    """Return the transforms of the windowed covariances; each record's mean is removed.

    Parameters
    ----------
    channels : inputs and outputs.
    lags : M, the lag at which the window ends [samples].
    window : one of LAG_WINDOWS.
    frequencies : (n_freq,) [Hz]; the lines k / (2 M) of the sample rate if None.

    Raises
    ------
    RecordError : a record not longer than the window.

    Notes
    -----
    Phi_xy(omega) = sum w(tau) R_xy(tau) e^{-i omega tau}, R_xy(tau) = 1/N sum x(k + tau) y(k). A variance is about W/N
    times that of a single line, W the sum of w^2: N/W averages. Ljung, System Identification, section 6.4.
    """
    for record, n in zip(channels.records, channels.n_samples, strict=True):
        if n <= 2 * lags:
            raise RecordError(
                f"{record.title} has {n} samples; a lag window of {lags} on either side needs more than twice as many. "
                "Take a shorter one (window_length=) or measure longer."
            )
    transforms = _summed_transforms(channels, lags)
    half = lag_window(window, lags)
    fs = channels.sample_rate
    lines = np.arange(1, lags) * fs / (2 * lags) if frequencies is None else frequencies
    matrix = np.empty((len(lines), channels.count, channels.count), dtype=np.complex128)
    for a in range(channels.count):  # one row at a time: all lags of all pairs would take twice the memory
        covariance = scipy.fft.irfft(transforms[:, a].T, axis=1)[:, : 2 * lags + 1]
        covariance = covariance * np.concatenate([half[:0:-1], half]) / sum(channels.n_samples)
        matrix[:, a] = _transform(covariance, lags, None if frequencies is None else lines / fs).T
    # Rounding alone makes it unsymmetric: R_xy(tau) = R_yx(-tau).
    matrix = 0.5 * (matrix + matrix.conj().transpose(0, 2, 1))
    averages = _line_averages(window, half, channels.n_samples)
    return CrossSpectra(lines, matrix, averages, relative_width(window) * fs / lags)


def _summed_transforms(channels: Channels, lags: int) -> ComplexArray:
    """Return the transforms (n_freq, count, count) of N R_xy(tau - lags), tau = 0 to 2 lags.

    Pieces of y are correlated with the same stretch of x, extended by the lags on either side; zeros stand outside
    the record. Nothing wraps round within the first 2 lags + 1 values, so pieces add up to the whole record's
    covariance exactly.
    """
    size = scipy.fft.next_fast_len(max(4 * lags, 1 << 13), real=True)
    size += size % 2  # even, so that irfft gives it back without being told
    piece = size - 2 * lags
    means = [channels.means(record) for record in range(len(channels.records))]
    a_time = max(1, BLOCK_SAMPLES // (2 * channels.count * size))

    def spectra_of(record: int, begin: int) -> tuple[ComplexArray, ComplexArray]:
        n = channels.n_samples[record]
        pieces = min(a_time, -(-(n - begin) // piece))
        slab = np.zeros((channels.count, pieces * piece + 2 * lags))
        first, last = max(begin - lags, 0), min(begin + pieces * piece + lags, n)
        place = first - (begin - lags)
        slab[:, place : place + last - first] = channels.read(record, first, last) - means[record]
        extended = np.lib.stride_tricks.sliding_window_view(slab, size, axis=1)[:, ::piece]
        # Beyond its end a record has no y, though it has x before it: the slab's tail is zero there already.
        middle = slab[:, lags : lags + pieces * piece].reshape(channels.count, pieces, piece)
        return (
            np.asarray(scipy.fft.rfft(extended, axis=2)),
            np.asarray(scipy.fft.rfft(middle, n=size, axis=2)),
        )

    def blocks() -> Iterator[tuple[int, int]]:
        for record, n in enumerate(channels.n_samples):
            for begin in range(0, n, a_time * piece):
                yield record, begin

    return summed_products(blocks(), spectra_of, (size // 2 + 1, channels.count, channels.count))


def _transform(covariance: Array, lags: int, cycles: Array | None) -> ComplexArray:
    """Return sum R(tau) e^{-i omega tau} over tau = -lags to lags, at ``cycles`` per sample or at k / (2 lags)."""
    if cycles is None:
        folded = np.roll(covariance[:, :-1], -lags, axis=1)  # both ends are zero: -lags and lags fall together
        return np.asarray(scipy.fft.rfft(folded, axis=1))[:, 1:lags]
    spectra = np.empty((len(covariance), len(cycles)), dtype=np.complex128)
    tau = np.arange(-lags, lags + 1)
    step = max(1, (1 << 21) // len(tau))
    for first in range(0, len(cycles), step):
        phase = np.exp(-2j * np.pi * np.outer(tau, cycles[first : first + step]))
        spectra[:, first : first + step] = covariance @ phase
    return spectra


def relative_width(window: str) -> float:
    """Return the width of the spectral window at half height, times lags over sample rate."""
    heights, spacing = _spectral_window(window)
    return half_height_width(heights, spacing)


def _spectral_window(window: str) -> tuple[Array, float]:
    """Return the lag window's transform over frequency, from 0 on, and its spacing in units of rate over lags."""
    lags, padding = 512, 128
    half = lag_window(window, lags)
    padded = np.zeros(padding * lags)
    padded[: lags + 1] = half
    padded[-lags:] = half[:0:-1]
    return np.fft.rfft(padded).real, 1 / padding


def _line_averages(window: str, half: Array, n_samples: tuple[int, ...]) -> Averages:
    """Return the lines under the main lobe of the spectral window, by their heights.

    Their effective number is N / sum w^2, side lobes included (Parseval), less the products that a lag leaves out at
    the end of each record: N^2 / sum (N - |tau|) w^2.
    """
    heights, _ = _spectral_window(window)
    lobe = heights[: int(np.argmax(heights < 1e-3 * heights[0])) : 8]
    weights = np.concatenate([lobe, lobe[1:]]) / np.mean(np.concatenate([lobe, lobe[1:]]))
    tau = np.arange(len(half))
    products = sum(n - tau for n in n_samples) * half**2
    effective = sum(n_samples) ** 2 / float(2 * products[1:].sum() + products[0])
    return Averages(weights, effective * float(np.mean(weights**2)) / len(weights))
