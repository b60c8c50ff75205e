"""``ibsdyn history``: what each revision of a model predicts against each requirement."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from ibsdyn.cli.figures import add_plot, write_figure
from ibsdyn.cli.outcome import FINE, REMARKS, Outcome
from ibsdyn.errors import ModelError
from ibsdyn.history import History
from ibsdyn.history.revision import Revision
from ibsdyn.model import Model

NAME = "history"
SUMMARY = "record what a revision of a model predicts, show all, or compare two"
EXAMPLES = """\
example:
  ibsdyn history mirror.history --record mirror.toml --note "stiffer mount"
  ibsdyn history mirror.history --plot history.png
  ibsdyn history mirror.history --diff 3 5
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("history", type=Path, help="the file, as mirror.history; the first --record makes it")
    parser.add_argument("--record", type=Path, metavar="MODEL", help="evaluate a model file and keep the result")
    parser.add_argument("--note", default="", help="what changed, with --record")
    parser.add_argument("--revision", metavar="NAME", help="its name, with --record; its number if left out")
    parser.add_argument("--diff", nargs=2, metavar=("BEFORE", "AFTER"), help="what changed between two revisions")
    add_plot(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Record, compare or show; raises ModelError for a history that is not there, and what these raise."""
    if given.record is None and not given.history.is_file():
        raise ModelError(f"{given.history} does not exist; --record MODEL makes it.")
    history = History(given.history)
    if given.record is not None:
        revision = history.record(Model.from_toml(given.record), note=given.note, revision=given.revision)
        return Outcome(str(revision), _data(revision), FINE if revision.met else REMARKS)
    if given.plot is not None:
        write_figure(history.plot(), given.plot)
    if given.diff is not None:
        difference = history.diff(*given.diff)
        data = {
            "changed": {change.address: [change.before, change.after] for change in difference.changed},
            "appeared": difference.appeared,
            "vanished": difference.vanished,
            "effects": {effect.name: {"total": effect.total, **effect.contributions} for effect in difference.effects},
            "notes": difference.notes,
        }
        return Outcome(str(difference), data)
    revisions = history.revisions
    met = not revisions or revisions[-1].met
    return Outcome(str(history), {"revisions": [_data(each) for each in revisions]}, FINE if met else REMARKS)


def _data(revision: Revision) -> dict[str, object]:
    return {
        "revision": revision.name,
        "date": revision.date,
        "note": revision.note,
        "fidelity": revision.fidelity,
        "input_hash": revision.input_hash,
        "versions": revision.versions,
        "requirements": [asdict(result) for result in revision.results],
    }
