"""``ibsdyn import``: read an FE export and prove that it is the part that was meant."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

import fem_import as fi
from ibsdyn.cli.outcome import FINE, REMARKS, Outcome
from ibsdyn.errors import ModelError

NAME = "import"
SUMMARY = "read an FE export and show its report: mass, CoG, rigid-body modes, digits"
EXAMPLES = """\
example:
  ibsdyn import flexure.inp                                  (CalculiX)
  ibsdyn import stiff.matrix --units SI                      (Ansys HBMAT)
  ibsdyn import part.op4 --units mm-t-s --with bulk=part.bdf (Nastran)
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_export(parser)


def add_export(parser: argparse.ArgumentParser) -> None:
    """Describe an FE export."""
    parser.add_argument("export", type=Path, help="the export's main file (docs/import.md tells for each program)")
    parser.add_argument("--units", help="SI, mm-t-s, mm-kg-s or in-lbf-s; needed for all but CalculiX")
    parser.add_argument(
        "--with",
        dest="options",
        nargs="+",
        default=[],
        metavar="NAME=FILE",
        help="what else the reader takes, as mapping=stiff.mapping nodes=stiff.cdb dofs=dofs.csv bulk=part.bdf",
    )


def read_export(given: argparse.Namespace) -> fi.FEModel | fi.ReducedBody:
    """Return what the export holds; raises ModelError for options without a value, and what ``fi.read`` raises."""
    options: dict[str, Any] = {} if given.units is None else {"units": given.units}
    for pair in given.options:
        name, equals, value = pair.partition("=")
        if not equals or not name or not value:
            raise ModelError(f"--with {pair}: give NAME=FILE, as nodes=stiff.cdb.")
        options[name] = value
    part: fi.FEModel | fi.ReducedBody = fi.read(given.export, **options)
    return part


def run(given: argparse.Namespace) -> Outcome:
    """Read and report."""
    part = read_export(given)
    if isinstance(part, fi.ReducedBody):
        return Outcome(str(part), {"source": part.source, "mass [kg]": part.mass, "coordinates": part.coordinates})
    report = part.report()
    return Outcome(str(report), asdict(report), REMARKS if report.findings else FINE)
