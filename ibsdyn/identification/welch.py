"""Cross spectra by Welch's method: windowed, overlapping segments."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.fft
import scipy.signal

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

# Eigenvalues of the correlation between segments are taken at so many angles.
_ANGLES = 64


def welch_spectra(channels: Channels, length: int, window: str, overlap: float) -> CrossSpectra:
    """Return the cross spectra averaged over segments; each segment's mean is removed.

    Parameters
    ----------
    channels : inputs and outputs.
    length : samples of a segment.
    window : name of a window that ``scipy.signal.get_window`` knows.
    overlap : share of a segment that the next one repeats, 0 to below 1.

    Raises
    ------
    RecordError : a record shorter than a segment.
    """
    taper = scipy.signal.get_window(window, length)
    hop = max(1, round(length * (1.0 - overlap)))
    counts = [1 + (n - length) // hop if n >= length else 0 for n in channels.n_samples]
    for number, count in enumerate(counts):
        if count == 0:
            raise RecordError(
                f"record {number + 1} ({channels.records[number].title}) has {channels.n_samples[number]} samples, a "
                f"segment {length}; take shorter segments (window_length=) or leave the record out."
            )
    # At 0 Hz and at the Nyquist frequency spectra are real and have other statistics; the mean is gone anyway.
    kept = slice(1, (length + 1) // 2)
    a_time = max(1, BLOCK_SAMPLES // (channels.count * length))

    def spectra_of(record: int, first: int) -> tuple[ComplexArray, ComplexArray]:
        pieces = min(a_time, counts[record] - first)
        slab = channels.read(record, first * hop, (first + pieces - 1) * hop + length)
        segments = np.lib.stride_tricks.sliding_window_view(slab, length, axis=1)[:, ::hop]
        centred = segments - segments.mean(axis=2, keepdims=True)
        centred *= taper
        spectra = np.asarray(scipy.fft.rfft(centred, axis=2, overwrite_x=True))[:, :, kept]
        return spectra, spectra

    def blocks() -> Iterator[tuple[int, int]]:
        for record, count in enumerate(counts):
            for first in range(0, count, a_time):
                yield record, first

    n_freq = (length + 1) // 2 - 1
    total = summed_products(blocks(), spectra_of, (n_freq, channels.count, channels.count))
    frequencies = np.arange(1, n_freq + 1) * channels.sample_rate / length
    averages = segment_averages(taper, hop, counts)
    resolution = relative_width(window) * channels.sample_rate / length
    return CrossSpectra(frequencies, total / sum(counts), averages, resolution)


def segment_averages(taper: Array, hop: int, counts: list[int]) -> Averages:
    """Return the independent averages that overlapping segments are worth.

    Parameters
    ----------
    taper : the window.
    hop : samples from one segment to the next.
    counts : segments of each record.

    Notes
    -----
    Segments k hops apart correlate by the window's correlation with itself, c_k. The eigenvalues of the correlation of
    many are 1 + 2 sum c_k cos(k theta), theta evenly spaced; the effective number is that of Welch (1967),
    K / (1 + 2 sum (1 - k/K) c_k^2), where (1 - k/K) is the mean over the records.
    """
    power, total = float(taper @ taper), sum(counts)
    theta = 2 * np.pi * (np.arange(_ANGLES) + 0.5) / _ANGLES
    weights = np.ones(_ANGLES)
    for k in range(1, min(max(counts), -(-len(taper) // hop))):
        pairs = sum(max(count - k, 0) for count in counts) / total
        correlation = float(taper[k * hop :] @ taper[: len(taper) - k * hop]) / power
        weights += 2 * np.sqrt(pairs) * correlation * np.cos(k * theta)
    # Strong overlap makes some eigenvalues vanish, and the cut-off sum then may fall below zero by a little.
    weights = np.maximum(weights, 1e-6)
    return Averages(weights / weights.mean(), total / _ANGLES)


def relative_width(window: str) -> float:
    """Return the width of the spectral window at half height, times segment length over sample rate."""
    length = 512
    power = np.abs(np.fft.rfft(scipy.signal.get_window(window, length), 64 * length)) ** 2
    return half_height_width(power, 1 / 64)
