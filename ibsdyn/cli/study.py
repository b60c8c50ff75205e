"""``ibsdyn study``: many variants of a model, by tolerances or over levels of parameters."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from ibsdyn.cli.figures import add_plot, write_figure
from ibsdyn.cli.model_argument import add_model, read_model
from ibsdyn.cli.outcome import FINE, REMARKS, Outcome
from ibsdyn.cli.output_file import output_file
from ibsdyn.errors import ModelError
from ibsdyn.model import Model
from ibsdyn.quantities import ModeFrequency
from ibsdyn.sampling import Samples, Tolerance, full_factorial, monte_carlo
from ibsdyn.study import Study

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
    parser.add_argument("--normal", nargs="+", default=[], metavar="ADDRESS=SIGMA", help="one sigma, in %% or in SI")
    parser.add_argument("--uniform", nargs="+", default=[], metavar="ADDRESS=HALF", help="half width, in %% or in SI")
    parser.add_argument("--sweep", nargs="+", default=[], metavar="ADDRESS=A:B:N", help="N levels from A to B")
    parser.add_argument("--count", type=int, default=1000, help="variants of a Monte Carlo, default 1000")
    parser.add_argument("--seed", type=int, default=0, help="same seed, same variants, whatever the workers")
    parser.add_argument("--modes", type=int, default=0, metavar="N", help="keep the first N frequencies too")
    parser.add_argument("--workers", type=int, help="processes; default one a core")
    parser.add_argument(
        "--results", type=output_file(), metavar="FILE", help="keep every result; an interrupted study goes on"
    )
    parser.add_argument("--list", action="store_true", help="show the parameters and stop")
    add_plot(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Run the study; raises what reading the file and the study raise."""
    model = read_model(given)
    if given.list:
        parameters = model.parameters()
        wide = max(len(address) for address in parameters)
        return Outcome("\n".join(f"{key:{wide}}  {value:.6g}" for key, value in parameters.items()), parameters)
    quantities = [ModeFrequency(mode) for mode in range(1, given.modes + 1)]
    results = Study(model, _samples(model, given), quantities).run(workers=given.workers, results=given.results)
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
        "percentiles 5 50 95": {name: results.percentiles(name) for name in results.quantities},
        "odds": [{"requirement": o.requirement, "share": o.share, "lower": o.lower, "upper": o.upper} for o in odds],
    }
    met = not results.failed and all(each.met == each.calculated for each in odds)
    return Outcome(str(results), data, FINE if met else REMARKS)


def _samples(model: Model, given: argparse.Namespace) -> Samples:
    tolerances = [*_tolerances(given.normal, "--normal"), *_tolerances(given.uniform, "--uniform")]
    if bool(tolerances) == bool(given.sweep):
        raise ModelError("give tolerances (--normal, --uniform) or --sweep, as --normal mirror.mass=2%.")
    if tolerances:
        return monte_carlo(model, tolerances, given.count, seed=given.seed)
    levels = {}
    for pair in given.sweep:
        address, text = _split(pair, "--sweep", "ADDRESS=FROM:TO:COUNT, as mirror.mass=0.1:0.3:5")
        words = text.split(":")
        try:
            first, last, count = float(words[0]), float(words[1]), int(words[2])
        except (ValueError, IndexError):
            count = 0
        if len(words) != 3 or count < 1:
            raise ModelError(f"--sweep {pair}: give ADDRESS=FROM:TO:COUNT, as mirror.mass=0.1:0.3:5.")
        levels[address] = np.linspace(first, last, count).tolist()
    return full_factorial(levels)


def _tolerances(pairs: Sequence[str], option: str) -> list[Tolerance]:
    tolerances = []
    for pair in pairs:
        address, text = _split(pair, option, "ADDRESS=VALUE, as mirror.mass=2% or mirror.mass=0.005")
        relative = text.endswith("%")
        try:
            width = float(text.removesuffix("%")) / (100.0 if relative else 1.0)
        except ValueError:
            raise ModelError(f"{option} {pair}: {text!r} is no number and no percentage.") from None
        kind = {"sigma": width} if option == "--normal" else {"plus_minus": width}
        tolerances.append(Tolerance(address, **kind, relative=relative))
    return tolerances


def _split(pair: str, option: str, form: str) -> tuple[str, str]:
    address, equals, text = pair.rpartition("=")
    if not equals or not address or not text:
        raise ModelError(f"{option} {pair}: give {form}.")
    return address, text.strip()
