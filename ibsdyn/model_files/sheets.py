"""Rows of text out of CSV files and spreadsheets, as CAD and office programs write them."""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ibsdyn.errors import ExtraMissingError, ModelFileError, ModelWarning, warn_user
from ibsdyn.model_files.text_file import MAX_BYTES, read_bytes

MAX_CELLS = 1_000_000
MAX_UNPACKED = 200 * 2**20
_SPREADSHEETS = (".xlsx", ".xlsm")


@dataclass(frozen=True)
class Sheet:
    """A table of cells.

    Attributes
    ----------
    where : how errors call it, as ``springs.csv`` or ``machine.xlsx, sheet 'bodies'``.
    title : of the sheet, or the file's name without ending.
    rows : texts and numbers as they stand in the file, with their line numbers.
    """

    where: str
    title: str
    rows: tuple[tuple[int, tuple[str | float, ...]], ...]


def read_sheets(path: Path) -> list[Sheet]:
    """Return the sheets of a spreadsheet, or the one of a text file.

    Raises
    ------
    MissingFileError : it is not there.
    ModelFileError : no such file, or too large.
    ExtraMissingError : a spreadsheet, and openpyxl is not installed.

    Warns
    -----
    ModelWarning : a text that is not UTF-8.
    """
    if path.suffix.lower() in _SPREADSHEETS:
        return _spreadsheet(path)
    if path.suffix.lower() == ".xls":
        raise ModelFileError(f"{path.name}: the old .xls is not read; save it as .xlsx or CSV.")
    content = read_bytes(path)
    if content.startswith(b"PK"):
        raise ModelFileError(f"{path.name} is a spreadsheet by its content; give it the ending .xlsx.")
    return [_text_table(path, _decoded(content, path.name))]


def _decoded(content: bytes, name: str) -> str:
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):  # "Unicode text" of Excel
        try:
            return content.decode("utf-16")
        except UnicodeDecodeError:
            raise ModelFileError(f"{name} begins as UTF-16 does but is not; save it as UTF-8.") from None
    if b"\0" in content:
        raise ModelFileError(f"{name} is no text; save it as CSV in UTF-8.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        warn_user(f"{name} is not UTF-8; it is read as Windows-1252. Names may come out wrong.", ModelWarning)
        return content.decode("cp1252", errors="replace")


def _text_table(path: Path, text: str) -> Sheet:
    lines = text.lstrip("\n").splitlines()
    divider = None
    if lines and lines[0].strip().lower().startswith("sep="):  # Excel's own first line
        divider = lines[0].strip()[4:5]
        text = text.split("\n", 1)[1] if "\n" in text else ""
        first = 2
    else:
        first = 1
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=divider or _divider(lines))
    rows: list[tuple[int, tuple[str | float, ...]]] = []
    count, start = 0, first
    try:
        for row in reader:
            count += len(row)
            _refuse_many(count, path.name)
            cells = tuple(cell.strip() for cell in row)
            if any(cells) and not cells[0].startswith("#"):
                rows.append((start, cells))
            start = first + reader.line_num
    except csv.Error as error:
        raise ModelFileError(f"{path.name}: line {first - 1 + reader.line_num}: {error}.") from None
    return Sheet(path.name, path.stem, tuple(rows))


def _divider(lines: list[str]) -> str:
    """Semicolon or tab where a heading has one: then commas are decimal commas; else the comma."""
    for line in lines:
        if line.strip() and not line.startswith("#"):
            for candidate in (";", "\t", ","):
                if candidate in line:
                    return candidate
    return ","


def _spreadsheet(path: Path) -> list[Sheet]:
    try:
        import openpyxl
    except ImportError:
        raise ExtraMissingError(
            f'{path.name}: spreadsheets need openpyxl: pip install "ibsdyn[excel]"; or save it as CSV.'
        ) from None
    content = read_bytes(path, MAX_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            size = sum(part.file_size for part in packed.infolist())
        if size > MAX_UNPACKED:
            raise ModelFileError(f"{path.name} unpacks to {size} bytes; at most {MAX_UNPACKED} are read.")
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        return [
            Sheet(f"{path.name}, sheet {sheet.title!r}", sheet.title, tuple(_sheet_rows(sheet, path.name)))
            for sheet in book.worksheets
        ]
    except ModelFileError:
        raise
    except Exception as error:  # a damaged zip or XML raises whatever its parser raises
        raise ModelFileError(f"{path.name} is no spreadsheet or damaged ({type(error).__name__}: {error}).") from error


def _sheet_rows(sheet: Any, name: str) -> Iterator[tuple[int, tuple[str | float, ...]]]:
    count = 0
    for number, row in enumerate(sheet.iter_rows(values_only=True), 1):
        count += len(row)
        _refuse_many(count, name)
        cells = tuple(_cell(value) for value in row)
        if any(cell != "" for cell in cells) and not str(cells[0]).startswith("#"):
            yield number, cells


def _cell(value: object) -> str | float:
    if value is None:
        return ""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    return str(value).strip()


def _refuse_many(count: int, name: str) -> None:
    if count > MAX_CELLS:
        raise ModelFileError(f"{name} has more than {MAX_CELLS} cells; is it a table of components?")
