"""Frequency responses as files, the kind told by the ending."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

from fem_import.whole_file import whole_file
from ibsdyn.errors import InterchangeError, known_keywords, nearest
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.interchange.frf_csv import read_csv, write_csv
from ibsdyn.interchange.frf_uff import read_uff, write_uff
from ibsdyn.interchange.matlab import write_frf_mat

_Function = TypeVar("_Function", bound=Callable[..., object])
_WRITERS: Mapping[str, Callable[[FrequencyResponse, Path], None]] = {
    ".csv": write_csv,
    ".uff": write_uff,
    ".unv": write_uff,
    ".mat": write_frf_mat,
}
_READERS: Mapping[str, Callable[[Path], FrequencyResponse]] = {".csv": read_csv, ".uff": read_uff, ".unv": read_uff}


@known_keywords
def write_frf(response: FrequencyResponse, path: str | os.PathLike[str]) -> None:
    """Write frequency responses, whole or not at all.

    Parameters
    ----------
    response : of a model, or estimated from records.
    path : ending in .csv (real and imaginary parts in columns, every digit), .uff or .unv (universal file, data sets
        58, extra ``uff``) or .mat (H, frequencies, names and units).

    Raises
    ------
    InterchangeError : another ending, or a name that the kind of file cannot hold.
    ExtraMissingError : a universal file, and pyuff is not installed.
    OSError : the file cannot be written.

    Notes
    -----
    Universal files print frequencies with six digits and responses with twelve: the format is of that time. Outputs
    and inputs are numbered as nodes without direction, their names stand in the ID lines and, cut to ten
    characters, as entities.
    """
    target = Path(path)
    writer = _of_suffix(_WRITERS, target, "written")
    with whole_file(target) as temporary:
        writer(response, temporary)


@known_keywords
def read_frf(path: str | os.PathLike[str]) -> FrequencyResponse:
    """Read frequency responses.

    Parameters
    ----------
    path : a .csv that ``write_frf`` wrote, or a universal file (.uff, .unv) with frequency response functions in data
        sets 58, of any test system.

    Returns
    -------
    FrequencyResponse : units in SI where the file has known ones. Of a universal file outputs and inputs are called
        by node and direction, as ``12:+Z``, unless it has names.

    Raises
    ------
    InterchangeError : another ending, damaged, functions on different frequencies, or a pair that is missing.
    ExtraMissingError : a universal file, and pyuff is not installed.
    OSError : the file cannot be read.
    """
    source = Path(path)
    return _of_suffix(_READERS, source, "read")(source)


def _of_suffix(known: Mapping[str, _Function], path: Path, done: str) -> _Function:
    if path.suffix.lower() not in known:
        hint = nearest(path.suffix, known)
        raise InterchangeError(f"{path.name}: frequency responses are not {done} as {path.suffix!r}. {hint}")
    return known[path.suffix.lower()]
