"""The vibration budget: what shakes, what moves, what it comes from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from ibsdyn.budget import VibrationBudget, vibration_budget
from ibsdyn.errors import IbsdynError
from ibsdyn.linear_system import LinearSystem
from ibsdyn.model import Model
from ibsdyn.quantities import RmsResponse
from ibsdyn.reporting.html import ZOOM, Cell, number, paragraph, table, with_unit
from ibsdyn.reporting.packing import packed
from ibsdyn.requirement import Requirement

# Shares of power below this are not told.
SHOWN_SHARE = 0.005
# So many contributions are named.
NAMED = 4
# Points of a curve.
MOST_LINES = 2500
# A limit is drawn up to so many times the RMS.
MOST_ROOM = 5.0


def budget_of(model: Model, system: LinearSystem) -> tuple[VibrationBudget | None, str]:
    """Return the budget of all sensors under all disturbances, or None and why there is none."""
    if not model.disturbances:
        return None, ""
    if not model.sensors:
        return None, "The model has disturbances but no sensors; model.add_sensor(ibs.Sensor(...)) says what they move."
    try:
        disturbances: list[Any] = list(model.disturbances.values())
        return vibration_budget(system, list(model.sensors.values()), disturbances), ""
    except IbsdynError as error:
        return None, f"There is no budget: {error}"


def budget_section(budget: VibrationBudget | None, words: str) -> str:
    """Return RMS and contributions of each sensor, and the places of the charts."""
    if budget is None:
        return paragraph(words, "remark")
    low, high = budget.band
    html = [
        paragraph(f"RMS (one sigma) of each sensor from {number(low)} to {number(high)} Hz, and what it comes from.")
    ]
    rows: list[list[Cell]] = []
    for row, (name, unit) in enumerate(zip(budget.outputs, budget.units, strict=True)):
        shares = [", ".join(_largest(budget.shares(by, row))) for by in ("source", "mode", "part")]
        rows.append([name, with_unit(float(budget.rms[row]), unit), *shares])
    head = [("sensor", "name"), ("RMS", "number"), ("by source", ""), ("by mode", ""), ("by part", "")]
    html.append(table(head, rows))
    if any(share <= -SHOWN_SHARE for row in range(len(rows)) for share in _all_shares(budget, row)):
        html.append(
            paragraph("Shares add up to 100 %; a negative one moves against the others and lessens the RMS.", "remark")
        )
    for row, name in enumerate(budget.outputs):
        html.append(f'<h3>{escape(name)}</h3><div id="budget-{row}"></div>')
    html.append(paragraph(ZOOM, "remark instruction"))
    return "\n".join(html)


def _all_shares(budget: VibrationBudget, row: int) -> list[float]:
    return [share for by in ("source", "mode", "part") for share in budget.shares(by, row).values()]


def _largest(shares: dict[str, float]) -> list[str]:
    named = [f"{name}: {number(100 * share, 3)}\u00a0%" for name, share in shares.items() if abs(share) >= SHOWN_SHARE]
    return named[:NAMED] + ["…"] * (len(named) > NAMED)


def drawn_limits(model: Model, budget: VibrationBudget) -> dict[str, list[Requirement]]:
    """Return by sensor the requirements on the very RMS that the budget's cumulative curve ends in.

    One that allows many times as much is left out: its line would press the curves flat.
    """
    found: dict[str, list[Requirement]] = {}
    rms = dict(zip(budget.outputs, budget.rms, strict=True))
    for requirement in model.requirements.values():
        asked = requirement.quantity
        if not isinstance(asked, RmsResponse) or asked.output.name not in rms:
            continue
        same = asked.output == model.sensors.get(asked.output.name)
        same = same and {cause.name for cause in asked.disturbances} == set(model.disturbances)
        same = same and (asked.band is None or np.allclose(asked.band, budget.band, rtol=1e-9))
        if same and requirement.limit <= MOST_ROOM * rms[asked.output.name]:
            found.setdefault(asked.output.name, []).append(requirement)
    return found


def budget_data(budget: VibrationBudget, limits: Mapping[str, Sequence[Requirement]]) -> list[dict[str, Any]]:
    """Return PSDs and cumulative RMS by source, as the page draws them, with the limits of each sensor's RMS."""
    step = max(1, len(budget.frequencies) // MOST_LINES)
    chosen = np.unique(np.r_[np.arange(0, len(budget.frequencies), step), len(budget.frequencies) - 1])
    found = []
    for row, (name, unit) in enumerate(zip(budget.outputs, budget.units, strict=True)):
        curves = [("all sources", budget.psd[row], budget.cumulative_power[row], True)]
        if len(budget.sources) > 1:
            for place, source in enumerate(budget.sources):
                curves.append((source, budget.source_psd[row, place], budget.source_cumulative[row, place], False))
        found.append(
            {
                "name": name,
                "unit": unit,
                "psdUnit": f"{unit}²/Hz" if unit.isalpha() else f"({unit})²/Hz",
                "x": packed(budget.frequencies[chosen], "f4"),
                "limits": [
                    {
                        "label": f"{each.name}: at {'most' if each.sense == '<=' else 'least'} {number(each.limit)}",
                        "y": each.limit,
                    }
                    for each in limits.get(name, ())
                ],
                "curves": [
                    {
                        "label": label,
                        "total": total,
                        "psd": packed(psd[chosen], "f4"),
                        "cumulative": packed(np.sqrt(np.maximum(power[chosen], 0.0)), "f4"),
                    }
                    for label, psd, power, total in curves
                ],
            }
        )
    return found
