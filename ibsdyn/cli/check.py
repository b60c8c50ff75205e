"""``ibsdyn check``: what is doubtful in a model, and which requirements it meets."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from ibsdyn.cli.model_argument import add_model, read_model
from ibsdyn.cli.outcome import FINE, REMARKS, Outcome

NAME = "check"
SUMMARY = "say what is doubtful in a model and which requirements it meets"
EXAMPLES = """\
example:
  ibsdyn check mirror.toml && echo everything met
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_model(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Check the model; raises what reading and linearising it raise."""
    model = read_model(given)
    findings = [str(finding) for finding in model.check()]
    results = model.check_requirements()
    lines = [f"remark: {finding}" for finding in findings] or ["nothing to remark"]
    lines += [str(result) for result in results] or ["no requirements in the file"]
    fine = not findings and all(result.met for result in results)
    data = {"findings": findings, "requirements": [asdict(result) for result in results]}
    return Outcome("\n".join(lines), data, FINE if fine else REMARKS)
