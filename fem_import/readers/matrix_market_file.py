"""Matrix Market text files: coordinate matrices, and arrays of numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError
from fem_import.readers.long_text import LongText
from fem_import.readers.printed_matrix import PrintedEntries
from fem_import.readers.triangles import Written
from fem_import.readers.triplets import parse_numbers, parse_triplets, printed_digits, refuse_cut_text

BANNER = b"%%MatrixMarket"


@dataclass(frozen=True)
class _Header:
    layout: str
    field: str
    symmetry: str
    sizes: tuple[int, ...]
    end: int  # where the numbers start

    @property
    def written(self) -> Written:
        return "one triangle" if self.symmetry == "symmetric" else "both triangles"


def is_matrix_market(head: bytes) -> bool:
    """Whether a file starts with the banner."""
    return head[: len(BANNER)].lower() == BANNER.lower()


def parse_matrix(content: LongText, name: str) -> PrintedEntries:
    """Parse a square real matrix, "coordinate" or "array", symmetric (one triangle) or general.

    Format: Boisvert, Pozo and Remington, The Matrix Market Exchange Formats, NISTIR 5935 (1996). Raises
    ExportError.
    """
    header = _header(content, name)
    if header.layout == "array":
        return _dense(content, header, name)
    n_rows, n_columns, n_entries = header.sizes
    if n_rows != n_columns or n_rows == 0:
        raise ExportError(f"{name} is {n_rows} x {n_columns}; a stiffness or mass matrix is square.")
    entries = parse_triplets(content.between(header.end), name, n_entries)
    if len(entries.values) != n_entries:
        raise ExportError(f"{name} announces {n_entries} entries and has {len(entries.values)}: truncated or damaged.")
    return PrintedEntries(entries.rows, entries.columns, entries.values, n_rows, name, header.written, entries.digits)


def parse_vector(content: LongText, name: str) -> NDArray[np.float64]:
    """Parse an "array" of one column (or row). Raises ExportError."""
    header = _header(content, name)
    if header.layout != "array" or min(header.sizes) != 1 or header.symmetry != "general":
        raise ExportError(f"{name} must be an array of one column; it is a {header.layout} of {header.sizes}.")
    return parse_numbers(content.between(header.end), max(header.sizes), name)


def _dense(content: LongText, header: _Header, name: str) -> PrintedEntries:
    n_rows, n_columns = header.sizes
    if n_rows != n_columns or n_rows == 0:
        raise ExportError(f"{name} is {n_rows} x {n_columns}; a stiffness or mass matrix is square.")
    triangular = header.written == "one triangle"
    count = n_rows * (n_rows + 1) // 2 if triangular else n_rows * n_rows
    body = content.between(header.end)
    values = parse_numbers(body, count, name)
    if triangular:  # the lower triangle, column by column
        columns, rows = np.triu_indices(n_rows)
    else:
        columns, rows = np.divmod(np.arange(count), n_rows)
    given = values != 0.0
    return PrintedEntries(
        rows[given], columns[given], values[given], n_rows, name, header.written, printed_digits(body)
    )


def _header(content: LongText, name: str) -> _Header:
    refuse_cut_text(content, name)
    if not is_matrix_market(content[:100]):
        raise ExportError(f"{name} is no Matrix Market file: it does not start with {BANNER.decode()}.")
    first = content.line_at(0)
    words = first.decode("latin-1").lower().split()
    if len(words) != 5 or words[1] != "matrix" or words[2] not in ("coordinate", "array"):
        raise ExportError(f"{name}, line 1: expected '%%MatrixMarket matrix coordinate real symmetric' or the like.")
    layout, field, symmetry = words[2:]
    if field not in ("real", "double", "integer") or symmetry not in ("symmetric", "general"):
        raise ExportError(f"{name} is {field} and {symmetry}; real and symmetric (or general) matrices are read.")
    end = len(first)
    while True:  # comments and blank lines
        line = content.line_at(end)
        end += len(line)
        if not line:
            raise ExportError(f"{name} has no line of sizes: truncated.")
        if line.strip() and not line.startswith(b"%"):
            break
    sizes = line.split()
    if len(sizes) != (3 if layout == "coordinate" else 2) or not all(w.isdigit() and len(w) < 15 for w in sizes):
        raise ExportError(f"{name}: expected the sizes, found {line.strip()[:60].decode('latin-1')!r}.")
    return _Header(layout, field, symmetry, tuple(int(word) for word in sizes), end)
