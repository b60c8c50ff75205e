"""Which parameter moves a quantity most: a tornado chart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.sensitivity_results import Sensitivities


def plot_tornado(sensitivities: Sensitivities, row: int, count: int, axes: Axes | None) -> Axes:
    """Draw the ``count`` most effective parameters; see ``Sensitivities.plot``."""
    effects = {address: effect for address, effect in list(sensitivities.effects(row).items())[:count] if effect}
    if axes is None:
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(figsize=(7.5, 1.4 + 0.33 * max(len(effects), 3)), layout="constrained")
    places = np.arange(len(effects))
    change = np.array(list(effects.values()))
    axes.barh(places, change, color="C0", label="step up", height=0.7)
    axes.barh(places, -change, color="C1", label="step down", height=0.7)
    columns = [sensitivities.parameters.index(address) for address in effects]
    labels = [
        f"{address}  ±{sensitivities.step_words(column)}" for address, column in zip(effects, columns, strict=True)
    ]
    axes.set_yticks(places, labels, fontsize="small")
    axes.invert_yaxis()
    axes.axvline(0.0, color="black", linewidth=0.8)
    unit = sensitivities.quantity_units[row]
    axes.set_xlabel(f"change of {sensitivities.quantities[row]} [{unit}]")
    value = f"{sensitivities.values[row]:.4g}" + ("" if unit == "-" else f" {unit}")
    axes.set_title(f"{sensitivities.quantities[row]}: {value}", fontsize="medium")
    axes.grid(True, axis="x", alpha=0.25, linewidth=0.5)
    if effects:
        axes.legend(loc="best", fontsize="small")
    return axes
