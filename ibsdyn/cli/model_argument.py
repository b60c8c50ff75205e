"""The model file that most commands begin with, and the signals named in it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from ibsdyn.errors import ModelError, UnknownNameError, nearest
from ibsdyn.model import Model
from ibsdyn.signals import Input, Output

Entry = TypeVar("Entry")


def add_model(parser: argparse.ArgumentParser) -> None:
    """Add the model file as the first argument."""
    parser.add_argument("model", type=Path, help="a model file, as mirror.toml")


def read_model(given: argparse.Namespace) -> Model:
    """Return the model; raises what ``Model.from_toml`` raises."""
    return Model.from_toml(given.model)


def add_signals(parser: argparse.ArgumentParser) -> None:
    """Add the choice among the inputs and sensors that the model file names."""
    parser.add_argument("--inputs", nargs="+", metavar="NAME", help="inputs of the model file (default: all)")
    parser.add_argument("--outputs", nargs="+", metavar="NAME", help="sensors of the model file (default: all)")


def chosen_signals(model: Model, given: argparse.Namespace) -> tuple[list[Input], list[Output]]:
    """Return the inputs and sensors asked for.

    Raises
    ------
    UnknownNameError : a name that the file does not have.
    ModelError : the file names no input or no sensor at all.
    """
    return chosen(model.inputs, given.inputs, "input", given), chosen(model.sensors, given.outputs, "sensor", given)


def chosen(
    known: Mapping[str, Entry], names: Sequence[str] | None, what: str, given: argparse.Namespace
) -> list[Entry]:
    """Return the entries of a model file that were named, or all; raises as ``chosen_signals``."""
    if not known:
        raise ModelError(f"{given.model} names no {what}; add a table [{what}.name] (ibsdyn new shows one).")
    for name in names or ():
        if name not in known:
            raise UnknownNameError(f"{given.model} has no {what} {name!r}. {nearest(name, known)}")
    return [known[name] for name in names or known]
