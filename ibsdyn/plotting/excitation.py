"""An excitation over time and over frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.excitation import Excitation

# More lines than this are drawn as points: stems would run into each other.
_STEMS = 150


def plot_excitation(excitation: Excitation, axes: Sequence[Axes] | np.ndarray | None, unit: str) -> np.ndarray:
    """Draw an excitation; see ``Excitation.plot``."""
    if axes is None:
        import matplotlib.pyplot as plt

        figure, grid = plt.subplots(2, 1, squeeze=False, figsize=(9, 5.5), layout="constrained")
        figure.suptitle(excitation.name)
        axes = grid[:, 0]
    over_time, over_frequency = np.asarray(axes)
    time = np.arange(excitation.n_samples) / excitation.sample_rate
    suffix = f" [{unit}]" if unit else ""
    whole = "one period" if excitation.is_periodic else "all of it"
    size_in_words = f"RMS {excitation.rms:.3g}{f' {unit}' if unit else ''}, crest factor {excitation.crest_factor:.2f}"
    over_time.plot(time, excitation.samples, linewidth=0.8)
    over_time.set_title(f"{whole}: {size_in_words}", loc="right", fontsize="small")
    over_time.set_xlabel("time [s]")
    over_time.set_ylabel(f"signal{suffix}")
    size = np.abs(excitation.spectrum)
    if excitation.is_periodic:
        numbers = excitation.line_numbers
        frequencies, drawn = numbers * excitation.resolution, size[numbers]
        if len(numbers) <= _STEMS:
            over_frequency.vlines(frequencies, 0.0, drawn, linewidth=0.8)
        over_frequency.plot(frequencies, drawn, "o", markersize=2.5)
        over_frequency.set_title(f"{len(numbers)} lines", loc="right", fontsize="small")
        over_frequency.set_ylabel(f"amplitude of a line{suffix}")
        over_frequency.set_ylim(bottom=0.0)
    else:
        # A one-sided periodogram: what a PSD of the whole record is before averaging.
        density = size**2 / (2.0 * excitation.resolution)
        shown = slice(1, None)
        over_frequency.semilogy(
            (np.arange(len(size)) * excitation.resolution)[shown],
            np.maximum(density[shown], 1e-8 * density.max()),
            linewidth=0.5,
        )
        over_frequency.set_title("one-sided periodogram", loc="right", fontsize="small")
        over_frequency.set_ylabel(f"PSD{f' [({unit})²/Hz]' if unit else ''}")
    over_frequency.set_xlabel("frequency [Hz]")
    for panel in (over_time, over_frequency):
        panel.grid(alpha=0.3)
    return np.asarray(axes)
