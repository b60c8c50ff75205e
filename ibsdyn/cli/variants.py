"""Variants of a model as options: tolerances or levels of its parameters, and the study of them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from ibsdyn.cli.output_file import output_file
from ibsdyn.errors import ModelError
from ibsdyn.model import Model
from ibsdyn.quantities import ModeFrequency
from ibsdyn.sampling import Samples, Tolerance, full_factorial, monte_carlo
from ibsdyn.study import Study
from ibsdyn.study_results import StudyResults


def add_variants(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
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


def asks_variants(given: argparse.Namespace) -> bool:
    """Tell whether variants were asked for."""
    return bool(given.normal or given.uniform or given.sweep)


def run_variants(model: Model, given: argparse.Namespace) -> StudyResults:
    """Return the results of the study that the options describe; raises what the study raises."""
    quantities = [ModeFrequency(mode) for mode in range(1, given.modes + 1)]
    return Study(model, _samples(model, given), quantities).run(workers=given.workers, results=given.results)


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
