"""Which part makes which mode: shares of strain energy as stacked bars."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.modes import Modes


def plot_strain_energy(modes: Modes, count: int, axes: Axes | None) -> Axes:
    """Draw the first ``count`` elastic modes; see ``Modes.plot``."""
    if axes is None:
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
    elastic = np.flatnonzero(~modes.rigid)[:count]
    bottom = np.zeros(len(elastic))
    places = np.arange(len(elastic))
    for name, share in modes.strain_energy.items():
        axes.bar(places, 100 * share[elastic], bottom=bottom, label=name, width=0.7)
        bottom = bottom + 100 * share[elastic]
    axes.set_xticks(places, [f"{r + 1}\n{modes.frequencies[r]:.4g} Hz" for r in elastic], fontsize="small")
    axes.set_xlabel("mode, frequency [Hz]")
    axes.set_ylabel("share of strain energy [%]")
    axes.set_ylim(0, 100)
    if len(elastic) and modes.strain_energy:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small", title="part")
    return axes
