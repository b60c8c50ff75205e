"""By how much parameters moved in a fit, and how sure that is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.updating import Fit


def plot_fit(fit: Fit, axes: Axes | None) -> Axes:
    """Draw relative changes, of places those in millimetres; see ``Fit.plot``."""
    if axes is None:
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(figsize=(7.0, 1.4 + 0.4 * max(len(fit.parameters), 2)), layout="constrained")
    place = np.array([unit == "m" for unit in fit.units])
    scale = np.where(place, 1e-3, np.abs(fit.initial) / 100)
    change, spread = (fit.values - fit.initial) / scale, 2 * fit.uncertainties / scale
    known = np.isfinite(spread)
    rows = np.arange(len(change))
    axes.errorbar(change[known], rows[known], xerr=spread[known], fmt="o", color="C0", capsize=3, label="± 2 sigma")
    if not known.all():
        axes.plot(change[~known], rows[~known], "x", color="C3", label="not determined")
    labels = [f"{address} [{'mm' if own else '%'}]" for address, own in zip(fit.parameters, place, strict=True)]
    axes.set_yticks(rows, labels, fontsize="small")
    axes.set_ylim(len(change) - 0.5, -0.5)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_xlabel("change from the first guess")
    axes.set_title(f"{fit.model.name}: fitted parameters", fontsize="medium")
    axes.grid(True, axis="x", alpha=0.25, linewidth=0.5)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small")
    return axes
