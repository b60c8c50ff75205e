"""The bulk of a punch file: columns of DMIG in large field, one term a line, taken as arrays of bytes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_import.readers.long_text import LongText
from fem_import.readers.regular_text import IntArray, regular_triplets
from fem_import.readers.triplets import printed_digits

_WIDTH = 56  # three fields of 16 behind the first of 8: node, component, value; or name, node, component
_FIELDS = (slice(8, 24), slice(24, 40), slice(40, 56))
_COLUMN = b"DMIG*"
_OPENS_NO_CARD = b" *+,$"
_FROM_FORTRAN = bytes.maketrans(b"Dd", b"Ee")


@dataclass(frozen=True, eq=False)
class MatrixColumns:
    """Terms of one matrix: node and component of rows and columns (n, 2), values (n,), digits, the first line."""

    rows: IntArray
    columns: IntArray
    values: NDArray[np.float64]
    digits: int
    first_line: int


def split_columns(text: str) -> tuple[dict[str, MatrixColumns], list[tuple[int, str]]]:
    """Return the columns by name of matrix, and the other lines with their numbers (base 1).

    Where a column is not as regular as Nastran's own, there are no columns and all lines are others.
    """
    content = text.encode("latin-1", "replace")
    found = None if b"\t" in content or _COLUMN not in content else _split(content)
    if found is None:
        return {}, list(enumerate(text.splitlines(), start=1))
    return found


def _split(content: bytes) -> tuple[dict[str, MatrixColumns], list[tuple[int, str]]] | None:
    raw = np.frombuffer(content + b"\n" + b" " * _WIDTH, np.uint8)
    ends = np.flatnonzero(raw == ord("\n"))
    starts = np.concatenate([[0], ends[:-1] + 1])
    lengths = ends - starts
    first = np.where(lengths > 0, raw[starts], ord("$"))
    opens = ~np.isin(first, np.frombuffer(_OPENS_NO_CARD, np.uint8))
    opener = np.maximum.accumulate(np.where(opens, np.arange(len(starts)), -1))
    is_column = opens & (lengths >= _WIDTH)
    for place, byte in enumerate(_COLUMN):
        is_column &= raw[np.minimum(starts + place, len(raw) - 1)] == byte
    belongs = (opener >= 0) & is_column[opener] & ~opens & (first != ord("$"))
    terms, heads = np.flatnonzero(belongs), np.flatnonzero(is_column)
    if not len(terms) or np.any(first[terms] != ord("*")) or np.any(lengths[terms] < _WIDTH):
        return None
    nodes = _numbers(_lines(raw, starts[heads]), (1, 2, None))
    entries = _numbers(_lines(raw, starts[terms]), (0, 1, 2))
    if nodes is None or entries is None:
        return None
    column_of_term = np.searchsorted(heads, opener[terms])
    names = np.ascontiguousarray(_lines(raw, starts[heads])[:, _FIELDS[0]]).view("S16").ravel()
    spelled, which = np.unique(names, return_inverse=True)
    matrices: dict[str, MatrixColumns] = {}
    for number, spelling in enumerate(spelled):
        chosen = which[column_of_term] == number
        name = spelling.decode("latin-1").strip().upper()
        if name in matrices:
            return None  # one name, spelled in two ways
        if not np.any(chosen):
            continue
        matrices[name] = MatrixColumns(
            rows=np.column_stack([part[chosen] for part in entries[:2]]),
            columns=np.column_stack([part[column_of_term[chosen]] for part in nodes[:2]]),
            values=entries[2][chosen],
            digits=_digits(_lines(raw, starts[terms[chosen][:1000]])),
            first_line=int(heads[which == number][0]) + 1,
        )
    others = np.flatnonzero(~belongs & ~is_column)
    return matrices, [
        (int(line) + 1, content[starts[line] : ends[line]].decode("latin-1").rstrip("\r")) for line in others
    ]


def _lines(raw: NDArray[np.uint8], starts: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return (n, 56): the first bytes of lines."""
    windows = np.lib.stride_tricks.sliding_window_view(raw, _WIDTH)
    return np.ascontiguousarray(windows[starts])


def _numbers(
    lines: NDArray[np.uint8], fields: tuple[int, int, int | None]
) -> tuple[IntArray, IntArray, NDArray[np.float64]] | None:
    """Return two columns of whole numbers above 0 and one of numbers (1 without a field); None if they are none.

    Fields may touch, so each is set apart by a blank.
    """
    text = np.full((len(lines), 17 * 3 + 1), ord(" "), np.uint8)
    text[:, -1] = ord("\n")
    for place, field in enumerate(fields):
        text[:, 17 * place : 17 * place + 16] = ord("1") if field is None else lines[:, _FIELDS[field]]
    found = regular_triplets(LongText(text.tobytes().translate(_FROM_FORTRAN)))
    return None if found is None else (found[0] + 1, found[1] + 1, found[2])


def _digits(lines: NDArray[np.uint8]) -> int:
    fields = [bytes(field) for field in lines[:, _FIELDS[2]]]
    return printed_digits(b"\n".join(fields) + b"\n")
