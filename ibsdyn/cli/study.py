"""``ibsdyn study``: many variants of a model, by tolerances or over levels of parameters."""

from __future__ import annotations

import argparse

import numpy as np

from ibsdyn.cli.figures import add_plot, write_figure
from ibsdyn.cli.model_argument import add_model, read_model
from ibsdyn.cli.outcome import FINE, REMARKS, Outcome
from ibsdyn.cli.variants import add_variants, run_variants

NAME = "study"
SUMMARY = "scatter or sweep parameters and show what that does to the requirements"
EXAMPLES = """\
example:
  ibsdyn study mirror.toml --normal mirror.mass=2% "leaf left.kx=5%" --count 1000 --results study.jsonl
  ibsdyn study mirror.toml --sweep mirror.mass=0.1:0.3:5 --plot sweep.png
Parameters are addressed as component.parameter; ibsdyn study mirror.toml --list shows all of them.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_model(parser)
    add_variants(parser)
    parser.add_argument("--list", action="store_true", help="show the parameters and stop")
    add_plot(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Run the study; raises what reading the file and the study raise."""
    model = read_model(given)
    if given.list:
        parameters = model.parameters()
        wide = max(len(address) for address in parameters)
        return Outcome("\n".join(f"{key:{wide}}  {value:.6g}" for key, value in parameters.items()), parameters)
    results = run_variants(model, given)
    if given.plot is not None:
        write_figure(results.plot(), given.plot)
    # A sweep has no odds: its levels were chosen, not drawn.
    odds = results.odds() if results.study.samples.random else ()
    data = {
        "variants": len(results.values),
        "failed": [str(failure) for failure in results.failed],
        "quantities": results.quantities,
        "units": results.units,
        "nominal": results.nominal,
        "percentiles 5 50 95": {
            name: results.percentiles(name) for name in results.quantities if np.isfinite(results[name]).any()
        },
        "odds": [{"requirement": o.requirement, "share": o.share, "lower": o.lower, "upper": o.upper} for o in odds],
    }
    met = not results.failed and all(each.met == each.calculated for each in odds)
    return Outcome(str(results), data, FINE if met else REMARKS)
