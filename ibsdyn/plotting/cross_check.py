"""Nonlinear responses over amplitude beside the linear one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ibsdyn.plotting.bode import plain_hertz

if TYPE_CHECKING:
    from ibsdyn.cross_check import CrossCheck


def plot_cross_check(check: CrossCheck, axes: Sequence[Any] | np.ndarray | None) -> np.ndarray:
    """Draw a cross-check; see ``CrossCheck.plot``."""
    import matplotlib as mpl

    count = len(check.outputs)
    if axes is None:
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(count, 2, squeeze=False, figsize=(11, 0.9 + 3.1 * count), layout="constrained")
        figure.suptitle(f"nonlinear runs beside the linear model: {check.input}")
    grid = np.asarray(axes, dtype=object)
    # From dark to bright, the largest amplitude the brightest that still shows on white.
    colours = mpl.colormaps["plasma"](np.linspace(0.0, 0.85, len(check.amplitudes)))
    for row, (name, unit) in enumerate(zip(check.outputs, check.output_units, strict=True)):
        over_frequency, over_amplitude = grid[row]
        for response, amplitude, colour in zip(check.nonlinear[:, row], check.amplitudes, colours, strict=True):
            if np.isnan(response).any():
                continue  # drawn as a line over the amplitudes
            label = f"{amplitude:.3g} {check.input_unit} RMS"
            over_frequency.loglog(check.frequencies, np.abs(response), color=colour, linewidth=1.0, label=label)
        over_frequency.loglog(check.frequencies, np.abs(check.linear[row]), "k--", linewidth=1.0, label="linear")
        over_frequency.set_ylabel(f"magnitude [({unit})/({check.input_unit})]")
        over_frequency.set_title(name, fontsize="medium")
        over_frequency.set_xlabel("frequency [Hz]")
        plain_hertz(over_frequency)
        over_frequency.legend(fontsize="x-small", loc="best")
        shown = np.isfinite(check.deviation[:, row])
        over_amplitude.loglog(
            check.amplitudes[shown], 100 * check.deviation[shown, row], "o-", markersize=4, linewidth=1.0
        )
        for amplitude in check.amplitudes[~shown]:
            over_amplitude.axvline(amplitude, color="tab:red", linestyle=":", linewidth=1.0, label="no result")
        over_amplitude.axhline(100 * check.tolerance, color="k", linestyle="--", linewidth=0.8)
        if not shown.all():
            over_amplitude.legend(fontsize="x-small", loc="lower right")
        limit = check.holds_up_to[name]
        held = f"linear up to {limit:.3g} {check.input_unit} RMS" if limit else "linear at none of them"
        over_amplitude.set_title(f"{held} (tolerance {100 * check.tolerance:g} %)", fontsize="medium")
        over_amplitude.set_xlabel(f"RMS of the excitation [{check.input_unit}]")
        over_amplitude.set_ylabel("deviation [% of the peak]")
        for panel in (over_frequency, over_amplitude):
            panel.grid(True, which="both", alpha=0.25, linewidth=0.5)
    return grid
