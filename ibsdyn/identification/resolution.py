"""Whether an estimate resolves the resonances that it shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal

from ibsdyn.axes import Array
from ibsdyn.frequency_response import FrequencyResponse

# A peak must stand out on both sides by this factor to be taken for a resonance, and by more than its region.
PROMINENCE = 2.0


@dataclass(frozen=True)
class Peak:
    """A resonance as one response shows it.

    Attributes
    ----------
    frequency : where the magnitude is largest [Hz].
    width : between the half-power points on either side [Hz].
    magnitude : there, in the response's unit.
    output, input : numbers of the response.
    """

    frequency: float
    width: float
    magnitude: float
    output: int
    input: int

    @property
    def damping_ratio(self) -> float:
        """Half the width over the frequency."""
        return self.width / (2 * self.frequency)


def half_power_peaks(frf: FrequencyResponse, uncertainty: Array | None = None) -> list[Peak]:
    """Return the peaks of every response that stand out and have both half-power points.

    Parameters
    ----------
    frf : the responses.
    uncertainty : (n_out, n_in, n_freq) radius around each value; a peak that it could make up is left out.

    Notes
    -----
    Half-power points by linear interpolation of the squared magnitude. The width between them is 2 zeta f_n.
    """
    peaks = []
    for o in range(len(frf.outputs)):
        for i in range(len(frf.inputs)):
            magnitude = np.abs(frf.response[o, i])
            spread = None if uncertainty is None else uncertainty[o, i]
            peaks += [Peak(*found, output=o, input=i) for found in _peaks_of(frf.frequencies, magnitude, spread)]
    return peaks


def _peaks_of(frequencies: Array, magnitude: Array, spread: Array | None) -> list[tuple[float, float, float]]:
    tops, _ = scipy.signal.find_peaks(magnitude)
    prominences = scipy.signal.peak_prominences(magnitude, tops)[0]
    found = []
    for top, prominence in zip(tops, prominences, strict=True):
        bottom = magnitude[top] - prominence
        if magnitude[top] < PROMINENCE * bottom:
            continue
        if spread is not None and not spread[top] < 0.2 * magnitude[top]:
            continue
        half = 0.5 * magnitude[top] ** 2
        left = _crossing(frequencies[top::-1], magnitude[top::-1] ** 2, half)
        right = _crossing(frequencies[top:], magnitude[top:] ** 2, half)
        if left is not None and right is not None:
            found.append((float(frequencies[top]), right - left, float(magnitude[top])))
    return found


def _crossing(frequencies: Array, power: Array, level: float) -> float | None:
    below = power < level
    if not below.any():
        return None
    k = int(below.argmax())
    fraction = (power[k - 1] - level) / (power[k - 1] - power[k])
    return float(frequencies[k - 1] + fraction * (frequencies[k] - frequencies[k - 1]))
