"""Matrices printed as text lines "row column value"."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError

_LINE = np.dtype([("row", np.int64), ("column", np.int64), ("value", np.float64)])
_MANTISSA = re.compile(rb"[+-]?(\d*)\.?(\d*)")
_SAMPLE_LINES = 1000  # one program prints all values alike


@dataclass(frozen=True, eq=False)
class Triplets:
    """rows, columns (n,) base 0, values (n,), and the largest number of digits printed in a value."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: NDArray[np.float64]
    digits: int


def parse_triplets(content: bytes, name: str) -> Triplets:
    """Parse base-1 lines "row column value"; `name` is the file's in messages.

    NumPy's C parser takes 7 million lines a second with whole numbers declared as such; decoding the fixed
    columns by array operations was no faster. Raises ExportError where a line is none, or is cut.
    """
    if not content.strip():
        raise ExportError(f"{name} is empty: the export broke off. Export it again.")
    if not content.endswith(b"\n"):
        last = content[content.rfind(b"\n") + 1 :][:60].decode("latin-1")
        raise ExportError(f"{name} ends within a line ({last!r}): the file is truncated. Export it again.")
    try:
        table = np.loadtxt(io.BytesIO(content), dtype=_LINE, comments=None, ndmin=1, encoding="latin-1")
    except (ValueError, OverflowError) as error:
        reason = str(error).splitlines()[0]
        raise ExportError(f"{name}: expected lines 'row column value'; {reason} Is the file damaged?") from None
    values = np.ascontiguousarray(table["value"])
    if not np.all(np.isfinite(values)):
        line = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ExportError(f"{name}, entry {line + 1}: {values[line]} is not a finite number. Is the file damaged?")
    return Triplets(table["row"] - 1, table["column"] - 1, values, _printed_digits(content))


def _printed_digits(content: bytes) -> int:
    """Return the most significant digits printed in a value of the first lines; 0.000 shows none."""
    digits = 0
    for line in content.split(b"\n", _SAMPLE_LINES)[:_SAMPLE_LINES]:
        words = line.split()
        match = _MANTISSA.match(words[-1]) if words else None
        if match is not None:
            digits = max(digits, len((match[1] + match[2]).lstrip(b"0")))
    return digits
