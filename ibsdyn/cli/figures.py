"""Figures that a command writes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from ibsdyn.errors import ModelError


def add_plot(parser: argparse.ArgumentParser) -> None:
    """Add the file to which a figure is written."""
    parser.add_argument("--plot", type=Path, metavar="FILE", help="write a figure, as out.png, out.pdf or out.svg")


def write_figure(axes: Any, path: Path) -> None:
    """Write the figure that some axes are in.

    Raises
    ------
    ModelError : a kind of file that matplotlib does not write.
    OSError : the file cannot be written.
    """
    figure = np.ravel(np.asarray(axes, dtype=object))[0].figure
    known = figure.canvas.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in known:
        raise ModelError(f"--plot {path}: a figure is written as one of {', '.join(sorted(known))}.")
    figure.savefig(path, dpi=150)
