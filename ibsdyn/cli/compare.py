"""``ibsdyn compare``: records of a test, or of a run, against the model."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from ibsdyn.cli.figures import add_plot, write_figure
from ibsdyn.cli.model_argument import add_model, add_signals, chosen_signals, read_model
from ibsdyn.cli.outcome import FINE, REMARKS, Outcome
from ibsdyn.comparison import compare
from ibsdyn.identification import estimate_frf
from ibsdyn.records.read import read_record

NAME = "compare"
SUMMARY = "estimate responses from measured records and compare the model with them"
EXAMPLES = """\
example:
  ibsdyn compare mirror.toml run*.uff --channels channels.csv --method welch --plot fig7.png
The channels of the records are called as the inputs and sensors of the model file.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_model(parser)
    parser.add_argument("records", nargs="+", type=Path, help="UFF 58, CSV, MAT, NPZ, WAV or HDF5, one a run")
    add_signals(parser)
    parser.add_argument("--channels", type=Path, metavar="FILE", help="a CSV: name, column, unit, scale, sensitivity")
    parser.add_argument(
        "--method", choices=("multisine", "spectral", "welch"), default="multisine", help="default multisine (periodic)"
    )
    parser.add_argument("--band", nargs=2, type=float, metavar=("HZ", "HZ"), help="compare only there")
    parser.add_argument("--confidence", type=float, default=0.99, help="default 0.99")
    parser.add_argument("--least-share", type=float, default=0.95, help="share of lines inside to exit 0")
    parser.add_argument(
        "--allowed", type=float, default=0.01, help="or largest deviation, in shares of the peak; default 0.01"
    )
    add_plot(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Estimate and compare; raises what reading, estimating and comparing raise."""
    model = read_model(given)
    inputs, sensors = chosen_signals(model, given)
    records = [read_record(path, channels=given.channels) for path in given.records]
    estimate = estimate_frf(
        records, [signal.name for signal in inputs], [sensor.name for sensor in sensors], method=given.method
    )
    system = model.linearize()
    if given.band is not None:
        estimate = estimate.within(*given.band)
    comparison = compare(system.frf(inputs, sensors, estimate.frequencies), estimate, confidence=given.confidence)
    share = comparison.total_share_inside
    # A run without noise has a region of next to nothing, in which no model lies.
    agree = share >= given.least_share or float(comparison.deviation.max()) <= given.allowed
    if given.plot is not None:
        write_figure(comparison.plot(), given.plot)
    data = {
        "share inside": share,
        "share inside of each": comparison.share_inside,
        "confidence": given.confidence,
        "outputs": estimate.outputs,
        "inputs": estimate.inputs,
        "frac": comparison.frac,
        "largest deviation": comparison.deviation,
        "resonances": [asdict(resonance) for resonance in comparison.resonances],
    }
    text = f"{comparison}\n\n{_verdict(share, float(comparison.deviation.max()), given)}"
    return Outcome(text, data | {"agree": agree}, FINE if agree else REMARKS)


def _verdict(share: float, deviation: float, given: argparse.Namespace) -> str:
    """Say whether model and test agree, and by which of the two measures."""
    if share >= given.least_share:
        return f"they agree: at least {100 * given.least_share:g} % of the values lie inside the region"
    if deviation <= given.allowed:
        return f"they agree: no value is further off than {100 * given.allowed:g} % of the peak"
    return (
        f"they do not agree: fewer than {100 * given.least_share:g} % of the values lie inside the region, and the "
        f"largest deviation is above {100 * given.allowed:g} % of the peak"
    )
