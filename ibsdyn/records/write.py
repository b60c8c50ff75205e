"""A time record out, as a file that ``read_record`` reads back as it was."""

from __future__ import annotations

import os
from pathlib import Path
from typing import IO

import numpy as np

from fem_import.whole_file import whole_file
from ibsdyn.errors import RecordError
from ibsdyn.time_record import TimeRecord

SUFFIXES = (".npz", ".csv")


def write_record(record: TimeRecord, path: str | os.PathLike[str]) -> None:
    """Write a record, whole or not at all.

    Parameters
    ----------
    record : of any length.
    path : ending in .npz (exact, with the excitation's period) or .csv (times, titles with units, semicolons; every
        digit of the values, the period is lost).

    Raises
    ------
    RecordError : another ending, or in a CSV a name that a title cannot hold.
    OSError : the file cannot be written.
    """
    target = Path(path)
    if target.suffix not in SUFFIXES:
        raise RecordError(f"{target.name}: a record is written as one of {', '.join(SUFFIXES)}.")
    if target.suffix == ".csv":
        for name in (*record.names, *record.units):
            if any(mark in name for mark in ';\n[]"'):
                raise RecordError(f"{target.name}: {name!r} cannot stand in a title of a CSV; write .npz instead.")
    with whole_file(target) as temporary, temporary.open("wb") as stream:
        (_write_npz if target.suffix == ".npz" else _write_csv)(record, stream)


def _write_npz(record: TimeRecord, stream: IO[bytes]) -> None:
    arrays = {
        "signals": record.signals,
        "names": np.array(record.names),
        "units": np.array(record.units),
        "sample_rate": np.array(record.sample_rate),
        "start": np.array(record.start),
    }
    if record.period is not None:
        arrays["period"] = np.array(record.period)
    # mypy: savez declares its allow_pickle keyword, which no array of ours is named.
    np.savez(stream, **arrays)  # type: ignore[arg-type]


def _write_csv(record: TimeRecord, stream: IO[bytes]) -> None:
    titles = ["time [s]", *(f"{name} [{unit}]" for name, unit in zip(record.names, record.units, strict=True))]
    stream.write((";".join(titles) + "\n").encode())
    np.savetxt(stream, np.vstack([record.time, record.signals]).T, fmt="%.17g", delimiter=";")
