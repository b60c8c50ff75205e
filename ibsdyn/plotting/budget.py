"""PSD above, cumulative RMS below: the figures of an error budget."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.plotting.bode import plain_hertz, whole_decades
from ibsdyn.psd import PSD, unit_of_psd

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.budget import VibrationBudget

# Sources beyond this many are drawn as one, the smallest ones: more lines cannot be told apart.
MOST_SOURCES = 8
# How far below its peak a PSD is drawn: antiresonances and the ends of bands go down to nothing.
DECADES_SHOWN = 8
# Shares below this are no bar that could be seen.
LEAST_BAR = 5e-4
# Sources below this share of the power would be a line on the axis.
LEAST_SHARE = 1e-9
# Without red, which is the limit's.
_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:pink", "tab:olive", "tab:cyan")
_PREFIXES = {0: "", -3: "m", -6: "µ", -9: "n", -12: "p", -15: "f", 3: "k"}


def plot_psd(psd: PSD, axes: Axes | None, label: str | None) -> Axes:
    """Draw a PSD; see ``PSD.plot``."""
    if axes is None:
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    axes.loglog(psd.frequencies, psd.values, label=psd.title if label is None else label)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(f"PSD, one-sided [{unit_of_psd(psd.unit)}]")
    axes.grid(True, which="both", alpha=0.25, linewidth=0.5)
    plain_hertz(axes)
    whole_decades(axes, psd.values)
    axes.legend(loc="best", fontsize="small")
    return axes


def plot_budget(budget: VibrationBudget, limits: Mapping[int, float], axes: np.ndarray | None) -> np.ndarray:
    """Draw a budget; see ``VibrationBudget.plot``.

    Raises
    ------
    ValueError : ``axes`` has not the shape (2, n_out).
    """
    n_out = len(budget.outputs)
    grid = _new_axes(n_out) if axes is None else np.asarray(axes, dtype=object)
    if grid.shape != (2, n_out):
        raise ValueError(
            f"axes has the shape {grid.shape}; {n_out} outputs need {(2, n_out)}, as an earlier plot() has."
        )
    for o in range(n_out):
        _draw_output(budget, o, limits.get(o), grid[0, o], grid[1, o])
    return grid


def plot_shares(shares: Mapping[str, float], title: str, most: int, axes: Axes | None) -> Axes:
    """Draw shares, the largest first, as horizontal bars; see ``VibrationBudget.plot_shares``."""
    shown = [(name, share) for name, share in shares.items() if abs(share) >= LEAST_BAR][:most]
    if axes is None:
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(figsize=(7.5, 1.4 + 0.34 * max(len(shown), 2)), layout="constrained")
    percent = [100 * share for _, share in shown]
    # What counteracts the rest is set apart.
    bars = axes.barh(
        range(len(shown)), percent, color=["tab:blue" if share >= 0 else "tab:grey" for share in percent], height=0.7
    )
    axes.bar_label(bars, [f"{share:.1f} %" for share in percent], padding=3, fontsize="small")
    axes.set_yticks(range(len(shown)), [name for name, _ in shown])
    axes.invert_yaxis()
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.margins(x=0.15)
    axes.set_xlabel("share of the mean square [%]")
    axes.set_title(title, fontsize="medium")
    return axes


def _draw_output(budget: VibrationBudget, o: int, limit: float | None, density: Axes, cumulative: Axes) -> None:
    rms = float(budget.rms[o])
    factor, unit = _engineering(max(rms, limit or 0.0), budget.units[o])
    f = np.r_[budget.band[0], budget.frequencies, budget.band[1]]
    several = len(budget.sources) > 1
    for name, colour, psd, power, total in _curves(budget, o):
        if psd.any():  # a tone has no density
            density.loglog(budget.frequencies, psd, color=colour, linewidth=1.0, label=name)
        share = f" ({_percent(total / budget.power[o])})" if several else ""
        running = factor * np.sqrt(np.r_[0.0, power, total])
        cumulative.semilogx(f, running, color=colour, linewidth=1.0, label=f"{name}{share}")
    if several:
        if budget.psd[o].any():
            density.loglog(budget.frequencies, budget.psd[o], color="black", linewidth=1.4, label="total")
        running = factor * np.sqrt(np.r_[0.0, budget.cumulative_power[o], budget.power[o]])
        cumulative.semilogx(f, running, color="black", linewidth=1.4, label="total")
    if not budget.psd[o].any():
        density.set_yscale("log")
        density.text(0.5, 0.5, "tones have no density", transform=density.transAxes, ha="center", color="grey")
    verdict = ""
    if limit is not None:
        shown = f"limit {factor * limit:.3g} {unit}"
        cumulative.axhline(factor * limit, color="tab:red", linestyle="--", linewidth=1.2, label=shown)
        verdict = ", met" if rms <= limit else ", NOT MET"
    band = f"{budget.band[0]:.4g} to {budget.band[1]:.4g} Hz"
    density.set_title(f"{budget.outputs[o]}\n{factor * rms:.3g} {unit} RMS (1σ), {band}{verdict}", fontsize="medium")
    density.set_ylabel(f"PSD, one-sided [{unit_of_psd(budget.units[o])}]")
    cumulative.set_ylabel(f"cumulative RMS (1σ) [{unit}]")
    cumulative.set_xlabel("frequency [Hz]")
    cumulative.set_ylim(0.0, 1.08 * factor * max(rms, limit or 0.0) or 1.0)
    _bound_below(density, budget.psd[o])
    for panel in (density, cumulative):
        panel.grid(True, which="both", alpha=0.25, linewidth=0.5)
        panel.set_xlim(*budget.band)
        plain_hertz(panel)
    if several or limit is not None:
        cumulative.legend(loc="best", fontsize="small")


def _curves(budget: VibrationBudget, o: int) -> list[tuple[str, str, Array, Array, float]]:
    """Return name, colour, PSD, cumulative power and power of each source drawn, the largest first."""
    powers = budget.source_power[o]
    order = [int(d) for d in np.argsort(-powers, kind="stable") if powers[d] > LEAST_SHARE * budget.power[o]]
    kept, rest = order[:MOST_SOURCES], order[MOST_SOURCES:]
    curves = [
        (
            budget.sources[d],
            _COLOURS[d % len(_COLOURS)],
            budget.source_psd[o, d],
            budget.source_cumulative[o, d],
            float(powers[d]),
        )
        for d in kept
    ]
    if rest:
        psd, power = (array[o, rest].sum(axis=0) for array in (budget.source_psd, budget.source_cumulative))
        name = budget.sources[rest[0]] if len(rest) == 1 else f"{len(rest)} others"
        curves.append((name, "grey", psd, power, float(powers[rest].sum())))
    return curves


def _engineering(value: float, unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which a value is a number from 1 to 1000."""
    power = 3 * int(np.floor(np.log10(value) / 3)) if value > 0 else 0
    power = int(np.clip(power, min(_PREFIXES), max(_PREFIXES)))
    return 10.0**-power, _PREFIXES[power] + unit


def _bound_below(density: Axes, psd: Array) -> None:
    """Keep the peak in sight where an antiresonance would stretch the axis over dozens of decades."""
    highest = float(psd.max(initial=0.0))
    if highest > 0.0:
        lowest = max(float(psd[psd > 0].min()), highest * 10.0**-DECADES_SHOWN)
        density.set_ylim(lowest / 2, highest * 3)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.01 else "< 1 %"


def _new_axes(n_out: int) -> np.ndarray:
    import matplotlib.pyplot as plt

    figure, grid = plt.subplots(
        2, n_out, sharex="col", squeeze=False, figsize=(2.0 + 5.2 * n_out, 7.0), layout="constrained"
    )
    figure.align_ylabels()
    return np.asarray(grid, dtype=object)
