"""Clipped channels: signals that stay at their largest value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibsdyn.axes import Array

# So many equal samples in a row at the extreme: two happen by chance.
_RUN = 3
# A coarse converter stays at its top code too where a slow signal turns, but gets there by single steps of the code.
_STEPS = 3.0


@dataclass(frozen=True)
class FlatTops:
    """Where a signal stands at its extreme: the value, in how many places, how many samples in all."""

    value: float
    places: int
    samples: int


def flat_tops(values: Array) -> FlatTops | None:
    """Return the flat tops of a signal, at its maximum or minimum whichever has more; None where there are none."""
    largest, smallest = float(values.max()), float(values.min())
    if largest == smallest:
        return None  # a constant channel is dead, not clipped
    steps = np.abs(np.diff(values))
    resolution = float(steps[steps > 0.0].min())
    found = [tops for extreme in (largest, smallest) if (tops := _at(values, extreme, _STEPS * resolution)) is not None]
    return max(found, key=lambda tops: tops.samples, default=None)


def _at(values: Array, extreme: float, coarse: float) -> FlatTops | None:
    edges = np.diff(np.concatenate([[0], (values == extreme).astype(np.int8), [0]]))
    begins, ends = np.nonzero(edges == 1)[0], np.nonzero(edges == -1)[0]
    flat = ends - begins >= _RUN
    begins, ends = begins[flat], ends[flat]
    if not len(begins):
        return None
    before = np.abs(values[np.maximum(begins - 1, 0)] - extreme)
    after = np.abs(values[np.minimum(ends, len(values) - 1)] - extreme)
    if np.maximum(before, after).max() <= coarse:
        return None
    return FlatTops(extreme, len(begins), int((ends - begins).sum()))
