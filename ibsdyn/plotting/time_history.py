"""Channels over time, one panel a unit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.time_record import TimeRecord

# A long record is drawn as the envelope of this many pieces: what the eye sees of a million samples anyway.
_PIECES = 4000


def plot_time_history(record: TimeRecord, axes: Sequence[Axes] | np.ndarray | None, label: str | None) -> np.ndarray:
    """Draw a record; see ``TimeRecord.plot``."""
    units = list(dict.fromkeys(record.units))
    if axes is None:
        import matplotlib.pyplot as plt

        figure, grid = plt.subplots(
            len(units), 1, sharex=True, squeeze=False, figsize=(9, 1.2 + 2.2 * len(units)), layout="constrained"
        )
        figure.suptitle(record.title)
        axes = grid[:, 0]
    panels = np.asarray(axes)
    for panel, unit in zip(panels, units, strict=True):
        for name, values, of_unit in zip(record.names, record.signals, record.units, strict=True):
            if of_unit == unit:
                time, drawn = _envelope(record.time, values)
                panel.plot(time, drawn, linewidth=0.8, label=name if label is None else f"{label}: {name}")
        panel.set_ylabel(f"[{unit}]")
        panel.grid(alpha=0.3)
        panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small")
    panels[-1].set_xlabel("time [s]")
    return panels


def _envelope(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return smallest and largest value of each piece in turn; short records as they are."""
    step = len(values) // _PIECES
    if step < 4:
        return time, values
    whole = len(values) // step * step
    pieces = values[:whole].reshape(-1, step)
    both = np.stack([pieces.min(axis=1), pieces.max(axis=1)], axis=1).ravel()
    return np.repeat(time[:whole:step], 2), both
