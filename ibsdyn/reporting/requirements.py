"""Requirements: met or not, by how much, in all fidelities."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from ibsdyn.history.revision import RecordedResult
from ibsdyn.reporting.html import Cell, badge, gauge, paragraph, percent, table, with_unit

# So many missed requirements are named in the verdict.
NAMED = 4


def requirement_section(names: Sequence[str], checked: Sequence[Sequence[RecordedResult]]) -> str:
    """Return the verdict, each requirement with its margin, and what other fidelities say (the model\'s own first)."""
    own = checked[0]
    if not own:
        return paragraph(
            "The model has no requirements; model.add_requirement(ibs.Requirement(...)) adds one.", "remark"
        )
    met = sum(result.met for result in own)
    verdict = f"{met} of {len(own)}"
    missed = [result.name for result in own if not result.met]
    words = "requirements met"
    if missed:
        words += f"; not met: {', '.join(missed[:NAMED])}"
        words += f" and {len(missed) - NAMED} more" if len(missed) > NAMED else ""
    cards = [(verdict, words, "bad" if missed else "good")]
    tightest = min((r for r in own if not math.isnan(r.value)), key=_margin, default=None)
    if tightest is not None:
        kind = "good" if tightest.met else "bad"
        cards.append((percent(_margin(tightest)), f"smallest margin: {tightest.name}", kind))
    html = ['<div class="verdicts">']
    html += [
        f'<div class="verdict {k}"><b>{escape(big)}</b><span>{escape(small)}</span></div>' for big, small, k in cards
    ]
    html.append("</div>")
    head = [("requirement", "name"), ("about", "quiet"), ("limit", "number"), ("predicted", "number")]
    head += [("value against limit", ""), ("margin", "number"), ("", "")]
    rows: list[list[Cell]] = []
    for result in own:
        sign = "≤" if result.sense == "<=" else "≥"
        margin = "–" if math.isnan(result.value) else percent(_margin(result))
        rows.append(
            [
                result.name,
                result.quantity,
                f"{sign} {with_unit(result.limit, result.unit)}",
                with_unit(result.value, result.unit),
                gauge(result.value, result.limit, result.sense),
                margin,
                badge(result.met, "" if not math.isnan(result.value) else "no value"),
            ]
        )
    html.append(table(head, rows))
    html += [paragraph(f"{r.name} has no value: {r.problem}", "remark") for r in own if r.problem]
    if any(checked[1:]):
        html.append(_all_fidelities(names, checked))
    return "\n".join(html)


def _margin(result: RecordedResult) -> float:
    share = (result.limit - result.value) / result.limit
    return share if result.sense == "<=" else -share


def _all_fidelities(names: Sequence[str], checked: Sequence[Sequence[RecordedResult]]) -> str:
    by_name = [{result.name: result for result in each} for each in checked]
    rows: list[list[Cell]] = []
    for name in by_name[0]:
        results = [each.get(name) for each in by_name]
        rows.append(
            [name, *("–" if r is None else f"{with_unit(r.value, r.unit)}{'' if r.met else ' ✗'}" for r in results)]
        )
    return "<h3>By fidelity</h3>" + table([("requirement", "name"), *((name, "number") for name in names)], rows)
