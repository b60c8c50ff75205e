"""The page: what the model is, what it predicts, and whether that is enough."""

from __future__ import annotations

import base64
import hashlib
import os
from collections.abc import Sequence
from datetime import datetime, timezone
from html import escape
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from fem_import.whole_file import whole_file
from ibsdyn.comparison import Comparison
from ibsdyn.components import FlexibleBody, Inertia1D, RigidBody
from ibsdyn.errors import ReportError, known_keywords
from ibsdyn.history import History
from ibsdyn.history.revision import recorded_results
from ibsdyn.model import Model
from ibsdyn.modes import Modes
from ibsdyn.provenance import fidelity_of, input_hash, versions
from ibsdyn.reporting.budget import budget_data, budget_of, budget_section, drawn_limits
from ibsdyn.reporting.comparison import comparison_section
from ibsdyn.reporting.components import component_tables
from ibsdyn.reporting.history import history_data, history_section
from ibsdyn.reporting.html import ZOOM, Cell, Section, listed, number, paragraph, table
from ibsdyn.reporting.modes import mode_data, mode_section
from ibsdyn.reporting.packing import json_for_script
from ibsdyn.reporting.requirements import requirement_section
from ibsdyn.reporting.responses import comparison_data, default_band, labels, response_data
from ibsdyn.reporting.scene import scene_data
from ibsdyn.reporting.study import study_section
from ibsdyn.resonance_grid import checked_band
from ibsdyn.study_results import StudyResults


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
    study: StudyResults | None = None,
) -> Path:
    """Write one HTML file about a model that opens anywhere, offline, for a design review.

    It shows the requirements and whether they are met, the components with a picture that can be turned, the modes with
    their moving shapes and energies, the frequency responses from ``model.inputs`` to ``model.sensors``, the vibration
    budget under ``model.disturbances``, the test, a study of variants and the history where they are given, and what
    all of it came from.

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
    study : results of an ``ibs.Study`` of this model: odds to meet the requirements, scatter, or a sweep.

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
    for value, kind, what in (
        (comparison, Comparison, "comparison"),
        (history, History, "history"),
        (study, StudyResults, "study"),
    ):
        if value is not None and not isinstance(value, kind):
            raise ReportError(f"{what}= must be an ibs.{kind.__name__}, got {value!r}.")
    if study is not None and study.study.model != model:
        raise ReportError(
            f"study= is of another model, {study.study.model.name!r}, or of other parameters of this one."
        )
    for words, what in ((title, "title"), (note, "note")):
        if not isinstance(words, str) and not (words is None and what == "title"):
            raise ReportError(f"{what}= must be a text, got {words!r}.")
    if isinstance(modes, bool) or not isinstance(modes, int) or modes < 1:
        raise ReportError(f"modes= must be a whole number from 1, got {modes!r}.")
    target = _checked_path(path)
    return _write(target, _page(model, others, title or model.name, note, comparison, history, study, modes, band))


def _page(
    model: Model,
    others: Sequence[Model],
    title: str,
    note: str,
    comparison: Comparison | None,
    history: History | None,
    study: StudyResults | None,
    count: int,
    band: Sequence[float] | None,
) -> str:
    models = [model, *others]
    systems = [each.linearize() for each in models]
    names = labels(models, [fidelity_of(each) for each in models])
    shown = systems[0].modes()
    elastic = np.flatnonzero(~shown.rigid)[:count]
    numbers = [int(n) for n in (*np.flatnonzero(shown.rigid), *elastic)]
    limits = default_band(systems[0], count) if band is None else checked_band(band)
    checked = [recorded_results(each, system) for each, system in zip(models, systems, strict=True)]
    named = {name: (each, system) for name, each, system in zip(names, models, systems, strict=True)}
    responses, missing = response_data(named, limits)
    budgets, budget_words = budget_of(model, systems[0])
    data: dict[str, Any] = {
        "scene": scene_data(model, shown, numbers),
        "modes": [mode_data(shown, n) for n in numbers],
        "responses": responses,
        "comparison": None if comparison is None else comparison_data(comparison),
        "budget": None if budgets is None else budget_data(budgets, drawn_limits(model, budgets)),
        "history": None if history is None else history_data(history),
    }
    sections = [
        Section("requirements", "Requirements", requirement_section(names, checked)),
        Section("model", "Model", _model(model)),
        Section("modes", "Modes", mode_section(shown, numbers)),
        Section("responses", "Frequency responses", _responses(responses, missing)),
    ]
    if budgets is not None or model.disturbances:
        sections.append(Section("budget", "Vibration budget", budget_section(budgets, budget_words)))
    if study is not None:
        heading = "Tolerances" if study.study.samples.random else "Variants"
        sections.append(Section("study", heading, study_section(study)))
    if comparison is not None:
        sections.append(Section("test", "Model against test", comparison_section(comparison)))
    if history is not None:
        sections.append(Section("history", "History", history_section(history, input_hash(model))))
    made = datetime.now(timezone.utc)
    sections.append(Section("origin", "Where this comes from", _origin(model, others, names)))
    assets = resources.files("ibsdyn.reporting") / "assets"
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
            f"Made by ibsdyn {versions()['ibsdyn']} on {made:%Y-%m-%d %H:%M} UTC. SI units, frequencies in Hz, "
            "one-sided PSDs, RMS is one sigma."
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
    parts = (
        f"{_counted(len(bodies), 'body', 'bodies')}, {_counted(len(model.connections), 'connection', 'connections')}"
    )
    if model.axis is not None:
        return f"{parts} along {model.axis}{first}"
    mass = sum(item.reduced.mass if isinstance(item, FlexibleBody) else getattr(item, "mass", 0.0) for item in bodies)
    return f"{number(mass)} kg in {parts}{first}"


def _counted(count: int, one: str, several: str) -> str:
    return f"{count} {one if count == 1 else several}"


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


def _responses(responses: dict[str, Any] | None, missing: Sequence[str]) -> str:
    html = []
    if responses is not None:
        html.append('<div class="controls" id="responses-chart-choice"></div><div id="responses-chart"></div>')
        html.append(paragraph(ZOOM, "remark instruction"))
    html += [paragraph(words, "remark") for words in missing]
    return "\n".join(html)


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
        "Linear system about the undeformed state, from Exudyn's Jacobians. Damping ratios of modes are the "
        "strain-energy weighted means of the ratios of the parts. Frequency responses follow exp(+iωt); the motion of "
        "a sensor is absolute unless it is relative to an item."
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
    """Write whole or not at all."""
    try:
        with whole_file(target) as temporary:
            # Half a surrogate pair in a name cannot be written; a question mark is better than no report.
            temporary.write_text(page, encoding="utf-8", errors="replace", newline="\n")
    except OSError as error:
        raise ReportError(f"report: {target} cannot be written: {error.strerror or error}.") from error
    return target
