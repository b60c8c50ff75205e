"""Figures that a command writes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from ibsdyn.cli.output_file import output_file


def add_plot(parser: argparse.ArgumentParser) -> None:
    """Add the file to which a figure is written."""
    parser.add_argument(
        "--plot", type=_figure_file, metavar="FILE", help="write a figure, as out.png, out.pdf or out.svg"
    )


def write_figure(axes: Any, path: Path) -> None:
    """Write the figure that some axes are in; raises OSError where the file cannot be written."""
    np.ravel(np.asarray(axes, dtype=object))[0].figure.savefig(path, dpi=150)


def _figure_file(text: str) -> Path:
    from matplotlib.backend_bases import FigureCanvasBase  # slow to load, and most calls draw nothing

    return output_file([f".{kind}" for kind in sorted(FigureCanvasBase.get_supported_filetypes())])(text)
