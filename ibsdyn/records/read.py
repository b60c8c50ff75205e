"""A file and a channel table in, a time record out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError, RecordWarning, known_keywords, warn_user
from ibsdyn.records.channel_table import Channel, Channels, channel_table
from ibsdyn.records.columns import Columns
from ibsdyn.records.csv_file import read_csv
from ibsdyn.records.file_bytes import existing
from ibsdyn.records.flat_tops import flat_tops
from ibsdyn.records.hdf5_file import read_hdf5
from ibsdyn.records.mat_file import read_mat
from ibsdyn.records.npz_file import read_npz
from ibsdyn.records.sampling import one_rate
from ibsdyn.records.uff_file import read_uff
from ibsdyn.records.units import KNOWN, sensitivity_to_si, to_si
from ibsdyn.records.wav_file import read_wav
from ibsdyn.time_record import TimeRecord
from ibsdyn.validation import number

_HDF5 = b"\x89HDF\r\n\x1a\n"
_HDF5_AT = (0, 512)  # MATLAB puts a text of 512 bytes in front


@known_keywords
def read_record(
    path: str | os.PathLike[str],
    channels: Channels | None = None,
    sample_rate: float | None = None,
    time: str | int | bool | None = None,
    period: int | None = None,
    title: str | None = None,
) -> TimeRecord:
    """Read a measured record: UFF 58, CSV, MAT, NPZ, WAV or HDF5, told by its content.

    Parameters
    ----------
    path : the file.
    channels : the channel table: a list of ``Channel``, a mapping {name: unit} or the path of a CSV with the columns
        name, column, unit, scale, sensitivity; every column of the file under its own label if None.
    sample_rate : [Hz], where the file does not say it.
    time : label or number of the column of times, where it is not called time or t; False where there is none.
    period : samples in one period of the excitation, if it was periodic and the file does not say so.
    title : of the record; the file's name if None.

    Returns
    -------
    TimeRecord in SI.

    Warns
    -----
    RecordWarning : clipped or constant channels, and units that are not known and therefore kept.

    Raises
    ------
    MissingRecordError : the file does not exist.
    UnknownNameError : a channel asks for a column that is not there.
    RecordError : what else is wrong with file or table, and how to mend it.
    ExtraMissingError : the format needs an extra (``ibsdyn[uff]``, ``ibsdyn[hdf5]``).
    """
    if not isinstance(path, (str, os.PathLike)):
        raise RecordError(f"read_record: path must be the path of a file, got {path!r}.")
    source = existing(Path(path))
    columns = _columns(source, time)
    chosen, places = _chosen(columns, channels)
    _refuse_unequal_lengths(columns, places)
    given = None if sample_rate is None else number(sample_rate, "sample_rate", "Hz", above=0.0)
    rate = one_rate({columns.labels[place]: columns.sample_rates[place] for place in places}, given, columns.source)
    signals, units = [], []
    for channel, place in zip(chosen, places, strict=True):
        raw = columns.values[place]
        _warn_of_suspicious(channel.name, raw, columns.source)
        with np.errstate(over="ignore", invalid="ignore"):  # TimeRecord refuses what is not finite, and says where
            values, unit = _physical(channel, raw, columns.units[place], columns)
        signals.append(values)
        units.append(unit)
    return TimeRecord(
        signals=np.array(signals),
        names=[channel.name for channel in chosen],
        units=units,
        sample_rate=rate,
        start=columns.starts[places[0]],
        period=columns.period if period is None else period,
        title=title or source.name,
    )


def _columns(path: Path, time: str | int | bool | None) -> Columns:
    with path.open("rb") as stream:
        head = stream.read(1024)
    if not head:
        raise RecordError(f"{path.name} is empty.")
    if head[:4] in (b"RIFF", b"RIFX", b"RF64"):
        return read_wav(path)
    if head.lstrip()[:3] == b"-1\n" or head.lstrip()[:4] == b"-1\r\n" or head[:80].strip() == b"-1":
        return read_uff(path)
    named = None if isinstance(time, int) and not isinstance(time, bool) else time
    if any(head[at : at + len(_HDF5)] == _HDF5 for at in _HDF5_AT):
        return read_hdf5(path, named)
    if head[:2] == b"PK":
        return read_npz(path, named)
    if head.startswith(b"MATLAB "):
        return read_mat(path, named)
    return read_csv(path, time)


def _chosen(columns: Columns, channels: Channels | None) -> tuple[tuple[Channel, ...], list[int]]:
    """Return the channels and the place of each one's column."""
    if channels is None:
        return tuple(Channel(label, column=label) for label in columns.labels), list(range(len(columns.labels)))
    table = channel_table(channels)
    in_order = all(channel.column is None for channel in table) and not all(
        channel.name in columns.labels for channel in table
    )
    if in_order:
        count = len(columns.labels)
        if len(table) != count:
            raise RecordError(
                f"{columns.source} has {count} columns {list(columns.labels[:20])}, the channel table "
                f"{len(table)} channels {[channel.name for channel in table]}, and neither says which is which. Give "
                "column= in the table, the label or the number of each channel's column."
            )
        return table, list(range(count))
    places = [
        columns.place(channel.name if channel.column is None else channel.column, f"channel {channel.name!r}")
        for channel in table
    ]
    for place, channel in zip(places, table, strict=True):
        if places.count(place) > 1:
            raise RecordError(
                f"{columns.source}: column {columns.labels[place]!r} is taken for two channels, {channel.name!r} one "
                "of them. Which is it?"
            )
    return table, places


def _refuse_unequal_lengths(columns: Columns, places: Sequence[int]) -> None:
    lengths = {columns.labels[place]: len(columns.values[place]) for place in places}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{label!r} {length}" for label, length in lengths.items())
        raise RecordError(
            f"{columns.source}: channels have unequal numbers of samples: {listed}. Choose those that belong together "
            "with channels=, or cut or resample them to one length."
        )
    starts = {columns.labels[place]: columns.starts[place] for place in places}
    if len(set(starts.values())) > 1:
        listed = ", ".join(f"{label!r} {start:.9g} s" for label, start in starts.items())
        raise RecordError(
            f"{columns.source}: channels start at different times: {listed}. Were they triggered together?"
        )


def _physical(channel: Channel, raw: Array, said: str | None, columns: Columns) -> tuple[Array, str]:
    """Return a channel's values and unit, in SI where the unit is known."""
    what = f"{columns.source}, channel {channel.name!r}"
    unit = channel.unit if channel.unit is not None else said
    if columns.full_scale and channel.scale == 1.0 and channel.unit is None:
        unit = "-"  # of full scale; without a table no one can say more
    if unit is None or not unit.strip():
        known = "such as 'm/s²', 'g', 'V'"
        raise RecordError(f"{what}: neither the file nor the channel table says its unit, {known}. Give channels=.")
    scaled = raw * channel.scale
    known_unit = to_si(unit)
    if channel.sensitivity is not None:
        per_unit, recorded, measured = sensitivity_to_si(channel.sensitivity, what)
        if known_unit is None or known_unit[1] != recorded:
            raise RecordError(
                f"{what}: its sensitivity is {channel.sensitivity!r}, but the file's numbers are in {unit!r}; they "
                f"must be in {recorded} or a multiple of it. If they are in {measured} already, leave sensitivity out."
            )
        return scaled * (known_unit[0] / per_unit), measured
    if known_unit is None:
        warn_user(
            f"{what}: unit {unit!r} is not known and kept as it is. Known: {', '.join(KNOWN)}.",
            RecordWarning,
        )
        return scaled, unit
    return scaled * known_unit[0], known_unit[1]


def _warn_of_suspicious(name: str, raw: Array, source: str) -> None:
    if not np.isfinite(raw).all():
        return  # TimeRecord refuses it, and says where
    tops = flat_tops(raw)
    if tops is not None:
        warn_user(
            f"{source}: channel {name!r} stays at its extreme value {tops.value:.6g} (as recorded) in {tops.places} "
            f"places, {tops.samples} samples in all: clipped? Its spectra are then wrong at all frequencies; measure "
            "again with less gain.",
            RecordWarning,
        )
    elif raw.size > 1 and raw.min() == raw.max():
        warn_user(
            f"{source}: channel {name!r} is constant ({raw[0]:g}). Is its sensor connected?",
            RecordWarning,
        )
