"""The channel table: which column of a file is which channel, in which unit."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ibsdyn.errors import RecordError, known_keywords, nearest
from ibsdyn.records.file_bytes import read_bytes, text_of
from ibsdyn.records.units import sensitivity_to_si
from ibsdyn.validation import number

_FIELDS = ("name", "column", "unit", "scale", "sensitivity")


@dataclass(frozen=True, init=False)
class Channel:
    """One line of a channel table.

    Parameters
    ----------
    name : of the channel in the record, such as the accelerometer's.
    column : label or number (from 0, time columns not counted) in the file; None where the file's label is the name,
        or where the whole table stands in the order of the columns.
    unit : of the numbers in the file (after ``scale``); what the file says if None. Known units are turned to SI.
    scale : the file's numbers are multiplied with it first; -1 turns a sensor round, 10 makes volts of a WAV file
        that was recorded with a full scale of 10 V.
    sensitivity : of the sensor where volts or coulombs were recorded, as its data sheet prints it: "102.3 mV/g".

    Raises
    ------
    RecordError : an empty name, a scale of zero, a sensitivity that cannot be understood.
    """

    name: str
    column: str | int | None
    unit: str | None
    scale: float
    sensitivity: str | None

    @known_keywords
    def __init__(
        self,
        name: str,
        column: str | int | None = None,
        unit: str | None = None,
        scale: float = 1.0,
        sensitivity: str | None = None,
    ) -> None:
        what = f"channel {name!r}"
        if not isinstance(name, str) or not name.strip():
            raise RecordError(f"a channel's name must be a non-empty text, got {name!r}.")
        if isinstance(column, bool) or not isinstance(column, (str, int, type(None))):
            raise RecordError(f"{what}: column must be a label or a number from 0, got {column!r}.")
        if unit is not None and not isinstance(unit, str):
            raise RecordError(f"{what}: unit must be a text such as 'm/s²', got {unit!r}.")
        factor = number(scale, f"{what}: scale", "")
        if factor == 0.0:
            raise RecordError(f"{what}: scale is zero, which would erase the channel.")
        if sensitivity is not None:
            if not isinstance(sensitivity, str):
                raise RecordError(f"{what}: sensitivity must be a text such as '102.3 mV/g', got {sensitivity!r}.")
            sensitivity_to_si(sensitivity, what)
        fields = {"name": name, "column": column, "unit": unit, "scale": factor, "sensitivity": sensitivity}
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor


Channels = Sequence[Channel] | Mapping[str, str] | str | os.PathLike[str]


def channel_table(channels: Channels) -> tuple[Channel, ...]:
    """Return a channel table, from a list of ``Channel``, a mapping {name: unit} or the path of a CSV.

    Parameters
    ----------
    channels : a CSV has a line of titles (name, and any of column, unit, scale, sensitivity), then a line a channel.

    Raises
    ------
    RecordError : no channels, two of one name, or a CSV that is no table; MissingRecordError where it does not exist.
    """
    if isinstance(channels, (str, os.PathLike)):
        table = _from_csv(Path(channels))
    elif isinstance(channels, Mapping):
        table = tuple(Channel(name, unit=unit) for name, unit in channels.items())
    else:
        table = tuple(channels) if isinstance(channels, (list, tuple)) else (channels,)  # type: ignore[assignment]
    for channel in table:
        if not isinstance(channel, Channel):
            raise RecordError(
                f"channels must be ibs.Channel, a mapping {{name: unit}} or a CSV's path, got {channel!r}."
            )
    names = [channel.name for channel in table]
    for name in names:
        if names.count(name) > 1:
            raise RecordError(f"the channel table has {names.count(name)} channels {name!r}; names must differ.")
    if not names:
        raise RecordError("the channel table is empty.")
    return table


def _from_csv(path: Path) -> tuple[Channel, ...]:
    text = text_of(read_bytes(path))
    delimiter = max(";,\t", key=text.partition("\n")[0].count)
    lines = [[cell.strip() for cell in row] for row in csv.reader(io.StringIO(text), delimiter=delimiter)]
    lines = [row for row in lines if any(row) and not row[0].startswith("#")]
    titles = [title.casefold() for title in lines[0]] if lines else []
    for title in titles:
        if title not in _FIELDS:
            raise RecordError(f"{path.name}: title {title!r} is not known. {nearest(title, _FIELDS)}")
    if "name" not in titles:
        raise RecordError(f"{path.name}: the first line must hold the titles name, column, unit, scale, sensitivity.")
    return tuple(_of_row(dict(zip(titles, row, strict=False)), path.name) for row in lines[1:])


def _of_row(row: Mapping[str, str], source: str) -> Channel:
    given = {title: cell for title, cell in row.items() if cell}
    column = given.get("column")
    try:
        scale = float(given.get("scale", "1").replace(",", "."))
    except ValueError:
        raise RecordError(f"{source}: scale {given['scale']!r} of {given.get('name')!r} is not a number.") from None
    place = int(column) if column is not None and column.isdecimal() else column
    return Channel(given.get("name", ""), place, given.get("unit"), scale, given.get("sensitivity"))
