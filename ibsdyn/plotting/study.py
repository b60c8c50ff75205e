"""How a study looks: scatter of random variants beside the limits, curves of sweeps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ibsdyn.axes import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.study_results import StudyResults

MOST_BINS = 60
# Values that differ by less than this share are one.
SAME = 1e-9
# A limit that is further from the values than this many of their spreads is told, not drawn: it would hide the bars.
FAR = 5.0


def plot_study(results: StudyResults, columns: Sequence[int], axes: np.ndarray | Axes | None) -> np.ndarray:
    """Draw some quantities of a study; see ``StudyResults.plot``.

    Raises
    ------
    ValueError : ``axes`` are not as many as the panels.
    """
    random = results.study.samples.random
    rows, wide = len(columns), 1 if random else len(results.study.samples.addresses)
    grid = _new_axes(rows, wide) if axes is None else np.asarray(axes, dtype=object)
    if grid.size != rows * wide:
        raise ValueError(f"axes are {grid.size}, but there are {rows * wide} panels.")
    grid = grid.reshape(rows, wide)
    for row, column in enumerate(columns):
        for place in range(wide):
            if random:
                _histogram(results, column, grid[row, place])
            else:
                _curve(results, column, place, grid[row, place], first=place == 0)
    return grid[:, 0] if random else grid


def _new_axes(rows: int, wide: int) -> np.ndarray:
    import matplotlib.pyplot as plt

    _, grid = plt.subplots(
        rows, wide, figsize=(max(8.5, 1.0 + 3.6 * wide), 0.4 + 3.1 * rows), layout="constrained", squeeze=False
    )
    return np.asarray(grid, dtype=object)


def _histogram(results: StudyResults, column: int, panel: Axes) -> None:
    values = results.values[:, column]
    values = values[np.isfinite(values)]
    if len(values):
        if np.ptp(values) <= SAME * np.abs(values).max():
            # What no parameter moves scatters by rounding; one bar shows it.
            bins = values.mean() + np.array([-0.5, 0.5]) * (0.01 * abs(values.mean()) or 1.0)
        else:
            bins = np.histogram_bin_edges(values, bins="auto")
        if len(bins) > MOST_BINS:
            bins = np.linspace(values.min(), values.max(), MOST_BINS)
        panel.hist(values, bins=bins.tolist(), color="C0", alpha=0.6, edgecolor="white", linewidth=0.4)
        for percent, value in zip((5, 95), np.percentile(values, (5, 95)), strict=True):
            label = "5 % and 95 %" if percent == 5 else None
            panel.axvline(value, color="C0", linestyle=":", linewidth=1.2, label=label)
    panel.axvline(results.nominal[column], color="black", linewidth=1.2, label="nominal")
    odds = {each.requirement: each for each in results.odds()} if len(values) and results.study.requirements else {}
    for number, requirement in enumerate(results.limits(column)):
        share = f", met by {100 * odds[requirement.name].share:.3g} %" if requirement.name in odds else ""
        label = f"{requirement.name}: {requirement.sense} {requirement.limit:.4g}{share}"
        beyond = _beyond(requirement.limit, np.append(values, results.nominal[column]))
        if beyond:
            panel.plot([], [], color=f"C{3 + number}", linestyle="--", linewidth=1.4, label=f"{label} ({beyond})")
        else:
            panel.axvline(requirement.limit, color=f"C{3 + number}", linestyle="--", linewidth=1.4, label=label)
    panel.set_xlabel(_label(results, column))
    panel.set_ylabel("variants")
    panel.set_title(f"{results.study.name}: {len(values)} variants", fontsize="medium")
    # Beside the panel: there is no place in it that no bar reaches.
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small")


def _beyond(limit: float, values: Array) -> str:
    """Return on which side a limit lies far away from some values, empty if near."""
    low, high = float(values.min()), float(values.max())
    reach = FAR * (high - low)
    if reach == 0.0 or low - reach <= limit <= high + reach:
        return ""
    return "far to the left" if limit < low else "far to the right"


def _curve(results: StudyResults, column: int, place: int, panel: Axes, first: bool) -> None:
    samples = results.study.samples
    address = samples.addresses[place]
    values = samples.values[:, place]
    if samples.kind == "one at a time":
        nominal = results.study.model.parameters()
        others = [i for i in range(len(samples.addresses)) if i != place]
        at_nominal = np.array([nominal[samples.addresses[i]] for i in others])
        shown = (samples.values[:, others] == at_nominal).all(axis=1)
        order = np.flatnonzero(shown)[np.argsort(values[shown], kind="stable")]
        panel.plot(values[order], results.values[order, column], marker=".", color="C0")
        panel.plot([nominal[address]], [results.nominal[column]], marker="o", color="black", linestyle="none")
    else:
        # Levels of one parameter are points of a curve; of several they are a cloud over each.
        line = "-" if len(samples.addresses) == 1 else "none"
        order = np.argsort(values, kind="stable")
        panel.plot(values[order], results.values[order, column], marker=".", color="C0", linestyle=line)
    for number, requirement in enumerate(results.limits(column)):
        label = f"{requirement.name}: {requirement.sense} {requirement.limit:.4g}"
        panel.axhline(requirement.limit, color=f"C{3 + number}", linestyle="--", linewidth=1.4, label=label)
        if first:
            panel.legend(loc="best", fontsize="small")
    panel.set_xlabel(address)
    if first:
        panel.set_ylabel(_label(results, column))
    panel.grid(True, alpha=0.25, linewidth=0.5)


def _label(results: StudyResults, column: int) -> str:
    unit = results.units[column]
    return results.quantities[column] + ("" if unit == "-" else f" [{unit}]")
