"""Matrices printed as text lines "row column value", and columns of printed numbers."""

from __future__ import annotations

import io
import itertools
import re
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError
from fem_import.readers.long_text import LongText
from fem_import.readers.regular_text import IntArray, regular_column, regular_triplets

_LINE = np.dtype([("row", np.int64), ("column", np.int64), ("value", np.float64)])
_MANTISSA = re.compile(rb"[+-]?(\d*)\.?(\d*)")
_SAMPLE_LINES = 1000  # one program prints all values alike


@dataclass(frozen=True, eq=False)
class Triplets:
    """rows, columns (n,) base 0, values (n,), and the largest number of digits printed in a value."""

    rows: IntArray
    columns: IntArray
    values: NDArray[np.float64]
    digits: int


def parse_triplets(content: LongText, name: str, n_lines: int | None = None) -> Triplets:
    """Parse base-1 lines "row column value"; `name` is the file's in messages, n_lines how many there should be,
    which the caller compares.

    Raises ExportError where a line is none, or is cut.
    """
    refuse_cut_text(content, name)
    rows, columns, values = regular_triplets(content, n_lines) or _parse_any(content, name)
    refuse_not_finite(values, name)
    return Triplets(rows, columns, values, printed_digits(content))


def refuse_not_finite(values: NDArray[np.float64], name: str) -> None:
    """Raise ExportError that names the first entry that is no finite number."""
    finite = np.isfinite(values)
    if not np.all(finite):
        entry = int(np.argmin(finite))
        raise ExportError(f"{name}, entry {entry + 1}: {values[entry]} is not a finite number. Is the file damaged?")


def refuse_cut_text(content: bytes | LongText, name: str) -> None:
    """Raise ExportError if a text file is empty or does not end with a line's end."""
    end = content[-60:]
    if not end or (end.isspace() and bytes(content).isspace()):
        raise ExportError(f"{name} is empty: the export broke off. Export it again.")
    if not end.endswith(b"\n"):
        last = end[end.rfind(b"\n") + 1 :].decode("latin-1")
        raise ExportError(
            f"{name} ends within a line ({last!r}): the file is truncated. Export it again (or end its last line, if "
            "it is whole)."
        )


def parse_numbers(content: LongText, count: int, what: str) -> NDArray[np.float64]:
    """Parse `count` numbers parted by blanks; Fortran's D exponents are taken."""
    values = regular_column(content)
    if values is None:
        values = _parse_any_numbers(bytes(content).translate(bytes.maketrans(b"Dd", b"Ee")), what)
    if len(values) != count:
        raise ExportError(f"{what}: {count} numbers are announced and {len(values)} are there: truncated or damaged?")
    if not np.all(np.isfinite(values)):
        number = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ExportError(f"{what}, number {number + 1}: {values[number]} is not finite. Is the file damaged?")
    return values


def _parse_any_numbers(text: bytes, what: str) -> NDArray[np.float64]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # how NumPy tells of text it cannot parse
            return np.fromstring(text, dtype=np.float64, sep=" ")
    except (ValueError, DeprecationWarning):
        raise ExportError(f"{what}: {_first_wrong_word(text)!r} is not a number. Is the file damaged?") from None


def parse_whole_numbers(content: LongText, count: int, what: str) -> NDArray[np.int64]:
    """Parse `count` whole numbers parted by blanks."""
    values = parse_numbers(content, count, what)
    fractional = (values != np.floor(values)) | (abs(values) > 2**53)
    if np.any(fractional):
        raise ExportError(f"{what}: {values[fractional][0]} is not a whole number. Is the file damaged?")
    return values.astype(np.int64)


def printed_digits(content: bytes | LongText) -> int:
    """Return the most significant digits printed in the last word of the first lines; 0.000 shows none."""
    digits = 0
    stream = io.BytesIO(content[: 100 * _SAMPLE_LINES])
    for line in itertools.islice(stream, _SAMPLE_LINES):
        words = line.split()
        match = _MANTISSA.match(words[-1]) if words and line.endswith(b"\n") else None
        if match is not None:
            digits = max(digits, len((match[1] + match[2]).lstrip(b"0")))
    return digits


def _first_wrong_word(text: bytes) -> str:
    for word in text.split():
        try:
            float(word)
        except ValueError:
            return word[:40].decode("latin-1")
    return ""


def _parse_any(content: LongText, name: str) -> tuple[IntArray, IntArray, NDArray[np.float64]]:
    try:
        table = np.loadtxt(io.BytesIO(bytes(content)), dtype=_LINE, comments=None, ndmin=1, encoding="latin-1")
    except (ValueError, OverflowError) as error:
        reason = str(error).splitlines()[0]
        raise ExportError(f"{name}: expected lines 'row column value'; {reason} Is the file damaged?") from None
    return table["row"] - 1, table["column"] - 1, np.ascontiguousarray(table["value"])
