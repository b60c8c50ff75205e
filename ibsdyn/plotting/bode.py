"""Magnitude and phase over frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.frequency_response import FrequencyResponse


def plot_bode(
    frf: FrequencyResponse, axes: Sequence[Axes] | np.ndarray | None, label: str | None, **line: Any
) -> np.ndarray:
    """Draw every response of ``frf``, ``line`` as matplotlib's Line2D takes it; see ``FrequencyResponse.plot``.

    Raises
    ------
    ValueError : ``axes`` has not the shape (2 n_out, n_in) of these responses.
    """
    n_out, n_in = len(frf.outputs), len(frf.inputs)
    grid = _new_axes(n_out, n_in) if axes is None else np.asarray(axes, dtype=object)
    if grid.shape != (2 * n_out, n_in):
        raise ValueError(
            f"axes has the shape {grid.shape}; {n_out} outputs and {n_in} inputs need {(2 * n_out, n_in)}, as an "
            "earlier plot() of as many returned it."
        )
    for o in range(n_out):
        for i in range(n_in):
            magnitude, phase = grid[2 * o, i], grid[2 * o + 1, i]
            magnitude.loglog(frf.frequencies, frf.magnitude[o, i], label=label, **line)
            phase.semilogx(frf.frequencies, _drawn_phase(frf.phase[o, i]), label=label, **line)
            magnitude.set_ylabel(f"magnitude [{frf.unit(o, i)}]")
            magnitude.set_title(f"{frf.inputs[i]} → {frf.outputs[o]}", fontsize="medium")
            phase.set_ylabel("phase [°]")
            phase.set_ylim(-190, 190)
            phase.set_yticks([-180, -90, 0, 90, 180])
            phase.set_xlabel("frequency [Hz]")
            for panel in (magnitude, phase):
                panel.grid(True, which="both", alpha=0.25, linewidth=0.5)
                plain_hertz(panel)
                panel.set_xlim(frf.frequencies[frf.frequencies > 0].min(initial=np.inf), frf.frequencies.max())
            if label is not None:
                magnitude.legend(loc="best", fontsize="small")
    return grid


def plain_hertz(panel: Axes) -> None:
    """Label 20, 50, 100, 200 ... rather than powers of ten: resonances are read off this axis."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    panel.xaxis.set_major_locator(LogLocator(base=10, subs=(1.0, 2.0, 5.0)))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda hertz, _: f"{hertz:g}"))
    panel.xaxis.set_minor_formatter(NullFormatter())


def whole_decades(panel: Axes, values: np.ndarray) -> None:
    """Let a logarithmic axis end at powers of ten, which alone carry labels."""
    positive = values[values > 0]
    if positive.size:
        lower, upper = np.floor(np.log10(positive.min())), np.ceil(np.log10(positive.max()))
        panel.set_ylim(10.0**lower, 10.0 ** max(upper, lower + 1))


def _new_axes(n_out: int, n_in: int) -> np.ndarray:
    import matplotlib.pyplot as plt

    figure, grid = plt.subplots(
        2 * n_out,
        n_in,
        sharex=True,
        squeeze=False,
        figsize=(4.5 + 3.5 * n_in, 1.2 + 4.2 * n_out),
        height_ratios=[2, 1] * n_out,
        layout="constrained",
    )
    figure.align_ylabels()
    return np.asarray(grid, dtype=object)


def steady_phase(degrees: np.ndarray) -> np.ndarray:
    """Return a phase [deg] that does not jump between -180 and +180 by rounding.

    Within 0.01 degrees of either they are one: such points go to the side of the nearest point that is further off.
    """
    near = np.abs(degrees) > 179.99
    certain = np.flatnonzero(~near)
    if not len(certain):
        return np.full_like(degrees, -180.0)
    after = np.clip(np.searchsorted(certain, np.arange(len(degrees))), 0, len(certain) - 1)
    before = np.maximum(after - 1, 0)
    places = np.arange(len(degrees))
    nearest = np.where(np.abs(certain[after] - places) <= np.abs(certain[before] - places), after, before)
    return np.where(near, np.copysign(np.abs(degrees), degrees[certain[nearest]]), degrees)


def _drawn_phase(degrees: np.ndarray) -> np.ndarray:
    """Break the line where the phase wraps."""
    drawn = steady_phase(degrees)
    jumps = np.abs(np.diff(drawn, prepend=drawn[:1])) > 180
    return np.where(jumps, np.nan, drawn)
