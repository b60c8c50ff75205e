"""NPZ files of numpy; never unpickled."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

import numpy as np

from ibsdyn.errors import RecordError
from ibsdyn.records.columns import Columns
from ibsdyn.records.file_bytes import unpacked_limit
from ibsdyn.records.named_arrays import columns_of_arrays


def read_npz(path: Path, time: str | bool | None) -> Columns:
    """Return the columns of an NPZ file.

    Raises
    ------
    RecordError : damaged, unreasonably large when unpacked, or holding objects that would have to be unpickled.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
        if unpacked > unpacked_limit(path):
            raise RecordError(f"{path.name} unpacks to {unpacked} bytes, far more than a record of its size. Damaged?")
        with np.load(path, allow_pickle=False) as archive_of_arrays:
            arrays = {name: np.asarray(archive_of_arrays[name]) for name in archive_of_arrays.files}
    except (OSError, ValueError, EOFError, KeyError, NotImplementedError, zlib.error, zipfile.BadZipFile) as error:
        if isinstance(error, RecordError):
            raise
        raise RecordError(
            f"{path.name} cannot be read as NPZ ({error}). Save plain arrays of numbers with numpy.savez."
        ) from None
    return columns_of_arrays(arrays, path.name, time)
