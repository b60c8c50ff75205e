"""``ibsdyn new``: a commented model file to start from."""

from __future__ import annotations

import argparse
import importlib.resources
from pathlib import Path

from ibsdyn.cli.outcome import Outcome
from ibsdyn.errors import ModelError

NAME = "new"
SUMMARY = "write a commented model file to start from"
EXAMPLES = """\
example:
  ibsdyn new mirror.toml
  ibsdyn modes mirror.toml
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("path", type=Path, help="the file to write, as mirror.toml")
    parser.add_argument("--force", action="store_true", help="overwrite a file that is there")


def run(given: argparse.Namespace) -> Outcome:
    """Write the file; raises ModelError where one is there already, OSError where it cannot be written."""
    path: Path = given.path
    if path.suffix != ".toml":
        raise ModelError(f"{path}: a model file ends in .toml; write {path.with_suffix('.toml')}.")
    text = importlib.resources.files("ibsdyn").joinpath("starter.toml").read_text(encoding="utf-8")
    try:
        with path.open("w" if given.force else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ModelError(f"{path} is there already; give another name, or --force to overwrite it.") from None
    return Outcome(f"wrote {path}; next: ibsdyn check {path}", {"path": str(path)})
