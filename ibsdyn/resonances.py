"""Resonances as frequency responses show them: where, how wide, how damped."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.ndimage
import scipy.signal

from ibsdyn.axes import Array
from ibsdyn.frequency_response import FrequencyResponse

# A peak must stand out on both sides by this factor to be taken for a resonance, ...
PROMINENCE = 2.0
# ... and its standard deviation be below this share of it. Variances out of few degrees of freedom are small by chance
# at some of thousands of lines, so they are averaged over as many lines.
UNCERTAIN, POOLED_LINES = 0.07, 17
# Of each response so many at most, those that stand out most: a noisy response without statistics has hundreds.
MOST = 30
# The local fit takes lines within so many half-power widths of the peak, and needs so many of them.
WIDTHS, FEWEST_LINES = 1.5, 7


@dataclass(frozen=True)
class Resonance:
    """A resonance as one response shows it.

    Attributes
    ----------
    frequency : undamped natural frequency where fitted, the line of the peak otherwise [Hz].
    damping_ratio : by the fit, or half the half-power width over the frequency [-].
    width : between the half-power points on either side of the peak [Hz].
    prominence : the peak's magnitude over that of the higher of the valleys beside it [-].
    output, input : numbers of the response.
    fitted : whether a local fit of one mode gave frequency and damping; else the half-power points did.
    """

    frequency: float
    damping_ratio: float
    width: float
    prominence: float
    output: int
    input: int
    fitted: bool = False


def find_resonances(frf: FrequencyResponse, variance: Array | None = None) -> list[Resonance]:
    """Return the peaks of every response that stand out and have both half-power points, the 30 clearest of each.

    Parameters
    ----------
    frf : the responses.
    variance : (n_out, n_in, n_freq) of each value; a peak that noise could make up is left out.

    Notes
    -----
    Half-power points by linear interpolation of the squared magnitude. The width between them is 2 zeta f_n.
    """
    spread = None if variance is None else _pooled(variance)
    return [
        resonance
        for o in range(len(frf.outputs))
        for i in range(len(frf.inputs))
        for resonance in _resonances_of(frf, o, i, None if spread is None else spread[o, i])
    ]


def fitted(frf: FrequencyResponse, resonance: Resonance, variance: Array | None = None) -> Resonance:
    """Return a resonance with frequency and damping of a local fit; as it was where the fit fails.

    Parameters
    ----------
    frf : the responses it was found in.
    resonance : of ``find_resonances``.
    variance : (n_out, n_in, n_freq) of each value, for the weights; equal ones if None.

    Notes
    -----
    Around the peak the response is one mode and what the others add: the ratio of a complex polynomial of degree 2 and
    the real s^2 + a1 s + a0, fitted by least squares whose weights are divided by the denominator until it settles
    (Sanathanan and Koerner 1963). A polynomial of degree 4 follows a near neighbour better (0.03 instead of 0.5 % of
    zeta with modes at 40 and 48 Hz), but doubles the scatter that noise gives.
    """
    f = frf.frequencies
    response = frf.response[resonance.output, resonance.input]
    near = np.abs(f - resonance.frequency) <= WIDTHS * resonance.width
    if np.count_nonzero(near) < FEWEST_LINES:
        return resonance
    s = 1j * f[near] / resonance.frequency
    values = response[near] / np.abs(response[near]).max()
    weights = np.ones(len(s))
    if variance is not None:
        weights = 1.0 / np.maximum(_pooled(variance[resonance.output, resonance.input])[near], np.finfo(float).tiny)
    offset = (f[near] - resonance.frequency) / (WIDTHS * resonance.width)
    numerator = offset[:, None] ** np.arange(3)
    denominator = np.ones(len(s), dtype=complex)
    a = np.zeros(2)
    for _ in range(8):
        w = weights / np.abs(denominator)
        # (s^2 + a1 s + a0) G = b(s), split in real and imaginary parts as the a are real and the b are not.
        columns = np.hstack([(s * values)[:, None], values[:, None], -numerator, -1j * numerator]) * w[:, None]
        right = -(s**2) * values * w
        solution = np.linalg.lstsq(
            np.vstack([columns.real, columns.imag]), np.concatenate([right.real, right.imag]), rcond=None
        )[0]
        a = solution[:2]
        denominator = s**2 + a[0] * s + a[1]
        # Exact data can put the pole on a line; a weight without bound would then see that line only.
        denominator = np.maximum(np.abs(denominator), 1e-9)
    if a[1] <= 0 or a[0] <= 0:
        return resonance
    natural = float(np.sqrt(a[1]))
    frequency, ratio = natural * resonance.frequency, float(a[0]) / (2 * natural)
    if abs(frequency - resonance.frequency) > resonance.width or ratio > 1.0:
        return resonance
    return replace(resonance, frequency=frequency, damping_ratio=ratio, fitted=True)


def distinct(resonances: list[Resonance]) -> list[Resonance]:
    """Return one of those that several responses show at the same frequency: the one that stands out most."""
    kept: list[Resonance] = []
    for resonance in sorted(resonances, key=lambda r: -r.prominence):
        if not any(same(resonance, other) for other in kept):
            kept.append(resonance)
    return sorted(kept, key=lambda r: r.frequency)


def same(one: Resonance, other: Resonance) -> bool:
    """Tell whether two peaks are less than half a width apart: one resonance in two responses."""
    return abs(one.frequency - other.frequency) < 0.5 * max(one.width, other.width)


def _pooled(variance: Array) -> Array:
    mean = scipy.ndimage.uniform_filter1d(variance, POOLED_LINES, axis=-1, mode="nearest")
    pooled: Array = np.sqrt(np.maximum(mean, 0.0))  # its running sum may end below zero by rounding
    return pooled


def _resonances_of(frf: FrequencyResponse, output: int, input_: int, spread: Array | None) -> list[Resonance]:
    frequencies, magnitude = frf.frequencies, np.abs(frf.response[output, input_])
    tops, _ = scipy.signal.find_peaks(magnitude)
    heights = scipy.signal.peak_prominences(magnitude, tops)[0]
    found = []
    for top, height in zip(tops, heights, strict=True):
        peak = magnitude[top]
        bottom = max(peak - height, np.finfo(float).tiny)
        if peak < PROMINENCE * bottom or (spread is not None and not spread[top] < UNCERTAIN * peak):
            continue
        left = _crossing(frequencies[top::-1], magnitude[top::-1] ** 2, 0.5 * peak**2)
        right = _crossing(frequencies[top:], magnitude[top:] ** 2, 0.5 * peak**2)
        if left is not None and right is not None:
            width, frequency = right - left, float(frequencies[top])
            found.append(Resonance(frequency, width / (2 * frequency), width, float(peak / bottom), output, input_))
    clearest = sorted(found, key=lambda r: -r.prominence)[:MOST]
    return sorted(clearest, key=lambda r: r.frequency)


def _crossing(frequencies: Array, power: Array, level: float) -> float | None:
    below = power < level
    if not below.any():
        return None
    k = int(below.argmax())
    fraction = (power[k - 1] - level) / (power[k - 1] - power[k])
    return float(frequencies[k - 1] + fraction * (frequencies[k] - frequencies[k - 1]))
