"""``ibsdyn modes``: frequencies, damping ratios, and which part makes each mode."""

from __future__ import annotations

import argparse

from ibsdyn.cli.figures import add_plot, write_figure
from ibsdyn.cli.model_argument import add_model, read_model
from ibsdyn.cli.outcome import Outcome

NAME = "modes"
SUMMARY = "show frequencies, damping, and what strains and moves in each mode"
EXAMPLES = """\
example:
  ibsdyn modes mirror.toml --plot energy.png
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_model(parser)
    add_plot(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Linearise the model; raises what reading and linearising it raise."""
    modes = read_model(given).linearize().modes()
    if given.plot is not None:
        write_figure(modes.plot(), given.plot)
    data = {
        "frequencies [Hz]": modes.frequencies,
        "damping_ratios": modes.damping_ratios,
        "rigid": modes.rigid,
        "strain_energy": dict(modes.strain_energy),
        "kinetic_energy": dict(modes.kinetic_energy),
    }
    return Outcome(str(modes), data)
