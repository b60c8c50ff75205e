"""Files that a command writes: refused before the work if they cannot be written after it."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path


def output_file(suffixes: Sequence[str] = ()) -> Callable[[str], Path]:
    """Return the argument type of a file to write.

    suffixes : endings that the writer knows, as ".npz"; none if it tells itself.
    """

    def checked(text: str) -> Path:
        path = Path(text)
        if path.is_dir():
            raise argparse.ArgumentTypeError(f"{path} is a folder; give the name of a file in it")
        if not path.parent.is_dir():
            raise argparse.ArgumentTypeError(f"{path}: the folder {path.parent} does not exist; make it first")
        if suffixes and path.suffix.lower() not in suffixes:
            raise argparse.ArgumentTypeError(f"{path}: it is written as one of {', '.join(suffixes)}")
        return path

    return checked
