"""Readers, one file a program; `read` picks the right one."""

from __future__ import annotations

import os
from pathlib import Path

from fem_import.errors import ExportError, MissingFileError, UnknownKeywordError
from fem_import.fe_model import FEModel
from fem_import.keywords import known_keywords
from fem_import.readers.calculix import JOB_SUFFIXES, job_stem, read_calculix

__all__ = ["read", "read_calculix"]


@known_keywords(UnknownKeywordError)
def read(path: str | os.PathLike[str], units: str = "SI") -> FEModel:
    """Read an export; the program it comes from is told by its files.

    path: a CalculiX job (.inp with .sti, .mas and .dof beside it, or its stem). units: as the program had
    them. Raises ExportError if no reader knows the file, MissingFileError, UnknownNameError.
    """
    given = Path(path)
    stem = job_stem(given)
    is_job = stem != given or any(
        stem.with_name(stem.name + suffix + packed).exists() for suffix in JOB_SUFFIXES for packed in ("", ".gz")
    )
    if is_job:
        return read_calculix(given, units=units)
    if not given.exists():
        raise MissingFileError(f"{given} does not exist.")
    raise ExportError(
        f"{given.name}: no reader knows this kind of file. Known: CalculiX jobs (.inp with .sti, .mas and "
        ".dof beside "
        "it). Matrices of other programs come in by FEModel.from_arrays."
    )
