"""The input and output channels of one or several records, checked to belong together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError
from ibsdyn.time_record import TimeRecord


@dataclass(frozen=True, eq=False)
class Channels:
    """What an estimate reads: inputs first, then outputs, of records with one sample rate.

    Attributes
    ----------
    records : runs of one experiment.
    inputs, outputs : names of channels that every record has.
    input_units, output_units : units of each.
    sample_rate : [Hz].
    """

    records: tuple[TimeRecord, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    sample_rate: float

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.inputs)

    @property
    def count(self) -> int:
        """Number of inputs and outputs together."""
        return len(self.inputs) + len(self.outputs)

    @property
    def n_samples(self) -> tuple[int, ...]:
        """Samples of each record."""
        return tuple(record.n_samples for record in self.records)

    def read(self, record: int, begin: int, end: int) -> Array:
        """Return the (count, end - begin) samples of a record."""
        run = self.records[record]
        taken = np.empty((self.count, end - begin))
        for row, name in enumerate((*self.inputs, *self.outputs)):  # channel by channel: no other one is copied
            taken[row] = run.signals[run.index(name), begin:end]
        return taken

    def means(self, record: int) -> Array:
        """Return the (count, 1) mean of each channel over a record."""
        run = self.records[record]
        rows = [run.index(name) for name in (*self.inputs, *self.outputs)]
        return np.array([[run.signals[row].mean()] for row in rows])


def checked_channels(
    records: TimeRecord | Sequence[TimeRecord], inputs: str | Sequence[str], outputs: str | Sequence[str]
) -> Channels:
    """Return the channels of records that belong together.

    Raises
    ------
    RecordError : no records, no channels, a channel asked for twice, one that is constant; records of different
        sample rate or units.
    UnknownNameError : a record without one of the channels.
    """
    runs = (records,) if isinstance(records, TimeRecord) else tuple(records) if isinstance(records, Iterable) else ()
    if not runs or not all(isinstance(run, TimeRecord) for run in runs):
        raise RecordError(f"records must be a TimeRecord or a list of them, got {records!r}.")
    sources, sensors = _names(inputs, "inputs"), _names(outputs, "outputs")
    both = [name for name in sensors if name in sources]
    if both:
        raise RecordError(f"{both[0]!r} is among inputs and outputs; its response to itself is 1 by definition.")
    first = runs[0]
    named = (*sources, *sensors)
    units = tuple(first.units[first.index(name)] for name in named)
    for number, run in enumerate(runs):
        if run.sample_rate != first.sample_rate:
            raise RecordError(
                f"record {number + 1} ({run.title}) has {run.sample_rate:g} Hz, record 1 ({first.title}) "
                f"{first.sample_rate:g} Hz; resample them to one rate."
            )
        for name, unit in zip(named, units, strict=True):
            row = run.index(name)
            if run.units[row] != unit:
                raise RecordError(
                    f"channel {name!r} is in {run.units[row]} in record {number + 1} ({run.title}), in {unit} in "
                    f"record 1; convert it."
                )
            if np.ptp(run.signals[row]) == 0.0 and (len(runs) == 1 or name in sensors):
                raise RecordError(
                    f"channel {name!r} of record {number + 1} ({run.title}) is constant at {run.signals[row, 0]:g}: "
                    "not connected, or not excited."
                )
    count = len(sources)
    return Channels(runs, sources, sensors, units[:count], units[count:], first.sample_rate)


def _names(names: str | Sequence[str], what: str) -> tuple[str, ...]:
    listed = (names,) if isinstance(names, str) else tuple(names) if isinstance(names, (list, tuple)) else ()
    if not listed or not all(isinstance(name, str) for name in listed):
        raise RecordError(f"{what} must be one or several channel names, got {names!r}.")
    for name in listed:
        if listed.count(name) > 1:
            raise RecordError(f"{what} name the channel {name!r} {listed.count(name)} times.")
    return listed
