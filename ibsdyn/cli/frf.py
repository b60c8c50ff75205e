"""``ibsdyn frf``: frequency responses from the inputs to the sensors of a model file."""

from __future__ import annotations

import argparse

import numpy as np

from ibsdyn.cli.figures import add_plot, write_figure
from ibsdyn.cli.model_argument import add_model, add_signals, chosen_signals, read_model
from ibsdyn.cli.outcome import Outcome
from ibsdyn.cli.output_file import output_file
from ibsdyn.errors import AnalysisError
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.interchange.frf_files import write_frf

NAME = "frf"
SUMMARY = "compute frequency responses from the inputs to the sensors of the file"
EXAMPLES = """\
example:
  ibsdyn frf mirror.toml --from 1 --to 2000 --plot frf.png
  ibsdyn frf mirror.toml --inputs "platform z" --outputs Y1 --save frf.csv
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_model(parser)
    add_signals(parser)
    parser.add_argument("--from", dest="first", type=float, default=1.0, metavar="HZ", help="default 1 Hz")
    parser.add_argument("--to", dest="last", type=float, default=1000.0, metavar="HZ", help="default 1000 Hz")
    parser.add_argument("--points", type=int, default=1000, help="spaced evenly in log frequency, default 1000")
    parser.add_argument("--hysteretic", action="store_true", help="complex stiffness in place of viscous damping")
    parser.add_argument(
        "--save", type=output_file(), metavar="FILE", help="write the responses, as frf.csv, frf.uff or frf.mat"
    )
    add_plot(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Compute the responses; raises AnalysisError for a band that is none, and what linearising raises."""
    if not 0.0 < given.first < given.last < np.inf or given.points < 2:
        raise AnalysisError(
            f"--from {given.first:g} --to {given.last:g} --points {given.points}: give a band that ascends from above "
            "0 Hz and at least 2 points."
        )
    model = read_model(given)
    inputs, sensors = chosen_signals(model, given)
    grid = np.geomspace(given.first, given.last, given.points)
    frf = model.linearize().frf(inputs, sensors, grid, hysteretic=given.hysteretic)
    if given.save is not None:
        write_frf(frf, given.save)
    if given.plot is not None:
        write_figure(frf.plot(), given.plot)
    data = {
        "frequencies [Hz]": frf.frequencies,
        "inputs": frf.inputs,
        "outputs": frf.outputs,
        "units": [[frf.unit(row, column) for column in range(len(frf.inputs))] for row in range(len(frf.outputs))],
        "magnitude": frf.magnitude,
        "phase [deg]": frf.phase,
    }
    return Outcome(_largest(frf), data)


def _largest(frf: FrequencyResponse) -> str:
    lines = [f"{'output':<24} {'input':<28} {'largest':>12}  {'unit':<16} at [Hz]"]
    for row, output in enumerate(frf.outputs):
        for column, name in enumerate(frf.inputs):
            place = int(np.argmax(frf.magnitude[row, column]))
            lines.append(
                f"{output:<24} {name:<28} {frf.magnitude[row, column, place]:>12.5g}  {frf.unit(row, column):<16} "
                f"{frf.frequencies[place]:.5g}"
            )
    return "\n".join(lines)
