"""Nastran OUTPUT4 files, text and binary, dense and sparse."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError
from fem_import.readers.triplets import refuse_cut_text

IntArray: TypeAlias = NDArray[np.int64]
FloatArray: TypeAlias = NDArray[np.float64]

_HEADER_BYTES = 24
_FORMAT = re.compile(r"(\d+)[EDG](\d+)\.(\d+)", re.IGNORECASE)
_LARGEST = 1 << 31
_NAME = re.compile(r"[A-Z][A-Z0-9]{0,7}$", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class OutputMatrix:
    """A matrix by its entries (base 0) and the digits it is printed with, None in binary.

    size: -1 where it is not square; is_complex: only its real part is here.
    """

    size: int
    is_complex: bool
    rows: IntArray
    columns: IntArray
    values: FloatArray
    digits: int | None


@dataclass
class _Column:
    """Collects strings: consecutive values that start at a row of a column."""

    rows: list[IntArray]
    columns: list[IntArray]
    values: list[FloatArray]
    is_complex: bool

    def add(self, row: int, column: int, values: FloatArray) -> None:
        values = values[::2] if self.is_complex else values
        self.rows.append(np.arange(row - 1, row - 1 + len(values), dtype=np.int64))
        self.columns.append(np.full(len(values), column - 1, dtype=np.int64))
        self.values.append(values)


def parse_op4(content: bytes, name: str) -> dict[str, OutputMatrix]:
    """Parse all matrices of a file. Raises ExportError.

    Format: MSC Nastran DMAP Programmer's Guide, OUTPUT4: a header, then columns, each either dense from its
    first row or in strings led by length and row; a column beyond the last one ends the matrix.
    """
    for order in ("<", ">"):
        if len(content) >= 4 and int(np.frombuffer(content[:4], order + "i4")[0]) == _HEADER_BYTES:
            return _parse_binary(content, name, order)
    return _parse_text(content, name)


def _checked(name: str, matrix: str, n_columns: int, n_rows: int, kind: int) -> None:
    if not _NAME.match(matrix):
        raise ExportError(f"{name}: {matrix[:20]!r} is no name of a matrix. Is this an OUTPUT4 file (32-bit words)?")
    if kind not in (1, 2, 3, 4):
        raise ExportError(f"{name}: matrix {matrix} is of type {kind}; 1 to 4 exist. Damaged?")
    if not (0 < n_rows < _LARGEST and 0 < n_columns < _LARGEST):
        raise ExportError(f"{name}: matrix {matrix} is {n_rows} x {n_columns}.")


def _finished(name: str, matrix: str, size: tuple[int, int], found: _Column, digits: int | None) -> OutputMatrix:
    rows = np.concatenate([np.empty(0, np.int64), *found.rows])
    columns = np.concatenate([np.empty(0, np.int64), *found.columns])
    values = np.concatenate([np.empty(0), *found.values])
    if len(rows) and (rows.max() >= size[0] or rows.min() < 0):
        raise ExportError(f"{name}: matrix {matrix} has an entry in row {rows.max() + 1} of {size[0]}. Damaged?")
    if not np.all(np.isfinite(values)):
        raise ExportError(f"{name}: matrix {matrix} has a value that is not finite. Damaged?")
    square = size[0] if size[0] == size[1] else -1
    return OutputMatrix(square, found.is_complex, rows, columns, values, digits)


def _parse_binary(content: bytes, name: str, order: str) -> dict[str, OutputMatrix]:
    words = np.frombuffer(content[: len(content) // 4 * 4], order + "i4")
    at = 0

    def record() -> bytes:
        nonlocal at
        length = int(words[at]) if at < len(words) else -1
        end = at + 1 + length // 4
        if length < 12 or length % 4 or end >= len(words) or words[end] != length:
            raise ExportError(f"{name}: no whole record at byte {4 * at}: truncated or damaged.")
        found = content[4 * at + 4 : 4 * end]
        at = end + 1
        return found

    matrices: dict[str, OutputMatrix] = {}
    while at < len(words):
        header = record()
        if len(header) != _HEADER_BYTES:
            raise ExportError(f"{name}: expected a matrix' header at byte {4 * at - _HEADER_BYTES}: damaged.")
        n_columns, n_rows, _, kind = (int(word) for word in np.frombuffer(header[:16], order + "i4"))
        matrix = header[16:24].decode("latin-1").strip()
        big = n_rows < 0
        n_rows = abs(n_rows)
        _checked(name, matrix, n_columns, n_rows, kind)
        per_value, real = (1, order + "f4") if kind in (1, 3) else (2, order + "f8")
        found = _Column([], [], [], kind > 2)
        while True:
            data = record()
            column, row, n_words = (int(word) for word in np.frombuffer(data[:12], order + "i4"))
            if column > n_columns:
                break
            body = data[12:]
            if column < 1 or row < 0 or n_words * 4 != len(body):
                raise ExportError(f"{name}: column {column} of matrix {matrix} is damaged.")
            if row > 0:
                if n_words % per_value:
                    raise ExportError(f"{name}: column {column} of matrix {matrix} is damaged.")
                found.add(row, column, np.frombuffer(body, real).astype(np.float64))
                continue
            place = 0
            while place < n_words:
                string = np.frombuffer(body[4 * place : 4 * place + 8], order + "i4")
                row, length, head = _string(string, big)
                start = place + head
                place = start + length
                if row < 1 or length < 1 or length % per_value or place > n_words:
                    raise ExportError(f"{name}: column {column} of matrix {matrix} has a string that is damaged.")
                found.add(row, column, np.frombuffer(body[4 * start : 4 * place], real).astype(np.float64))
        matrices[matrix.upper()] = _finished(name, matrix, (n_rows, n_columns), found, None)
    return matrices


def _string(words: IntArray | NDArray[np.int32], big: bool) -> tuple[int, int, int]:
    """Return row, number of words and words of the head of a string; row and length share a word if rows < 65536."""
    if big:
        return (int(words[1]) if len(words) > 1 else 0), int(words[0]) - 1, 2
    packed = int(words[0])
    return packed % 65536, packed // 65536 - 1, 1


def _parse_text(content: bytes, name: str) -> dict[str, OutputMatrix]:
    refuse_cut_text(content, name)
    lines = content.decode("latin-1").splitlines()
    at = 0
    matrices: dict[str, OutputMatrix] = {}

    def integers(width: int, count: int, what: str) -> list[int]:
        nonlocal at
        line = lines[at] if at < len(lines) else ""
        at += 1
        try:
            return [int(line[k * width : (k + 1) * width]) for k in range(count)]
        except ValueError:
            raise ExportError(
                f"{name}, line {at}: expected {what}, found {line[:60]!r}: truncated or damaged."
            ) from None

    while at < len(lines) and lines[at].strip():
        header = lines[at]
        n_columns, n_rows, _, kind = integers(8, 4, "columns, rows, form, type")
        matrix = header[32:40].strip()
        printed = _FORMAT.search(header[40:])
        big = n_rows < 0
        n_rows = abs(n_rows)
        _checked(name, matrix, n_columns, n_rows, kind)
        if printed is None or int(printed[1]) < 1 or int(printed[2]) < 1:
            raise ExportError(f"{name}: matrix {matrix} does not tell its format such as 1P,5E16.9.")
        per_line, width, digits = int(printed[1]), int(printed[2]), int(printed[3]) + 1
        per_value = 1 if kind in (1, 3) else 2
        found = _Column([], [], [], kind > 2)

        def values(count: int, matrix: str = matrix, per_line: int = per_line, width: int = width) -> FloatArray:
            nonlocal at
            n_lines = -(-count // per_line)
            if at + n_lines > len(lines):
                raise ExportError(f"{name}: matrix {matrix} breaks off at line {len(lines)}: truncated.")
            text = [
                line[k * width : (k + 1) * width].replace("D", "E")
                for line in lines[at : at + n_lines]
                for k in range(min(per_line, -(-len(line.rstrip()) // width)))
            ]
            at += n_lines
            try:
                if len(text) != count:
                    raise ValueError
                return np.array([float(word) for word in text])
            except ValueError:
                raise ExportError(f"{name}, line {at}: expected {count} values of width {width}: damaged.") from None

        while True:
            column, row, n_words = integers(8, 3, "column, row, words")
            if column > n_columns:
                at += 1  # a line that stands for nothing, sometimes of another width
                if at > len(lines):
                    raise ExportError(f"{name}: matrix {matrix} has no end: truncated.")
                break
            if column < 1 or row < 0 or n_words < 1:
                raise ExportError(f"{name}, line {at}: column {column} of matrix {matrix} is damaged.")
            if row > 0:
                found.add(row, column, values(n_words))  # dense text counts values, not words
                continue
            left = n_words
            while left > 0:
                whole_line = max(len(lines[at]), 1) if at < len(lines) else 1
                string = np.array(integers(8, 2, "a string") if big else integers(whole_line, 1, "a string"))
                row, length, head = _string(string, big)
                left -= length + head
                if row < 1 or length < 1 or length % per_value or left < 0:
                    raise ExportError(f"{name}, line {at}: a string of matrix {matrix} is damaged.")
                found.add(row, column, values(length // per_value))
        matrices[matrix.upper()] = _finished(name, matrix, (n_rows, n_columns), found, digits)
    if not matrices:
        raise ExportError(f"{name} holds no matrix of OUTPUT4.")
    return matrices
