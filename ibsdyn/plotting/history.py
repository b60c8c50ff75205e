"""Predicted performance against revision, and what single changes did to it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ibsdyn.errors import AnalysisError, HistoryError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.history.difference import Difference, Effect
    from ibsdyn.history.revision import RecordedResult, Revision

MET, NOT_MET, QUIET = "#1a7f4b", "#b42318", "#5b6b7b"
# Values further apart than this factor are drawn on a logarithmic axis.
DECADES = 30.0
# Width of a letter [inch], and of the panel in shares of the figure.
LETTER, PANEL_SHARE = 0.085, 0.85
MOST_BARS = 12


def plot_history(revisions: Sequence[Revision], axes: Sequence[Axes] | np.ndarray | None, title: str) -> np.ndarray:
    """Draw revisions; see ``History.plot``."""
    if not revisions:
        raise HistoryError(f"{title}: no revision is recorded yet; history.record(model) records one.")
    names = list(dict.fromkeys(result.name for revision in revisions for result in revision.results))
    if not names:
        raise HistoryError(f"{title}: no revision has a requirement; add some by model.add_requirement(...).")
    panels = _new_panels(len(names), len(revisions), title) if axes is None else np.asarray(axes, dtype=object)
    for panel, name in zip(panels, names, strict=True):
        found: list[tuple[int, RecordedResult]] = []
        for place, revision in enumerate(revisions):
            found += [(place, result) for result in revision.results if result.name == name]
        _draw_requirement(panel, name, found)
        panel.set_xlim(-0.5, len(revisions) - 0.5)
        panel.set_xticks(range(len(revisions)), _texts(revisions, float(panel.figure.get_size_inches()[0])))
    panels[-1].set_xlabel("revision, fidelity")
    return panels


def _texts(revisions: Sequence[Revision], width: float) -> list[str]:
    """Return what stands under each revision; where they would run into each other, every second, third, ... only."""
    longest = max(len(words) for each in revisions for words in (each.name, each.fidelity))
    every = max(1, math.ceil(len(revisions) * (LETTER * longest + 0.1) / (PANEL_SHARE * width)))
    last = len(revisions) - 1  # the latest revision is always named
    return [
        f"{each.name}\n{each.fidelity}" if (last - place) % every == 0 else "" for place, each in enumerate(revisions)
    ]


def _draw_requirement(panel: Axes, name: str, found: Sequence[tuple[int, RecordedResult]]) -> None:
    places = [place for place, _ in found]
    values = np.array([result.value for _, result in found])
    panel.plot(places, values, color=QUIET, linewidth=1.0, zorder=1)
    for met, colour, marker, words in ((True, MET, "o", "met"), (False, NOT_MET, "X", "not met")):
        chosen = [i for i, (_, result) in enumerate(found) if result.met == met and not math.isnan(result.value)]
        if chosen:
            panel.scatter(
                [places[i] for i in chosen], values[chosen], color=colour, marker=marker, s=60, zorder=3, label=words
            )
    for place, result in found:  # a limit belongs to its revision: it may have been changed on the way
        label = f"limit ({'at most' if result.sense == '<=' else 'at least'})" if place == places[0] else None
        panel.plot(
            [place - 0.5, place + 0.5], [result.limit] * 2, color="k", linestyle="--", linewidth=1.2, label=label
        )
        if math.isnan(result.value):
            panel.annotate("no value", (place, result.limit), ha="center", va="bottom", fontsize="small", color=NOT_MET)
    unit = found[-1][1].unit
    panel.set_title(name, fontsize="medium", loc="left")
    panel.set_ylabel(f"[{unit}]")
    drawn = np.abs([*values[np.isfinite(values)], *(result.limit for _, result in found)])
    if drawn.min() > 0 and drawn.max() > DECADES * drawn.min():
        panel.set_yscale("log")
    else:
        panel.margins(y=0.2)
    panel.grid(alpha=0.3)
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize="small", frameon=False)


def plot_difference(difference: Difference, axes: Sequence[Axes] | np.ndarray | None) -> np.ndarray:
    """Draw the effects of changes; see ``Difference.plot``."""
    effects = [effect for effect in difference.effects if not math.isnan(effect.total)]
    if not effects:
        raise AnalysisError(
            f"revisions {difference.before.name!r} and {difference.after.name!r} have no requirement in common that "
            "both have a value for."
        )
    if axes is None:
        import matplotlib.pyplot as plt

        bars = [len(_bars(effect)) for effect in effects]
        figure, grid = plt.subplots(
            len(effects),
            1,
            squeeze=False,
            figsize=(9, 1.0 + sum(0.6 + 0.32 * count for count in bars)),
            height_ratios=[count + 2 for count in bars],
            layout="constrained",
        )
        figure.suptitle(f"From revision {difference.before.name} to {difference.after.name}")
        axes = grid[:, 0]
    panels = np.asarray(axes, dtype=object)
    for panel, effect in zip(panels, effects, strict=True):
        _draw_effect(panel, effect)
    return panels


def _bars(effect: Effect) -> list[tuple[str, float]]:
    known = {address: value for address, value in effect.contributions.items() if value and not math.isnan(value)}
    ranked = sorted(known.items(), key=lambda pair: -abs(pair[1]))
    bars = ranked[:MOST_BARS]
    if len(ranked) > MOST_BARS:
        bars.append((f"{len(ranked) - MOST_BARS} smaller changes", sum(value for _, value in ranked[MOST_BARS:])))
    rest = effect.remainder
    if abs(rest) > 1e-9 * abs(effect.total) or not bars:
        bars.append(("together or by structure" if known else "all changes", rest))
    return bars


def _draw_effect(panel: Axes, effect: Effect) -> None:
    assert effect.before is not None  # an effect with a total has both
    assert effect.after is not None
    bars = _bars(effect)
    position = effect.before.value
    ends = [effect.before.value, effect.after.value]
    for row, (_, value) in enumerate(bars):
        # Green is towards the limit's good side, whichever way the limit asks.
        good = (value < 0) == (effect.after.sense == "<=")
        panel.barh(row, value, left=position, color=MET if good else NOT_MET, height=0.7)
        panel.plot([position + value] * 2, [row - 0.35, row + 1.35], color=QUIET, linewidth=0.8)
        position += value
        ends.append(position)
    panel.axvline(effect.before.value, color=QUIET, linewidth=1.0, label=f"before: {effect.before.value:.4g}")
    panel.axvline(effect.after.value, color="k", linewidth=1.4, label=f"after: {effect.after.value:.4g}")
    # Bars end at values, not at the frame; a limit that is far away is told, not drawn.
    low, high = float(np.min(ends)), float(np.max(ends))
    span = high - low or abs(high) or 1.0
    limit = effect.after.limit
    if low - 2 * span < limit < high + 2 * span:
        panel.axvline(limit, color="k", linestyle="--", linewidth=1.2, label=f"limit: {limit:.4g}")
        low, high = min(low, limit), max(high, limit)
    else:
        panel.plot([], [], color="k", linestyle="--", linewidth=1.2, label=f"limit: {limit:.4g} (outside)")
    panel.set_xlim(low - 0.08 * (high - low or span), high + 0.08 * (high - low or span))
    panel.set_yticks(range(len(bars)), [label for label, _ in bars], fontsize="small")
    panel.set_ylim(len(bars) - 0.5, -0.5)
    panel.set_title(effect.name, fontsize="medium", loc="left")
    panel.set_xlabel(f"[{effect.after.unit}]")
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize="small", frameon=False)


def _new_panels(count: int, revisions: int, title: str) -> np.ndarray:
    import matplotlib.pyplot as plt

    figure, grid = plt.subplots(
        count,
        1,
        sharex=True,
        squeeze=False,
        figsize=(min(4.5 + 0.9 * revisions, 16), 1.0 + 2.1 * count),
        layout="constrained",
    )
    figure.suptitle(f"Predicted performance: {title}", fontsize="medium")
    return np.asarray(grid[:, 0], dtype=object)
