"""``ibsdyn budget``: how much the sensors move under the disturbances of the file, and what makes them move."""

from __future__ import annotations

import argparse

from ibsdyn.budget import VibrationBudget, vibration_budget
from ibsdyn.cli.figures import add_plot, write_figure
from ibsdyn.cli.model_argument import add_model, chosen, read_model
from ibsdyn.cli.outcome import Outcome

NAME = "budget"
SUMMARY = "show the RMS of the sensors under the disturbances of the file, by source, mode and part"
EXAMPLES = """\
example:
  ibsdyn budget mirror.toml --band 1 500 --plot budget.png
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_model(parser)
    parser.add_argument("--outputs", nargs="+", metavar="NAME", help="sensors of the model file (default: all)")
    parser.add_argument("--sources", nargs="+", metavar="NAME", help="disturbances of the file (default: all)")
    parser.add_argument("--band", nargs=2, type=float, metavar=("HZ", "HZ"), help="default: that of the disturbances")
    add_plot(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Compute the budget; raises what reading the file, linearising and the budget raise."""
    model = read_model(given)
    sources = chosen(model.disturbances, given.sources, "disturbance", given)
    sensors = chosen(model.sensors, given.outputs, "sensor", given)
    budget = vibration_budget(
        model.linearize(), sensors, sources, band=None if given.band is None else tuple(given.band)
    )
    if given.plot is not None:
        write_figure(budget.plot(), given.plot)
    return Outcome(str(budget), _data(budget))


def _data(budget: VibrationBudget) -> dict[str, object]:
    outputs = {}
    for output, unit, rms in zip(budget.outputs, budget.units, budget.rms, strict=True):
        shares = {kind: budget.shares(kind, output) for kind in ("source", "mode", "part")}
        outputs[output] = {"rms (one sigma)": rms, "unit": unit, "shares": shares}
    return {"band [Hz]": budget.band, "outputs": outputs}
