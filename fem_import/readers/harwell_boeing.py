"""Harwell-Boeing text files, as Ansys' HBMAT writes them."""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from fem_import.errors import ExportError
from fem_import.readers.triangles import Written, full_symmetric
from fem_import.readers.triplets import parse_numbers, parse_whole_numbers, printed_digits, refuse_cut_text

SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_KIND = re.compile(rb"[RCP][SUHZR][AE]", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class PrintedMatrix:
    """A full symmetric matrix, the digits it was printed with, and whether only one triangle was printed."""

    matrix: SparseMatrix
    digits: int
    of_one_triangle: bool


def is_harwell_boeing(head: bytes) -> bool:
    """Whether a file starts like one: its third line names the kind of matrix."""
    lines = head.split(b"\n", 3)
    return len(lines) > 3 and bool(_KIND.match(lines[2])) and _five_counts(lines[1]) is not None


def parse_harwell_boeing(content: bytes, name: str) -> PrintedMatrix:
    """Parse a real matrix stored column by column; a right-hand side that follows is passed over.

    scipy's own reader refuses symmetric files with a right-hand side. Format: Duff, Grimes and Lewis, Users'
    Guide for the Harwell-Boeing Sparse Matrix Collection (1992). Raises ExportError.
    """
    refuse_cut_text(content, name)
    if not is_harwell_boeing(content[:1000]):
        raise ExportError(f"{name} is no Harwell-Boeing text file: its third line does not name a kind such as RSA.")
    header = content.split(b"\n", 3)[:3]
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
    line_ends = np.flatnonzero(np.frombuffer(content, np.uint8) == ord("\n"))
    first = 4 + (n_rhs_lines > 0)
    blocks = np.cumsum([first, n_pointer_lines, n_index_lines, n_value_lines])
    needed = blocks[-1] + n_rhs_lines
    if len(line_ends) < needed or total != needed - first:
        raise ExportError(f"{name} announces {needed} lines and has {len(line_ends)}: truncated or damaged.")
    pointers_text, indices_text, values_text = (
        memoryview(content)[line_ends[start - 1] + 1 : line_ends[stop - 1] + 1]
        for start, stop in itertools.pairwise(blocks)
    )
    pointers = parse_whole_numbers(pointers_text, n_columns + 1, f"{name}, column pointers") - 1
    rows = parse_whole_numbers(indices_text, n_entries, f"{name}, row indices") - 1
    values = parse_numbers(values_text, n_entries, f"{name}, values")
    lengths = np.diff(pointers)
    if pointers[0] != 0 or pointers[-1] != n_entries or np.any(lengths < 0):
        raise ExportError(f"{name}: the column pointers do not run from 1 to {n_entries + 1} upwards. Damaged?")
    columns = np.repeat(np.arange(n_columns, dtype=np.int64), lengths)
    written: Written = "one triangle" if kind == "RSA" else "both triangles"
    return PrintedMatrix(
        full_symmetric(rows, columns, values, n_rows, name, written),
        printed_digits(bytes(values_text[:200_000]).translate(bytes.maketrans(b"Dd", b"Ee"))),
        written == "one triangle",
    )


def _five_counts(line: bytes) -> list[int] | None:
    """Return the numbers of lines: all, pointers, indices, values, right-hand side (0 where left out)."""
    words = line.split()
    if len(words) not in (4, 5) or not all(word.isdigit() and len(word) < 15 for word in words):
        return None
    return [int(word) for word in words] + [0] * (5 - len(words))
