"""Nastran OUTPUT4 files, text and binary, dense and sparse."""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError
from fem_import.readers.triplets import refuse_cut_text

IntArray: TypeAlias = NDArray[np.int64]
FloatArray: TypeAlias = NDArray[np.float64]

_HEADER_WORDS = 4  # columns, rows, form, type; two words of four characters follow
_FORMAT = re.compile(r"(\d+)[EDG](\d+)\.(\d+)", re.IGNORECASE)
_LARGEST = 1 << 31
_NAME = re.compile(r"[A-Z][A-Z0-9_]{0,7}$", re.IGNORECASE)
_OLD_FORMAT = "1P,5E16.9"  # of headers that tell none
_WIDE = "|I16"  # at the end of a text header: columns and rows are printed 16 wide


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
        for width in (4, 8):
            header = (_HEADER_WORDS + 2) * width
            if len(content) >= 4 and int(np.frombuffer(content[:4], order + "i4")[0]) == header:
                return _parse_binary(content, name, _Words(order, width))
    return _parse_text(content, name)


@dataclass(frozen=True)
class _Words:
    """The words of a binary file: byte order, and 4 or 8 bytes (Nastran's i8 mode, where all reals have 8)."""

    order: str
    width: int

    def whole(self, data: bytes) -> NDArray[Any]:
        return np.frombuffer(data, f"{self.order}i{self.width}")

    def reals(self, kind: int) -> tuple[int, str]:
        """Return the words of one real number of a type of matrix, and its dtype."""
        n_bytes = 4 if kind in (1, 3) and self.width == 4 else 8
        return n_bytes // self.width, f"{self.order}f{n_bytes}"

    def name(self, data: bytes) -> str:
        """Return the text of two words, of which each holds four characters."""
        return b"".join(data[at : at + 4] for at in (0, self.width)).decode("latin-1").strip()


def _checked(name: str, matrix: str, n_columns: int, n_rows: int, kind: int) -> None:
    if not _NAME.match(matrix):
        raise ExportError(f"{name}: {matrix[:20]!r} is no name of a matrix. Is this an OUTPUT4 file, or a damaged one?")
    if kind not in (1, 2, 3, 4):
        raise ExportError(f"{name}: matrix {matrix} is of type {kind}; 1 to 4 exist. Damaged?")
    if not (0 <= n_rows < _LARGEST and 0 <= n_columns < _LARGEST):
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


def _parse_binary(content: bytes, name: str, words: _Words) -> dict[str, OutputMatrix]:
    marks = np.frombuffer(content[: len(content) // 4 * 4], words.order + "i4")
    width = words.width
    at = 0

    def record() -> bytes:
        nonlocal at
        length = int(marks[at]) if at < len(marks) else -1
        end = at + 1 + length // 4
        if length < 3 * width or length % width or end >= len(marks) or marks[end] != length:
            raise ExportError(f"{name}: no whole record at byte {4 * at}: truncated or damaged.")
        found = content[4 * at + 4 : 4 * end]
        at = end + 1
        return found

    matrices: dict[str, OutputMatrix] = {}
    while at < len(marks):
        header = record()
        if len(header) != (_HEADER_WORDS + 2) * width:
            raise ExportError(f"{name}: expected a matrix' header at byte {4 * at - len(header)}: damaged.")
        n_columns, n_rows, _, kind = (int(word) for word in words.whole(header[: _HEADER_WORDS * width]))
        matrix = words.name(header[_HEADER_WORDS * width :])
        big = n_rows < 0
        n_rows = abs(n_rows)
        _checked(name, matrix, n_columns, n_rows, kind)
        per_value, real = words.reals(kind)
        found = _Column([], [], [], kind > 2)
        while True:
            data = record()
            column, row, n_words = (int(word) for word in words.whole(data[: 3 * width]))
            if column > n_columns:
                break
            body = data[3 * width :]
            if column < 1 or row < 0 or n_words * width != len(body):
                raise ExportError(f"{name}: column {column} of matrix {matrix} is damaged.")
            if row > 0:
                if n_words % per_value:
                    raise ExportError(f"{name}: column {column} of matrix {matrix} is damaged.")
                found.add(row, column, np.frombuffer(body, real).astype(np.float64))
                continue
            place = 0
            while place < n_words:
                row, length, head = _string(words.whole(body[width * place : width * (place + 2)]), big)
                start = place + head
                place = start + length
                if row < 1 or length < 1 or length % per_value or place > n_words:
                    raise ExportError(f"{name}: column {column} of matrix {matrix} has a string that is damaged.")
                found.add(row, column, np.frombuffer(body[width * start : width * place], real).astype(np.float64))
        matrices[matrix.upper()] = _finished(name, matrix, (n_rows, n_columns), found, None)
    return matrices


def _string(words: NDArray[Any], big: bool) -> tuple[int, int, int]:
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

    def integers(widths: tuple[int, ...], what: str) -> list[int]:
        nonlocal at
        line = lines[at] if at < len(lines) else ""
        at += 1
        ends = list(itertools.accumulate(widths))
        try:
            return [int(line[end - width : end]) for width, end in zip(widths, ends, strict=True)]
        except ValueError:
            raise ExportError(
                f"{name}, line {at}: expected {what}, found {line[:60]!r}: truncated or damaged."
            ) from None

    while at < len(lines) and lines[at].strip():
        header = lines[at]
        widths = (16, 16, 8, 8) if header.rstrip().endswith(_WIDE) else (8, 8, 8, 8)
        n_columns, n_rows, _, kind = integers(widths, "columns, rows, form, type")
        name_at = sum(widths)
        matrix = header[name_at : name_at + 8].strip()
        printed = _FORMAT.search(header[name_at + 8 :].strip() or _OLD_FORMAT)
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
            column, row, n_words = integers((8, 8, 8), "column, row, words")
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
                string = np.array(integers((8, 8) if big else (whole_line,), "a string"))
                row, length, head = _string(string, big)
                left -= length + head
                if row < 1 or length < 1 or length % per_value or left < 0:
                    raise ExportError(f"{name}, line {at}: a string of matrix {matrix} is damaged.")
                found.add(row, column, values(length // per_value))
        matrices[matrix.upper()] = _finished(name, matrix, (n_rows, n_columns), found, digits)
    if not matrices:
        raise ExportError(f"{name} holds no matrix of OUTPUT4.")
    return matrices
