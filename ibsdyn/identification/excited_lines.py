"""Which harmonics of a periodic excitation are excited, found in the spectra of the inputs."""

from __future__ import annotations

from collections import deque

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError

# An excited line is above this share of the largest excited one near it, which is within NEAR_LINES harmonics or
# NEAR_SHARE of its own; distortions and the skirts of a band are below.
EXCITED, NEAR_LINES, NEAR_SHARE = 1e-2, 8, 0.1
# A band further off is a band of its own if its largest line is above this share of the largest of all; distortions of
# the actuator beyond its band are not.
OTHER_BAND = 0.1
# Power over what scatters between periods: noise alone gets there once in 160 000 lines.
ABOVE_NOISE = 12.0


def excited_lines(amplitudes: Array, scatter: Array | None, shrink: float) -> NDArray[np.bool_]:
    """Return which harmonics are excited in any input of any run.

    Parameters
    ----------
    amplitudes : (runs, n_in, n_harmonics) of mean periods.
    scatter : (n_in, n_harmonics) variance of single periods; None if it is not known.
    shrink : variance of a mean period over that of a single one.
    """
    level = np.sqrt(np.mean(amplitudes**2, axis=0))
    level[:, 0] = 0.0  # a sensor's offset is no excitation
    heard = level > 0
    if scatter is not None:
        # Over few periods single lines scatter little by chance; neighbours see the same noise.
        noise = scipy.ndimage.uniform_filter1d(scatter, 2 * NEAR_LINES + 1, axis=1, mode="nearest")
        heard &= level**2 > ABOVE_NOISE * shrink * noise
    excited = np.zeros(level.shape[1], dtype=np.bool_)
    for row, known in zip(level, heard, strict=True):
        excited |= _grown(row, known)
    return excited


def harmonics_of(frequencies: Array, base: float, length: int) -> NDArray[np.int64]:
    """Return which multiples of ``base`` frequencies are, for a period of ``length`` samples.

    Raises
    ------
    RecordError : one that is no multiple, or not below half the sample rate.
    """
    multiples = frequencies / base
    harmonics = np.rint(multiples).astype(np.int64)
    wrong = (np.abs(multiples - harmonics) > 1e-3) | (harmonics < 1) | (2 * harmonics >= length)
    if wrong.any():
        raise RecordError(
            f"{frequencies[wrong][0]:g} Hz is no line of this excitation: lines are multiples of {base:g} Hz up to "
            f"below {0.5 * base * length:g} Hz."
        )
    return np.unique(harmonics)


def _grown(level: Array, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the bands that grow from the strongest line of each to lines near and nearly as strong.

    Growing, rather than one threshold, follows an acceleration that rises by 100 dB over the band, and still leaves out
    distortions 40 dB below the edge of a flat band.
    """
    grown = np.zeros_like(known)
    places = np.flatnonzero(known)
    left = level.copy()
    left[~known] = 0.0
    largest = float(left.max(initial=0.0))
    while left.max(initial=0.0) > OTHER_BAND * largest or (largest > 0 and not grown.any()):
        seed = int(left.argmax())
        for way in (places[places >= seed], places[places <= seed][::-1]):
            band = _reached(way, level)
            grown[band] = True
            left[band] = 0.0
    return grown


def _reached(places: NDArray[np.int64], level: Array) -> list[int]:
    """Return the lines reached from the first of ``places`` on, until a gap."""
    reached: list[int] = []
    near: deque[tuple[int, float]] = deque()  # excited ones within reach, falling: the first is the largest
    for place in places.tolist():
        while near and abs(place - near[0][0]) > max(NEAR_LINES, NEAR_SHARE * place):
            near.popleft()
        if reached and not near:
            break
        value = float(level[place])
        if not near or value > EXCITED * near[0][1]:
            while near and near[-1][1] <= value:
                near.pop()
            near.append((place, value))
            reached.append(place)
    return reached
