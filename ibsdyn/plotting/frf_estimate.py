"""An estimated response with its confidence band."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ibsdyn.plotting.bode import plot_bode

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.identification.frf_estimate import FrfEstimate


def plot_frf_estimate(
    estimate: FrfEstimate, axes: Sequence[Axes] | np.ndarray | None, label: str | None, confidence: float
) -> np.ndarray:
    """Draw every response with its band; see ``FrfEstimate.plot``."""
    grid = plot_bode(estimate, axes, label if label is not None else "estimate")
    if not np.all(estimate.degrees_of_freedom > 0):
        return grid  # no variance, no band; the estimate has said so
    for o in range(len(estimate.outputs)):
        for i in range(len(estimate.inputs)):
            shade(estimate, o, i, grid[2 * o, i], grid[2 * o + 1, i], grid[2 * o, i].lines[-1].get_color(), confidence)
            grid[2 * o, i].legend(loc="best", fontsize="small")
    return grid


def shade(
    estimate: FrfEstimate, output: int, input_: int, magnitude: Axes, phase: Axes, color: str, confidence: float
) -> None:
    """Shade the shadow of the confidence circle of one response on its magnitude and phase."""
    one = estimate.select(output, input_)
    frequencies = estimate.frequencies
    low, high = (bound[0, 0] for bound in one.magnitude_bounds(confidence))
    # A logarithmic axis has no zero: a region that reaches it is drawn down to a thousandth of the estimate.
    low = np.maximum(low, 1e-3 * one.magnitude[0, 0])
    limits = magnitude.get_ylim()
    words = f"{100 * confidence:g} % region: circle in the complex plane, F-statistics"
    magnitude.fill_between(frequencies, low, high, color=color, alpha=0.25, linewidth=0, label=words)
    magnitude.set_ylim(limits)
    low, high = (bound[0, 0] for bound in one.phase_bounds(confidence))
    # A phase that scatters about +-180 deg jumps, its band must not: it is drawn unwrapped, and once for each turn
    # that reaches into the panel.
    wrapped = one.phase[0, 0]
    turned = np.unwrap(wrapped, period=360.0) - wrapped
    low, high = low + turned, high + turned
    for turn in range(int(-(high.max() + 180) // 360), int((180 - low.min()) // 360) + 1):
        phase.fill_between(frequencies, low + 360 * turn, high + 360 * turn, color=color, alpha=0.25, linewidth=0)
