"""``ibsdyn report``: one HTML page about a model for the design review."""

from __future__ import annotations

import argparse
from pathlib import Path

from ibsdyn.cli.model_argument import add_model, read_model
from ibsdyn.cli.outcome import FINE, REMARKS, Outcome
from ibsdyn.cli.output_file import output_file
from ibsdyn.cli.variants import add_variants, asks_variants, run_variants
from ibsdyn.errors import ModelError
from ibsdyn.history import History
from ibsdyn.model import Model
from ibsdyn.reporting import report

NAME = "report"
SUMMARY = "write one HTML page for the design review, which opens anywhere, offline"
EXAMPLES = """\
example:
  ibsdyn report mirror.toml
  ibsdyn report mirror.toml --save review.html --concept concept.toml --history mirror.history
  ibsdyn report mirror.toml --normal mirror.mass=2% --count 1000 --results study.jsonl
The last one shows the odds to meet each requirement; it takes the options of ibsdyn study, and what that has written to
--results is not calculated again.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_model(parser)
    parser.add_argument(
        "--save", type=output_file(), metavar="FILE.html", help="default: the model file's name with .html"
    )
    parser.add_argument("--title", help="heading; default the model's name")
    parser.add_argument("--note", default="", help="a sentence under the heading")
    parser.add_argument("--concept", nargs="+", type=Path, default=[], metavar="MODEL", help="other fidelities")
    parser.add_argument("--history", type=Path, metavar="FILE", help="a history, shown as performance over revisions")
    add_variants(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Write the page; raises what reading the files and the report raise."""
    model = read_model(given)
    if given.history is not None and not given.history.is_file():
        raise ModelError(f"--history {given.history} does not exist; ibsdyn history {given.history} --record makes it.")
    path = report(
        model,
        given.model.with_suffix(".html") if given.save is None else given.save,
        title=given.title,
        note=given.note,
        fidelities=[Model.from_toml(other) for other in given.concept],
        history=None if given.history is None else History(given.history),
        study=run_variants(model, given) if asks_variants(given) else None,
    )
    results = model.check_requirements()
    lines = [f"wrote {path}", *(str(result) for result in results)]
    met = all(result.met for result in results)
    return Outcome("\n".join(lines), {"path": str(path), "met": met}, FINE if met else REMARKS)
