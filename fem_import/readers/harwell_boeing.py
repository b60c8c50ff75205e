"""Harwell-Boeing text files, as Ansys' HBMAT writes them."""

from __future__ import annotations

import itertools
import re

import numpy as np

from fem_import.errors import ExportError
from fem_import.readers.long_text import LongText
from fem_import.readers.printed_matrix import PrintedEntries
from fem_import.readers.triplets import parse_numbers, parse_whole_numbers, printed_digits, refuse_cut_text

_KIND = re.compile(rb"[RCP][SUHZR][AE]", re.IGNORECASE)


def is_harwell_boeing(head: bytes) -> bool:
    """Whether a file starts like one: its third line names the kind of matrix."""
    lines = head.split(b"\n", 3)
    return len(lines) > 3 and bool(_KIND.match(lines[2])) and _five_counts(lines[1]) is not None


def parse_harwell_boeing(content: LongText, name: str) -> PrintedEntries:
    """Parse a real matrix stored column by column; a right-hand side that follows is passed over.

    scipy's own reader refuses symmetric files with a right-hand side. Format: Duff, Grimes and Lewis, Users'
    Guide for the Harwell-Boeing Sparse Matrix Collection (1992). Raises ExportError.
    """
    refuse_cut_text(content, name)
    head = content[:1000]
    if not is_harwell_boeing(head):
        raise ExportError(f"{name} is no Harwell-Boeing text file: its third line does not name a kind such as RSA.")
    header = head.split(b"\n", 3)[:3]
    counts = _five_counts(header[1])
    kind = header[2][:3].upper().decode("latin-1")
    if counts is None or kind not in ("RSA", "RUA"):
        raise ExportError(f"{name} holds a matrix of kind {kind}; real assembled ones (RSA, RUA) are read.")
    try:
        n_rows, n_columns, n_entries = (int(word) for word in header[2][3:].split()[:3])
    except ValueError:
        raise ExportError(f"{name}, line 3: expected kind, rows, columns, entries; found {header[2][:60]!r}.") from None
    total, n_pointer_lines, n_index_lines, n_value_lines, n_rhs_lines = counts
    if min(n_rows, n_entries, *counts) < 0 or n_rows != n_columns or n_rows == 0:
        raise ExportError(f"{name} declares {n_rows} x {n_columns} with {n_entries} entries: not a matrix to import.")
    first = 4 + (n_rhs_lines > 0)
    blocks = np.cumsum([first, n_pointer_lines, n_index_lines, n_value_lines]).tolist()
    needed = blocks[-1] + n_rhs_lines
    ends = content.ends_of_lines([*blocks, needed])
    if len(ends) < 5 or total != needed - first:
        raise ExportError(f"{name} announces {needed} lines and has {content.count_lines()}: truncated or damaged.")
    pointers_text, indices_text, values_text = (
        content.between(start, stop) for start, stop in itertools.pairwise(ends[:4])
    )
    pointers = parse_whole_numbers(pointers_text, n_columns + 1, f"{name}, column pointers") - 1
    rows = parse_whole_numbers(indices_text, n_entries, f"{name}, row indices") - 1
    values = parse_numbers(values_text, n_entries, f"{name}, values")
    lengths = np.diff(pointers)
    if pointers[0] != 0 or pointers[-1] != n_entries or np.any(lengths < 0):
        raise ExportError(f"{name}: the column pointers do not run from 1 to {n_entries + 1} upwards. Damaged?")
    columns = np.repeat(np.arange(n_columns, dtype=np.int64), lengths)
    return PrintedEntries(
        rows,
        columns,
        values,
        n_rows,
        name,
        "one triangle" if kind == "RSA" else "both triangles",
        printed_digits(values_text[:200_000].translate(bytes.maketrans(b"Dd", b"Ee"))),
    )


def _five_counts(line: bytes) -> list[int] | None:
    """Return the numbers of lines: all, pointers, indices, values, right-hand side (0 where left out)."""
    words = line.split()
    if len(words) not in (4, 5) or not all(word.isdigit() and len(word) < 15 for word in words):
        return None
    return [int(word) for word in words] + [0] * (5 - len(words))
