"""``ibsdyn reduce``: an FE export and its interfaces in, a reduced body for models out."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import fem_import as fi
from ibsdyn.cli.import_part import add_export, read_export
from ibsdyn.cli.outcome import FINE, REMARKS, Outcome
from ibsdyn.cli.output_file import output_file
from ibsdyn.errors import ModelError

NAME = "reduce"
SUMMARY = "reduce an FE export to its interfaces and the modes below a cut-off"
EXAMPLES = """\
example:
  ibsdyn reduce flexure.inp --interface base=BASE tip=TIP --max-frequency 2000 --save flexure.npz
  ibsdyn reduce flexure.inp --interface base=BASE tip=12,13,14,15 --sensor probe=77 --max-frequency 2000 --check
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_export(parser)
    parser.add_argument(
        "--interface", nargs="+", required=True, metavar="NAME=NODES", help="a node set, or labels as 12,13,14"
    )
    parser.add_argument("--sensor", nargs="+", default=[], metavar="NAME=NODES", help="points that are watched only")
    parser.add_argument("--max-frequency", type=float, required=True, metavar="HZ", help="1.5 times what you need")
    parser.add_argument("--tie", default="rigid", help="rigid (default) or average")
    parser.add_argument("--method", default="craig-bampton", help="craig-bampton (default), craig-chang or guyan")
    parser.add_argument("--cache", type=Path, metavar="FOLDER", help="keep the result by the content of the input")
    parser.add_argument("--check", action="store_true", help="compare with the modes of the full part")
    parser.add_argument(
        "--save", type=output_file([".npz"]), metavar="FILE.npz", help="write the body, to be named in a model file"
    )


def run(given: argparse.Namespace) -> Outcome:
    """Reduce; raises ModelError for interfaces that are none, and what reading and reducing raise."""
    part = read_export(given)
    if isinstance(part, fi.ReducedBody):
        raise ModelError(f"{given.export} is a superelement, reduced already; name it in a model file as it is.")
    body = fi.reduce(
        part,
        _nodes(given.interface, "--interface"),
        given.max_frequency,
        tie=given.tie,
        method=given.method,
        sensors=_nodes(given.sensor, "--sensor"),
        cache=given.cache,
    )
    text, data = (
        str(body),
        {
            "mass [kg]": body.mass,
            "coordinates": body.coordinates,
            "frequencies [Hz]": body.frequencies,
            "trusted_frequency [Hz]": body.trusted_frequency,
            "findings": body.findings,
        },
    )
    if given.check:
        found = fi.mode_check(part, body)
        text += f"\n\n{found}"
        data |= {"full [Hz]": found.full, "tied [Hz]": found.tied, "reduced [Hz]": found.reduced}
    if given.save is not None:
        body.save(given.save)
        text += f"\n\nwrote {given.save}"
    return Outcome(text, data, REMARKS if body.findings else FINE)


def _nodes(pairs: Sequence[str], option: str) -> dict[str, str | list[int]]:
    chosen: dict[str, str | list[int]] = {}
    for pair in pairs:
        name, equals, nodes = pair.partition("=")
        if not equals or not name or not nodes:
            raise ModelError(f"{option} {pair}: give NAME=SET or NAME=LABELS, as tip=TIP or tip=12,13,14.")
        labels = nodes.split(",")
        chosen[name] = [int(label) for label in labels] if all(label.strip().isdecimal() for label in labels) else nodes
    return chosen
