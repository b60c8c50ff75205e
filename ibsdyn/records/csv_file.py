"""CSV and other text files of columns, in the dialects that data acquisition programs write."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError, nearest
from ibsdyn.records.columns import Columns, different
from ibsdyn.records.file_bytes import read_bytes, text_of
from ibsdyn.records.sampling import rate_of_time, warn_of_other_rate
from ibsdyn.records.units import to_si

# Where only blanks separate, a comma is a decimal one; between digits it is one only beside another separator.
_DELIMITERS = (";", "\t", ",", None)
_HEADER_LINES = 1000
_CHUNK = 1 << 16  # lines converted at once, so that the text of an hour is not split into cells all together
_TITLE = re.compile(r"^(?P<label>.*?)\s*[\[(](?P<unit>[^\[\]]*)[\])]$")
_RATE = re.compile(
    r"(?:sample[ _]?rate|sampling[ _](?:rate|frequency)|\bfs)\b(?P<before>[^\d\n]{0,20})"
    r"(?P<number>\d+(?:[.,' \u00a0\u202f]\d+)*(?:e[+-]?\d+)?)(?P<after>[^\n]{0,12})",
    re.I,
)
_PREFIX = re.compile(r"(?<![a-z])(?P<prefix>[km])\s?(?:hz|sa?/s|sps|samples/s)", re.I)
_PREFIXES = {"": 1.0, "k": 1e3, "m": 1e6}
_PLAIN = re.compile(r"\d+(?:[.,]\d+)?(?:e[+-]?\d+)?", re.I)
# 51 200, 51'200, 51,200.0 and 1.048.576,0: separators that can only be those of thousands.
_GROUPED = re.compile(
    r"\d{1,3}(?:[' \u00a0\u202f]\d{3})+(?:[.,]\d+)?|\d{1,3}(?:,\d{3})+\.\d+|\d{1,3}(?:\.\d{3})+,\d+"
    r"|\d{1,3}(?:,\d{3}){2,}|\d{1,3}(?:\.\d{3}){2,}"
)
_DECIMALS = re.compile(r"[.,](?=\d+$)")
# 51,200 may be either.
_EITHER = re.compile(r"\d{1,3},\d{3}")
_TIMES = ("t", "time", "times", "zeit", "x_value")
_TIME_UNITS = {None: 1.0, "": 1.0, "s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "µs": 1e-6, "us": 1e-6}


def read_csv(path: Path, time: str | int | bool | None) -> Columns:
    """Return the columns of a text file of numbers.

    The delimiter (semicolon, tab, comma, blanks), decimal commas, titles with units in brackets, a line that names
    the sample rate and a column of times are found out.

    Raises
    ------
    RecordError : no numbers, lines of unequal length, cells that are no numbers.
    """
    text = text_of(read_bytes(path))
    if "\0" in text:
        raise RecordError(f"{path.name} is no text and none of the binary formats UFF, MAT, NPZ, WAV and HDF5.")
    lines = text.splitlines()
    del text
    first, delimiter = _first_numbers(lines, path.name)
    header = lines[:first]
    table = _numbers(lines, first, delimiter, path.name)
    labels, units = _titles(header, delimiter, table.shape[1])
    clock = _time_column(labels, time, path.name)
    values, rate, start = list(table.T), _announced_rate(header), 0.0
    if clock is not None:
        factor = _TIME_UNITS.get(units[clock])
        if factor is None:
            raise RecordError(f"{path.name}: the times are in {units[clock]!r}; known: s, ms, µs.")
        announced, (rate, start) = rate, rate_of_time(values.pop(clock) * factor, path.name)
        warn_of_other_rate(path.name, "its header", announced, rate)
        labels.pop(clock)
        units.pop(clock)
    if not values:
        raise RecordError(f"{path.name} has no column besides the time.")
    return Columns(
        source=path.name,
        labels=different(labels),
        values=tuple(values),
        units=tuple(units),
        sample_rates=(rate,) * len(values),
        starts=(start,) * len(values),
    )


def _cells(line: str, delimiter: str | None) -> list[str]:
    cells = line.split(delimiter)
    if delimiter is not None and len(cells) > 1 and not cells[-1].strip():
        cells.pop()  # a delimiter at the end of each line
    return [cell.strip().strip('"') for cell in cells]


def _are_numbers(line: str, delimiter: str | None) -> bool:
    try:
        cells = [float(_number(cell, delimiter)) for cell in _cells(line, delimiter)]
    except ValueError:
        return False
    return bool(cells)


def _number(cell: str, delimiter: str | None) -> str:
    return cell if delimiter == "," else cell.replace(",", ".")


def _first_numbers(lines: Sequence[str], source: str) -> tuple[int, str | None]:
    """Return the first line of numbers, which the next one continues, and the delimiter."""
    filled = [number for number, line in enumerate(lines[:_HEADER_LINES]) if line.strip()]
    for place, number in enumerate(filled):
        for delimiter in _DELIMITERS:
            if delimiter is not None and delimiter not in lines[number]:
                continue
            following = [lines[other] for other in filled[place : place + 3]]
            counts = {len(_cells(line, delimiter)) for line in following}
            if len(counts) == 1 and all(_are_numbers(line, delimiter) for line in following):
                return number, delimiter
    # A gap in the first lines of the table must not be told as "no table".
    raise RecordError(
        f"{source}: no table of numbers within the first {_HEADER_LINES} lines: three lines with equally many numbers "
        "are looked for, separated by semicolons, tabs, commas or blanks, no cell empty."
    )


def _numbers(lines: Sequence[str], first: int, delimiter: str | None, source: str) -> Array:
    count = len(_cells(lines[first], delimiter))
    return np.concatenate([_chunk(lines, at, delimiter, count, source) for at in range(first, len(lines), _CHUNK)])


def _chunk(lines: Sequence[str], at: int, delimiter: str | None, count: int, source: str) -> Array:
    piece = [line for line in lines[at : at + _CHUNK] if line.strip()]
    plain = piece if delimiter == "," else [line.replace(",", ".") for line in piece]
    try:
        if not piece:
            return np.empty((0, count))
        table: Array = np.loadtxt(plain, delimiter=delimiter, comments=None, ndmin=2, dtype=np.float64)
        if table.shape[1] == count:
            return table
    except ValueError:
        pass  # looked at line by line below, which takes quotes and names the cell that is no number
    return np.array(list(_rows(lines, at, delimiter, count, source)), dtype=np.float64)


def _rows(lines: Sequence[str], at: int, delimiter: str | None, count: int, source: str) -> Iterator[list[float]]:
    for number, line in enumerate(lines[at : at + _CHUNK], start=at + 1):
        if not line.strip():
            continue
        cells = _cells(line, delimiter)
        if len(cells) != count:
            raise RecordError(
                f"{source}, line {number} has {len(cells)} cells, the first line of numbers {count}; channels must be "
                f"equally long: {line.strip()[:80]!r}. Truncated?"
            )
        row = []
        for column, cell in enumerate(cells, start=1):
            try:
                row.append(float(_number(cell, delimiter)))
            except ValueError:
                raise RecordError(
                    f"{source}, line {number}, column {column}: {cell[:40]!r} is not a number. Cut the record before "
                    "it, or mend the gap."
                ) from None
        yield row


def _titles(header: Sequence[str], delimiter: str | None, count: int) -> tuple[list[str], list[str | None]]:
    """Return labels and units from the last line above the numbers that has as many cells, or numbers as labels."""
    for place in range(len(header) - 1, -1, -1):
        cells = _cells(header[place].lstrip("#% "), delimiter)
        if len(cells) != count or not any(cells):
            continue
        above = _cells(header[place - 1].lstrip("#% "), delimiter) if place else []
        in_brackets = [re.fullmatch(r"\[(.*)\]|\((.*)\)|", cell) for cell in cells]
        bare = [cell in _TIME_UNITS or to_si(cell) is not None for cell in cells]
        # A line of units below that of the titles.
        if len(above) == count and (all(in_brackets) or (all(bare) and all(above))):
            return above, [cell.strip("[]()") or None for cell in cells]
        found = [_TITLE.match(cell) for cell in cells]
        labels = [
            match["label"] if match and match["label"] else cell for match, cell in zip(found, cells, strict=True)
        ]
        return labels, [match["unit"].strip() if match and match["label"] else None for match in found]
    return [f"column {number}" for number in range(count)], [None] * count


def _time_column(labels: Sequence[str], time: str | int | bool | None, source: str) -> int | None:
    if time is False:
        return None
    if isinstance(time, str):
        if time not in labels:
            raise RecordError(f"{source} has no column {time!r} of times. {nearest(time, labels)}")
        return labels.index(time)
    if isinstance(time, int) and time is not True:
        if not 0 <= time < len(labels):
            raise RecordError(f"{source} has {len(labels)} columns; time={time} is none of them (numbers from 0).")
        return time
    return next((place for place, label in enumerate(labels) if label.casefold() in _TIMES), None)


def _announced_rate(header: Sequence[str]) -> float | None:
    """Return the sample rate [Hz] of a header; None where it names none, or one that can be read in two ways."""
    found = _RATE.search("\n".join(header))
    if found is None:
        return None
    number = found["number"]
    if _EITHER.fullmatch(number):
        return None
    if _PLAIN.fullmatch(number):
        rate = float(number.replace(",", "."))
    elif _GROUPED.fullmatch(number):
        whole, *decimals = _DECIMALS.split(number) if len(set(re.findall(r"\D", number))) > 1 else [number]
        rate = float(".".join([re.sub(r"\D", "", whole), *decimals]))
    else:
        return None
    prefix = _PREFIX.search(found["before"]) or _PREFIX.search(found["after"])
    rate *= _PREFIXES[prefix["prefix"].casefold() if prefix else ""]
    return rate if 0.0 < rate < math.inf else None
