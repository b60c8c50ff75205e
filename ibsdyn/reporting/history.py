"""Predicted performance by revision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Any

from ibsdyn.history import History
from ibsdyn.reporting.html import Cell, badge, number, paragraph, table

# A logarithmic axis where values lie further apart.
DECADES = 30.0


def history_section(history: History, shown_hash: str) -> str:
    """Return the places of the charts, the table of revisions, and which of them has the input that the page shows."""
    revisions = history.revisions
    if not revisions:
        return paragraph(f"{history.path.name} has no revision yet.", "remark")
    names = list(dict.fromkeys(result.name for revision in revisions for result in revision.results))
    html = ['<div class="small">']
    html += [f'<div><h3>{escape(name)}</h3><div id="history-{n}"></div></div>' for n, name in enumerate(names)]
    html.append("</div><h3>Revisions</h3>")
    rows: list[list[Cell]] = []
    for revision in revisions:
        met = sum(result.met for result in revision.results)
        verdict: Cell = badge(revision.met, f"{met} of {len(revision.results)} met") if revision.results else "–"
        rows.append(
            [revision.name, f"{revision.date:%Y-%m-%d}", revision.fidelity, revision.model, verdict, revision.note]
        )
    head = [
        ("revision", "name"),
        ("date", ""),
        ("fidelity", ""),
        ("model", ""),
        ("requirements", ""),
        ("note", "quiet"),
    ]
    html.append(table(head, rows))
    same = [revision.name for revision in revisions if revision.input_hash == shown_hash]
    if not same:
        words = "The model of this page is none of these revisions: its input differs from all of them."
    elif same[-1] == revisions[-1].name:
        words = f"The model of this page is the last revision, {same[-1]}."
    else:
        words = f"The model of this page is revision {same[-1]}, not the last one, {revisions[-1].name}."
    html.append(paragraph(words, "remark"))
    return "\n".join(html)


def history_data(history: History) -> list[dict[str, Any]]:
    """Return each requirement's values and limits by revision, as the page draws them."""
    revisions = history.revisions
    names = list(dict.fromkeys(result.name for revision in revisions for result in revision.results))
    panels = []
    for name in names:
        found = [(x, r) for x, revision in enumerate(revisions) for r in revision.results if r.name == name]
        values = [abs(r.value) for _, r in found if math.isfinite(r.value)] + [r.limit for _, r in found]
        last = found[-1][1]
        panels.append(
            {
                "name": name,
                "unit": last.unit,
                "ticks": [[x, f"{each.name}\n{each.fidelity}"] for x, each in enumerate(revisions)],
                "x": [x for x, _ in found],
                "y": [r.value if math.isfinite(r.value) else None for _, r in found],
                "met": [r.met for _, r in found],
                "limits": _steps([(x, r.limit) for x, r in found]),
                "limitLabel": f"limit: {'at most' if last.sense == '<=' else 'at least'} {number(last.limit)}",
                "log": min(values) > 0 and max(values) > DECADES * min(values),
            }
        )
    return panels


def _steps(limits: Sequence[tuple[int, float]]) -> list[list[float]]:
    """Join the limits of revisions that follow each other where they are the same: [from, to, limit]."""
    steps: list[list[float]] = []
    for x, limit in limits:
        if steps and steps[-1][1:] == [x - 0.5, limit]:
            steps[-1][1] = x + 0.5
        else:
            steps.append([x - 0.5, x + 0.5, limit])
    return steps
