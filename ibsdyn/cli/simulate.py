"""``ibsdyn simulate``: the nonlinear model in time under a multisine, as a record on disk."""

from __future__ import annotations

import argparse

import numpy as np

from ibsdyn.cli.figures import add_plot, write_figure
from ibsdyn.cli.model_argument import add_model, add_signals, chosen_signals, read_model
from ibsdyn.cli.outcome import Outcome
from ibsdyn.cli.output_file import output_file
from ibsdyn.errors import ExcitationError
from ibsdyn.multisine import band_lines, multisine
from ibsdyn.records.write import SUFFIXES, write_record

NAME = "simulate"
SUMMARY = "run the nonlinear model in time under a multisine on one input and write the record"
EXAMPLES = """\
example:
  ibsdyn simulate mirror.toml --inputs shaker --band 10 400 --amplitude 0.1 --save run.npz
  ibsdyn compare mirror.toml run.npz --inputs shaker --outputs Y1
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_model(parser)
    add_signals(parser)
    parser.add_argument("--band", nargs=2, type=float, required=True, metavar=("HZ", "HZ"), help="excited band")
    parser.add_argument("--resolution", type=float, default=1.0, metavar="HZ", help="distance of the lines, default 1")
    parser.add_argument("--amplitude", type=float, required=True, help="of each line, in the input's unit")
    parser.add_argument("--periods", type=int, default=2, help="default 2; the first may still settle")
    parser.add_argument("--sample-rate", type=float, metavar="HZ", help="default: 2.56 times the band's end, or more")
    parser.add_argument("--seed", type=int, default=0, help="of the random phases")
    parser.add_argument("--gravity", nargs=3, type=float, metavar=("GX", "GY", "GZ"), help="[m/s²], as 0 0 -9.81")
    parser.add_argument(
        "--save", type=output_file(SUFFIXES), metavar="FILE", help="write the record, as run.npz or run.csv"
    )
    add_plot(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Run the model; raises what reading the file, the excitation and the run raise."""
    model = read_model(given)
    inputs, sensors = chosen_signals(model, given)
    if len(inputs) > 1:
        names = ", ".join(repr(signal.name) for signal in inputs)
        raise ExcitationError(f"one input is excited at a time; choose one with --inputs: {names}.")
    first, last = given.band
    lines = band_lines(first, last, given.resolution)
    # A whole number of samples in the period of the lines' distance.
    least = 2.56 * last if given.sample_rate is None else given.sample_rate
    rate = given.resolution * np.ceil(least / given.resolution)
    excitation = multisine(lines, given.amplitude, rate, periods=given.periods, seed=given.seed)
    record = model.simulate({inputs[0]: excitation}, sensors, gravity=given.gravity)
    lines_of_text = [f"{record!r}", f"{'channel':<32} {'RMS':>12} {'largest':>12}  unit"]
    for name, unit, rms, values in zip(record.names, record.units, record.rms, record.signals, strict=True):
        lines_of_text.append(f"{name:<32} {rms:>12.5g} {np.max(np.abs(values)):>12.5g}  {unit}")
    if given.save is not None:
        write_record(record, given.save)
        lines_of_text.append(f"wrote {given.save}")
    if given.plot is not None:
        write_figure(record.plot(), given.plot)
    data = {
        "channels": record.names,
        "units": record.units,
        "sample_rate [Hz]": record.sample_rate,
        "samples": record.n_samples,
        "period": record.period,
        "rms": record.rms,
    }
    return Outcome("\n".join(lines_of_text), data)
