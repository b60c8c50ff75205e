"""HDF5 files, MATLAB's of version 7.3 among them, by h5py (extra ``hdf5``)."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from ibsdyn.errors import ExtraMissingError, RecordError
from ibsdyn.records.columns import Columns
from ibsdyn.records.file_bytes import unpacked_limit
from ibsdyn.records.named_arrays import columns_of_arrays

_UNITS = ("unit", "units")
_RATES = ("sample_rate", "fs", "sampling_rate", "sampling_frequency")
_STEPS = ("dt", "wf_increment", "sample_interval")
# What h5py raises for a damaged file is not documented and comes from many places.
_DAMAGED = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, MemoryError, RuntimeError, OSError)


def read_hdf5(path: Path, time: str | bool | None) -> Columns:
    """Return every dataset of numbers as columns, called by its path in the file; attributes unit, sample_rate, dt.

    Raises
    ------
    ExtraMissingError : h5py is not installed.
    RecordError : damaged, or unreasonably large when unpacked.
    """
    try:
        h5py: Any = importlib.import_module("h5py")
    except ImportError:
        raise ExtraMissingError(f'{path.name} is an HDF5 file, which needs h5py: pip install "ibsdyn[hdf5]".') from None
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    rates: dict[str, float] = {}
    limit = unpacked_limit(path)

    def take(name: str, item: Any) -> None:
        # visititems follows no links, so a file cannot lead to another one; "#refs#" is MATLAB's own housekeeping.
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or item.dtype.kind not in "iufbcOS":
            return
        nonlocal limit
        limit -= item.size * item.dtype.itemsize
        if limit < 0:
            raise RecordError(
                f"{path.name}, {name} declares shape {item.shape}, far more than the file holds. Damaged?"
            )
        if item.dtype.kind in "OS":
            if h5py.check_string_dtype(item.dtype) is not None:
                arrays[name] = np.atleast_1d(np.array(item.asstr()[()], dtype=str))
            return
        if "MATLAB_class" in item.attrs and _text(item.attrs["MATLAB_class"]) == "char":
            return
        arrays[name] = np.asarray(item[()])
        for key in item.attrs:
            if key.casefold() in _UNITS:
                units[name] = _text(item.attrs[key])
            elif key.casefold() in _STEPS:
                rates.setdefault(name, 1.0 / float(item.attrs[key]))
            elif key.casefold() in _RATES:
                rates[name] = float(item.attrs[key])

    try:
        with h5py.File(path, "r") as file:
            file.visititems(take)
            attributes = {
                key: np.asarray(file.attrs[key]) for key in file.attrs if key.casefold() in (*_RATES, *_STEPS)
            }
    except _DAMAGED as error:
        if isinstance(error, RecordError):
            raise
        raise RecordError(f"{path.name} cannot be read as HDF5 ({error}); damaged or truncated?") from None
    return columns_of_arrays(attributes | arrays, path.name, time, units, rates)


def _text(value: Any) -> str:
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)
