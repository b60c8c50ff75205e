"""MATLAB's files of version 5 to 7."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem_import.errors import ExportError
from fem_import.readers.matlab_5 import parse_matlab_5
from ibsdyn.errors import RecordError
from ibsdyn.records.columns import Columns
from ibsdyn.records.file_bytes import read_bytes, unpacked_limit
from ibsdyn.records.named_arrays import columns_of_arrays


def read_mat(path: Path, time: str | bool | None) -> Columns:
    """Return the columns of a MAT file of version 5 to 7; texts, cells and structs in it are passed over.

    Raises
    ------
    RecordError : damaged, unreasonably large when unpacked, or without an array of numbers.
    """
    try:
        found = parse_matlab_5(read_bytes(path), path.name, unpacked_limit(path))
    except ExportError as error:
        raise RecordError(str(error)) from None
    # Sparse matrices are no records.
    return columns_of_arrays({k: v for k, v in found.items() if isinstance(v, np.ndarray)}, path.name, time)
