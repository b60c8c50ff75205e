"""The page: what the model is, what it predicts, and whether that is enough."""

from __future__ import annotations

import base64
import hashlib
import math
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from html import escape
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from ibsdyn.budget import VibrationBudget, vibration_budget
from ibsdyn.comparison import Comparison
from ibsdyn.components import FlexibleBody, Inertia1D, RigidBody
from ibsdyn.errors import IbsdynError, ReportError, known_keywords
from ibsdyn.history import History
from ibsdyn.linear_system import LinearSystem
from ibsdyn.model import Model
from ibsdyn.modes import Modes
from ibsdyn.provenance import fidelity_of, input_hash, versions
from ibsdyn.report.components import component_tables
from ibsdyn.report.html import Cell, Section, badge, gauge, listed, number, paragraph, table, with_unit
from ibsdyn.report.packing import json_for_script, packed
from ibsdyn.report.responses import comparison_data, default_band, labels, response_data
from ibsdyn.report.scene import scene_data

# Shares of energy below this are left out of the bars.
SHOWN_SHARE = 0.005
MOST_BARS = 8
# A logarithmic axis where values lie further apart.
DECADES = 30.0


@dataclass(frozen=True)
class _Checked:
    """A requirement as the page shows it; ``value`` is NaN and ``problem`` says why where it has none."""

    name: str
    quantity: str
    value: float
    limit: float
    sense: str
    unit: str
    met: bool
    problem: str


@known_keywords
def report(
    model: Model,
    path: str | os.PathLike[str],
    title: str | None = None,
    note: str = "",
    fidelities: Model | Sequence[Model] = (),
    comparison: Comparison | None = None,
    history: History | None = None,
    modes: int = 12,
    band: Sequence[float] | None = None,
) -> Path:
    """Write one HTML file about a model that opens anywhere, offline, for a design review.

    It shows the requirements and whether they are met, the components with a picture that can be turned, the modes with
    their moving shapes and energies, the frequency responses from ``model.inputs`` to ``model.sensors``, the vibration
    budget under ``model.disturbances``, the test and the history where they are given, and what all of it came from.

    Parameters
    ----------
    model : what the report is about.
    path : of the file, as ``"review.html"``; written whole or not at all.
    title : heading of the page; the model's name if None.
    note : what the readers should know, shown under the heading.
    fidelities : other models of the same machine, as the 1-D concept; their responses are drawn over the model's, and
        their requirements stand beside it.
    comparison : model against test, from ``ibs.compare``.
    history : from ``ibs.History(path)``.
    modes : how many elastic modes to show, beside the rigid-body modes.
    band : (lower, upper) of the frequency responses [Hz]; from below the first mode to above the last shown if None.

    Returns
    -------
    The path of the file.

    Raises
    ------
    ReportError : an argument that is none, or a path that cannot be written.
    ModelError, EngineError, AnalysisError : the model cannot be calculated.
    """
    others = [fidelities] if isinstance(fidelities, Model) else list(fidelities)
    for each in (model, *others):
        if not isinstance(each, Model):
            raise ReportError(f"report takes ibs.Model, got {each!r}.")
    for value, kind, what in ((comparison, Comparison, "comparison"), (history, History, "history")):
        if value is not None and not isinstance(value, kind):
            raise ReportError(f"{what}= must be an ibs.{kind.__name__}, got {value!r}.")
    for words, what in ((title, "title"), (note, "note")):
        if not isinstance(words, str) and not (words is None and what == "title"):
            raise ReportError(f"{what}= must be a text, got {words!r}.")
    if isinstance(modes, bool) or not isinstance(modes, int) or modes < 1:
        raise ReportError(f"modes= must be a whole number from 1, got {modes!r}.")
    target = _checked_path(path)
    return _write(target, _page(model, others, title or model.name, note, comparison, history, modes, band))


def _page(
    model: Model,
    others: Sequence[Model],
    title: str,
    note: str,
    comparison: Comparison | None,
    history: History | None,
    count: int,
    band: Sequence[float] | None,
) -> str:
    models = [model, *others]
    systems = [each.linearize() for each in models]
    names = labels(models, [fidelity_of(each) for each in models])
    shown = systems[0].modes()
    elastic = np.flatnonzero(~shown.rigid)[:count]
    numbers = [int(n) for n in (*np.flatnonzero(shown.rigid), *elastic)]
    limits = default_band(systems[0], count) if band is None else (float(band[0]), float(band[1]))
    checked = [_checked_requirements(each, system) for each, system in zip(models, systems, strict=True)]
    named = {name: (each, system) for name, each, system in zip(names, models, systems, strict=True)}
    responses, missing = response_data(named, limits)
    budgets, budget_words = _budgets(model, systems[0])
    data: dict[str, Any] = {
        "scene": scene_data(model, shown, numbers),
        "modes": [_mode_data(shown, n) for n in numbers],
        "responses": responses,
        "comparison": None if comparison is None else comparison_data(comparison),
        "budget": None if budgets is None else _budget_data(budgets),
        "history": None if history is None else _history_data(history),
    }
    sections = [
        Section("requirements", "Requirements", _requirements(names, checked)),
        Section("model", "Model", _model(model)),
        Section("modes", "Modes", _modes(shown, numbers)),
        Section("responses", "Frequency responses", _responses(responses, missing, names)),
    ]
    if budgets is not None or model.disturbances:
        sections.append(Section("budget", "Vibration budget", _budget(budgets, budget_words)))
    if comparison is not None:
        sections.append(Section("test", "Model against test", _comparison(comparison)))
    if history is not None:
        sections.append(Section("history", "History", _history(history)))
    made = datetime.now(timezone.utc)
    sections.append(Section("origin", "Where this comes from", _origin(model, others, names)))
    assets = resources.files("ibsdyn.report") / "assets"
    script = "\n".join((assets / name).read_text(encoding="utf-8") for name in ("scene.js", "charts.js", "page.js"))
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    return Template((assets / "page.html").read_text(encoding="utf-8")).substitute(
        title=escape(title),
        kind=escape(f"{fidelity_of(model)} model, prediction of {made:%d %B %Y}"),
        facts=escape(_facts(model, shown)),
        note=f'<p class="note">{escape(note)}</p>' if note else "",
        contents="".join(f'<a href="#{s.anchor}">{escape(s.heading)}</a>' for s in sections),
        sections="\n".join(section.html for section in sections),
        footer=escape(
            f"Made by ibsdyn {versions()['ibsdyn']} on {made:%Y-%m-%d %H:%M} UTC. SI units, frequencies in Hz, one-sided "
            "PSDs, RMS is one sigma."
        ),
        style=(assets / "page.css").read_text(encoding="utf-8"),
        script=script,
        # The browser runs this script only: a text that got past the escaping could still do nothing.
        script_hash=f"sha256-{digest}",
        data=json_for_script(data),
        version=escape(versions()["ibsdyn"]),
    )


def _facts(model: Model, modes: Modes) -> str:
    elastic = np.flatnonzero(~modes.rigid)
    first = f", first mode at {number(float(modes.frequencies[elastic[0]]))} Hz" if len(elastic) else ""
    bodies = [item for item in model.items.values() if isinstance(item, (RigidBody, FlexibleBody, Inertia1D))]
    if model.axis is not None:
        return f"{len(bodies)} bodies, {len(model.connections)} connections along {model.axis}{first}"
    mass = sum(item.reduced.mass if isinstance(item, FlexibleBody) else getattr(item, "mass", 0.0) for item in bodies)
    return f"{number(mass)} kg in {len(bodies)} bodies, {len(model.connections)} connections{first}"


# -- requirements


def _checked_requirements(model: Model, system: LinearSystem) -> list[_Checked]:
    found = []
    for requirement in model.requirements.values():
        quantity = requirement.quantity
        try:
            result = requirement.check(system)
            value, met, problem = result.value, result.met, ""
        except IbsdynError as error:
            value, met, problem = math.nan, False, str(error)
        found.append(
            _Checked(
                requirement.name,
                quantity.name,
                value,
                requirement.limit,
                requirement.sense,
                quantity.unit,
                met,
                problem,
            )
        )
    return found


def _requirements(names: Sequence[str], checked: Sequence[Sequence[_Checked]]) -> str:
    own = checked[0]
    if not own:
        return paragraph(
            "The model has no requirements; model.add_requirement(ibs.Requirement(...)) adds one.", "remark"
        )
    met = sum(result.met for result in own)
    verdict = f"{met} of {len(own)}"
    cards = [(verdict, "requirements met", "good" if met == len(own) else "bad")]
    tightest = min((r for r in own if not math.isnan(r.value)), key=_margin, default=None)
    if tightest is not None:
        kind = "good" if tightest.met else "bad"
        cards.append((f"{100 * _margin(tightest):+.3g} %".replace("-", "−"), f"smallest margin: {tightest.name}", kind))
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
        margin = "–" if math.isnan(result.value) else f"{100 * _margin(result):+.3g} %".replace("-", "−")
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


def _margin(result: _Checked) -> float:
    share = (result.limit - result.value) / result.limit
    return share if result.sense == "<=" else -share


def _all_fidelities(names: Sequence[str], checked: Sequence[Sequence[_Checked]]) -> str:
    by_name = [{result.name: result for result in each} for each in checked]
    rows: list[list[Cell]] = []
    for name in by_name[0]:
        results = [each.get(name) for each in by_name]
        rows.append(
            [name, *("–" if r is None else f"{with_unit(r.value, r.unit)}{'' if r.met else ' ✗'}" for r in results)]
        )
    return "<h3>By fidelity</h3>" + table([("requirement", "name"), *((name, "number") for name in names)], rows)


# -- model and modes


def _model(model: Model) -> str:
    words = "Drag to turn, shift-drag to move; after a click the wheel zooms and the arrow keys turn."
    if model.axis is not None:
        words = f"A 1-D model has no places in space: its parts are lined up along {model.axis}. {words}"
    findings = model.check()
    remarks = "<h3>Remarks of the model check</h3>" + (
        listed(findings) if findings else paragraph("The check of the model has nothing to remark.", "remark")
    )
    return (
        '<div class="view" id="model-view"></div><div class="legend" id="model-legend"></div>'
        + paragraph(words, "remark instruction")
        + component_tables(model)
        + remarks
    )


def _modes(modes: Modes, numbers: Sequence[int]) -> str:
    rows: list[list[Cell]] = []
    for n in numbers:
        error = float(modes.reduction_errors[n])
        rows.append(
            [
                str(n + 1),
                number(float(modes.frequencies[n])),
                number(100 * float(modes.damping_ratios[n]), 3),
                "rigid-body motion" if modes.rigid[n] else _leading(modes.strain_energy, n),
                _leading(modes.kinetic_energy, n),
                "–" if math.isnan(error) or error == 0 else f"{100 * error:.2g} %",
            ]
        )
    head = [("mode", "number"), ("frequency [Hz]", "number"), ("ζ [%]", "number")]
    head += [("strain energy in", ""), ("kinetic energy of", ""), ("raised by reduction", "number")]
    if all(row[-1] == "–" for row in rows):
        head, rows = head[:-1], [row[:-1] for row in rows]
    return (
        '<div class="modes"><div><div class="view" id="mode-view"></div><div class="controls">'
        '<button type="button" id="mode-run">pause</button><label>size of the motion<input id="mode-size" type="range" '
        'min="0" max="3" step="0.05" value="1"></label></div></div><div><h3 id="mode-title" style="margin-top:0"></h3>'
        '<div class="modelist" id="mode-list"></div><h3>Strain energy</h3><div class="bars" id="mode-strain"></div>'
        '<h3>Kinetic energy</h3><div class="bars" id="mode-kinetic"></div></div></div><h3>All modes shown</h3>'
        + table(head, rows)
        + paragraph("Motions are enlarged; each mode is scaled to the same largest motion.", "remark")
    )


def _mode_data(modes: Modes, n: int) -> dict[str, Any]:
    return {
        "number": n + 1,
        "frequency": number(float(modes.frequencies[n])),
        "damping": number(100 * float(modes.damping_ratios[n]), 3),
        "rigid": bool(modes.rigid[n]),
        "strain": _ranked(modes.strain_energy, n),
        "kinetic": _ranked(modes.kinetic_energy, n),
    }


def _ranked(shares: Any, n: int) -> list[tuple[str, float]]:
    ranked = sorted(((name, round(float(share[n]), 5)) for name, share in shares.items()), key=lambda pair: -pair[1])
    return [pair for pair in ranked if pair[1] >= SHOWN_SHARE][:MOST_BARS]


def _leading(shares: Any, n: int) -> str:
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in _ranked(shares, n)[:3])


# -- responses, budget, test


def _responses(responses: dict[str, Any] | None, missing: Sequence[str], names: Sequence[str]) -> str:
    html = []
    if responses is not None:
        html.append('<div class="controls" id="responses-choice"></div><div id="responses"></div>')
        html.append(paragraph(f"{_ZOOM} Models: {', '.join(names)}.", "remark instruction"))
    html += [paragraph(words, "remark") for words in missing]
    return "\n".join(html)


_ZOOM = "Drag across to zoom, double-click for the whole range, click a name to hide its curve."


def _budgets(model: Model, system: LinearSystem) -> tuple[VibrationBudget | None, str]:
    if not model.disturbances:
        return None, ""
    if not model.sensors:
        return None, "The model has disturbances but no sensors; model.add_sensor(ibs.Sensor(...)) says what they move."
    try:
        disturbances: list[Any] = list(model.disturbances.values())
        return vibration_budget(system, list(model.sensors.values()), disturbances), ""
    except IbsdynError as error:
        return None, f"There is no budget: {error}"


def _budget(budget: VibrationBudget | None, words: str) -> str:
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
    for row, name in enumerate(budget.outputs):
        html.append(f'<h3>{escape(name)}</h3><div id="budget-{row}"></div>')
    html.append(paragraph(_ZOOM, "remark instruction"))
    return "\n".join(html)


def _largest(shares: dict[str, float]) -> list[str]:
    return [f"{name} {100 * share:.3g} %" for name, share in list(shares.items())[:3] if abs(share) >= SHOWN_SHARE]


def _budget_data(budget: VibrationBudget) -> list[dict[str, Any]]:
    step = max(1, len(budget.frequencies) // 2500)
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
                "psdUnit": f"({unit})²/Hz",
                "x": packed(budget.frequencies[chosen], "f4"),
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


def _comparison(comparison: Comparison) -> str:
    html = []
    if comparison.confidence is not None:
        share = f"{100 * comparison.total_share_inside:.1f} %"
        html.append(
            paragraph(
                f"{share} of the model's values lie inside the {100 * comparison.confidence:g} % region of the test "
                "(shaded; magnitudes within the radius of the region)."
            )
        )
    html.append('<div class="controls" id="comparison-choice"></div><div id="comparison"></div>')
    rows: list[list[Cell]] = []
    for o, output in enumerate(comparison.model.outputs):
        for i, input_ in enumerate(comparison.model.inputs):
            inside = [] if comparison.inside is None else [f"{100 * comparison.share_inside[o, i]:.1f} %"]
            rows.append(
                [
                    f"{input_} → {output}",
                    *inside,
                    f"{comparison.frac[o, i]:.4f}",
                    f"{100 * comparison.deviation[o, i]:.3g} %",
                ]
            )
    head = [("response", "name"), *([] if comparison.inside is None else [("inside the region", "number")])]
    html.append(table([*head, ("FRAC", "number"), ("largest deviation, of the peak", "number")], rows))
    if comparison.resonances:
        rows = []
        for pair in comparison.resonances:
            cells = [
                "–" if side is None else number(getattr(side, what) * factor)
                for what, factor in (("frequency", 1.0), ("damping_ratio", 100.0))
                for side in (pair.model, pair.test)
            ]
            error = pair.frequency_error
            off = "–" if math.isnan(error) else f"{100 * error:+.2f} %".replace("-", "−")
            rows.append([*cells[:2], off, *cells[2:], f"{pair.input} → {pair.output}"])
        head = [("model [Hz]", "number"), ("test [Hz]", "number"), ("model off by", "number")]
        head += [("ζ model [%]", "number"), ("ζ test [%]", "number"), ("seen in", "quiet")]
        html.append("<h3>Resonances</h3>" + table(head, rows))
    return "\n".join(html)


# -- history and origin


def _history(history: History) -> str:
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
    return "\n".join(html)


def _history_data(history: History) -> list[dict[str, Any]]:
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
                "limits": [[x - 0.5, x + 0.5, r.limit] for x, r in found],
                "limitLabel": f"limit: {'at most' if last.sense == '<=' else 'at least'} {number(last.limit)}",
                "log": min(values) > 0 and max(values) > DECADES * min(values),
            }
        )
    return panels


def _origin(model: Model, others: Sequence[Model], names: Sequence[str]) -> str:
    rows: list[list[Cell]] = [
        [f"input hash of {name} (SHA-256)", input_hash(each)]
        for name, each in zip(names, (model, *others), strict=True)
    ]
    rows += [[f"version of {package}", number_] for package, number_ in versions().items()]
    for item in model.items.values():
        if isinstance(item, FlexibleBody):
            rows.append(
                [f"flexible body {item.name}", f"{item.reduced.source}, {item.reduced.method}, {item.reduced.solver}"]
            )
    words = (
        "Linear system about the undeformed state, from Exudyn's Jacobians. Damping ratios of modes are the strain-energy "
        "weighted means of the ratios of the parts. Frequency responses follow e^{+iωt}; the motion of a sensor is absolute "
        "unless it is relative to an item."
    )
    return table([("what", ""), ("value", "hash")], rows) + paragraph(words, "remark")


# -- the file


def _checked_path(path: str | os.PathLike[str]) -> Path:
    try:
        target = Path(path)
    except TypeError:
        raise ReportError(f"report: path must be that of a file, as 'review.html', got {path!r}.") from None
    if target.is_dir():
        raise ReportError(f"report: {target} is a folder; give the name of a file in it, as {target / 'review.html'}.")
    if not target.parent.is_dir():
        raise ReportError(f"report: the folder {target.parent} does not exist; make it first.")
    return target


def _write(target: Path, page: str) -> Path:
    """Write to a temporary file in the same folder, then put it in place."""
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        try:
            with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
                stream.write(page)
            # A temporary file is private; a report is there to be passed around.
            os.chmod(temporary, 0o644)
            os.replace(temporary, target)
        except BaseException:
            os.unlink(temporary)
            raise
    except OSError as error:
        raise ReportError(f"report: {target} cannot be written: {error.strerror or error}.") from error
    return target
