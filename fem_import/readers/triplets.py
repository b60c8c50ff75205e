"""Matrices printed as text lines "row column value", and columns of printed numbers."""

from __future__ import annotations

import io
import re
import warnings
from dataclasses import dataclass
from inspect import signature
from typing import IO, Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import io as scipy_io
from scipy import sparse

from fem_import.errors import ExportError

# Which kind of sparse result is asked for: newer SciPy warns where it is left to the default, older has no choice.
_AS_ARRAY: dict[str, Any] = {"spmatrix": False} if "spmatrix" in signature(scipy_io.mmread).parameters else {}
_LINE = np.dtype([("row", np.int64), ("column", np.int64), ("value", np.float64)])
_MANTISSA = re.compile(rb"[+-]?(\d*)\.?(\d*)")
_SAMPLE_LINES = 1000  # one program prints all values alike
_LARGEST_INDEX = 2**31 - 1  # of scipy's parser; beyond it NumPy's does the work
_CHUNK = 1 << 18  # stays in the cache

_BLANK, _DIGIT, _DOT, _SIGN, _EXPONENT, _OTHER = range(6)


def _byte_classes() -> bytes:
    classes = np.full(256, _OTHER, np.uint8)
    for characters, kind in ((b" \t\r\n", _BLANK), (b"0123456789", _DIGIT), (b".", _DOT), (b"+-", _SIGN)):
        classes[list(characters)] = kind
    classes[list(b"eE")] = _EXPONENT
    return classes.tobytes()


_CLASSES = _byte_classes()


@dataclass(frozen=True, eq=False)
class Triplets:
    """rows, columns (n,) base 0, values (n,), and the largest number of digits printed in a value."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: NDArray[np.float64]
    digits: int


def parse_triplets(content: bytes, name: str) -> Triplets:
    """Parse base-1 lines "row column value"; `name` is the file's in messages.

    scipy's parser of Matrix Market files works on all cores but passes over what follows a number on its
    line, so it gets only what `_is_regular` vouches for; the rest goes to NumPy's, which names the line.
    Raises ExportError where a line is none, or is cut.
    """
    refuse_cut_text(content, name)
    found = _parse_regular(content)
    if found is None:
        found = _parse_any(content, name)
    rows, columns, values = found
    if not np.all(np.isfinite(values)):
        line = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ExportError(f"{name}, entry {line + 1}: {values[line]} is not a finite number. Is the file damaged?")
    return Triplets(rows, columns, values, printed_digits(content))


def refuse_cut_text(content: bytes, name: str) -> None:
    """Raise ExportError if a text file is empty or does not end with a line's end."""
    if not content or content.isspace():
        raise ExportError(f"{name} is empty: the export broke off. Export it again.")
    if not content.endswith(b"\n"):
        last = content[max(content.rfind(b"\n") + 1, len(content) - 60) :].decode("latin-1")
        raise ExportError(
            f"{name} ends within a line ({last!r}): the file is truncated. Export it again (or end its last line, if "
            "it is whole)."
        )


def parse_numbers(content: bytes, count: int, what: str) -> NDArray[np.float64]:
    """Parse `count` numbers parted by blanks; Fortran's D exponents are taken."""
    text = content.translate(bytes.maketrans(b"Dd", b"Ee"))
    values = _parse_regular_column(text)
    if values is None:
        values = _parse_any_numbers(text, what)
    if len(values) != count:
        raise ExportError(f"{what}: {count} numbers are announced and {len(values)} are there: truncated or damaged?")
    if not np.all(np.isfinite(values)):
        number = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ExportError(f"{what}, number {number + 1}: {values[number]} is not finite. Is the file damaged?")
    return values


def _parse_regular_column(text: bytes) -> NDArray[np.float64] | None:
    """Parse one number a line on all cores; None where it is not so regular."""
    n_lines = _count_lines(text)
    if not _is_regular(text, n_lines, 1):
        return None
    try:
        found = scipy_io.mmread(_joined(f"%%MatrixMarket matrix array real general\n{n_lines} 1\n", text), **_AS_ARRAY)
    except (ValueError, OverflowError):
        return None
    return np.asarray(found, dtype=np.float64).ravel()


def _parse_any_numbers(text: bytes, what: str) -> NDArray[np.float64]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # how NumPy tells of text it cannot parse
            return np.fromstring(text, dtype=np.float64, sep=" ")
    except (ValueError, DeprecationWarning):
        raise ExportError(f"{what}: {_first_wrong_word(text)!r} is not a number. Is the file damaged?") from None


def parse_whole_numbers(content: bytes, count: int, what: str) -> NDArray[np.int64]:
    """Parse `count` whole numbers parted by blanks."""
    values = parse_numbers(content, count, what)
    fractional = (values != np.floor(values)) | (abs(values) > 2**53)
    if np.any(fractional):
        raise ExportError(f"{what}: {values[fractional][0]} is not a whole number. Is the file damaged?")
    return values.astype(np.int64)


def printed_digits(content: bytes) -> int:
    """Return the most significant digits printed in the last word of the first lines; 0.000 shows none."""
    digits = 0
    start = 0
    for _ in range(_SAMPLE_LINES):
        end = content.find(b"\n", start)
        if end < 0:
            break
        words = content[start:end].split()
        start = end + 1
        match = _MANTISSA.match(words[-1]) if words else None
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


def _parse_regular(content: bytes) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]] | None:
    n_lines = _count_lines(content)
    if not _is_regular(content, n_lines, 3):
        return None
    size = _LARGEST_INDEX
    header = f"%%MatrixMarket matrix coordinate real general\n{size} {size} {n_lines}\n"
    try:
        matrix = sparse.coo_array(scipy_io.mmread(_joined(header, content), **_AS_ARRAY))
    except (ValueError, OverflowError):
        return None  # the other parser says in words what is wrong
    rows, columns = matrix.coords
    return rows.astype(np.int64), columns.astype(np.int64), np.asarray(matrix.data, dtype=np.float64)


class _Joined(io.RawIOBase):
    """Two byte strings read as one stream, without copying the large one."""

    def __init__(self, first: bytes, second: bytes) -> None:
        self._parts = [memoryview(first), memoryview(second)]

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1) -> bytes:
        while self._parts and not len(self._parts[0]):
            del self._parts[0]
        if not self._parts:
            return b""
        part = self._parts[0]
        taken = len(part) if size < 0 else size
        self._parts[0] = part[taken:]
        return bytes(part[:taken])


def _joined(header: str, content: bytes) -> IO[bytes]:
    return cast("IO[bytes]", _Joined(header.encode(), content))


def _count_lines(content: bytes) -> int:
    return int(np.count_nonzero(np.frombuffer(content, np.uint8) == ord("\n")))


def _is_regular(content: bytes, n_lines: int, words_a_line: int) -> bool:
    """Whether these are lines of words of digits, each last one alike with a dot, an exponent, both or none.

    Signs stand in front or after an exponent, and no word ends in one; then scipy's parser leaves nothing over.
    """
    n_words = n_dots = n_exponents = 0
    for start in range(0, len(content), _CHUNK):
        # One byte more in front: what matters is what follows what.
        chunk = content[max(start - 1, 0) : start + _CHUNK] if start else b"\n" + content[:_CHUNK]
        kinds = np.frombuffer(chunk.translate(_CLASSES), np.uint8)
        if kinds.max(initial=0) == _OTHER:
            return False
        blank, sign = kinds == _BLANK, kinds == _SIGN
        exponent = kinds == _EXPONENT
        if np.any(sign[1:] & ~(blank | exponent)[:-1]) or np.any((sign | exponent)[:-1] & blank[1:]):
            return False
        n_words += int(np.count_nonzero(blank[:-1] & ~blank[1:]))
        n_dots += int(np.count_nonzero(kinds[1:] == _DOT))
        n_exponents += int(np.count_nonzero(exponent[1:]))
    return n_words == words_a_line * n_lines and n_dots in (0, n_lines) and n_exponents in (0, n_lines)


def _parse_any(content: bytes, name: str) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    try:
        table = np.loadtxt(io.BytesIO(content), dtype=_LINE, comments=None, ndmin=1, encoding="latin-1")
    except (ValueError, OverflowError) as error:
        reason = str(error).splitlines()[0]
        raise ExportError(f"{name}: expected lines 'row column value'; {reason} Is the file damaged?") from None
    return table["row"] - 1, table["column"] - 1, np.ascontiguousarray(table["value"])
