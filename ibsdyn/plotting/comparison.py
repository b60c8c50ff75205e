"""Model and test over frequency with the test's region and its coherence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ibsdyn.identification.frf_estimate import FrfEstimate
from ibsdyn.plotting.bode import plain_hertz, plot_bode
from ibsdyn.plotting.frf_estimate import shade

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.comparison import Comparison


def plot_comparison(comparison: Comparison, axes: Sequence[Axes] | np.ndarray | None) -> np.ndarray:
    """Draw every response; see ``Comparison.plot``."""
    test, model = comparison.test, comparison.model
    n_out, n_in = len(test.outputs), len(test.inputs)
    rows = 3 if isinstance(test, FrfEstimate) else 2
    grid = _new_axes(n_out, n_in, rows) if axes is None else np.asarray(axes, dtype=object)
    if grid.shape != (rows * n_out, n_in):
        raise ValueError(f"axes has the shape {grid.shape}; these responses need {(rows * n_out, n_in)}.")
    bode = grid[[row for row in range(rows * n_out) if row % rows < 2]]
    plot_bode(test, bode, "test", color="tab:red", linewidth=1.0)
    plot_bode(model, bode, "model", color="black", linestyle="--", linewidth=1.2)
    for o in range(n_out):
        for i in range(n_in):
            magnitude, phase = bode[2 * o, i], bode[2 * o + 1, i]
            if isinstance(test, FrfEstimate) and comparison.confidence is not None:
                shade(test, o, i, magnitude, phase, "tab:red", comparison.confidence)
            magnitude.legend(loc="best", fontsize="small")
            if isinstance(test, FrfEstimate):
                panel = grid[rows * o + 2, i]
                panel.semilogx(test.frequencies, test.coherence[o], color="tab:red", linewidth=1.0)
                panel.set_ylim(0, 1.05)
                panel.set_ylabel("coherence [-]" if n_in == 1 else "multiple\ncoherence [-]")
                panel.grid(True, which="both", alpha=0.25, linewidth=0.5)
                plain_hertz(panel)
                phase.set_xlabel("")
                panel.set_xlabel("frequency [Hz]")
    return grid


def _new_axes(n_out: int, n_in: int, rows: int) -> np.ndarray:
    import matplotlib.pyplot as plt

    figure, grid = plt.subplots(
        rows * n_out,
        n_in,
        sharex=True,
        squeeze=False,
        figsize=(4.0 + 3.8 * n_in, 1.0 + (5.4 if rows == 3 else 4.2) * n_out),
        height_ratios=[3, 1.5, 1][:rows] * n_out,
        layout="constrained",
    )
    figure.align_ylabels()
    return np.asarray(grid, dtype=object)
