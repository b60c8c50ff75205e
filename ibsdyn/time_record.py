"""Time records, simulated or measured, that carry their names and units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError, UnknownNameError, known_keywords, nearest

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, init=False)
class TimeRecord:
    """Channels sampled at one rate, array order [channel, sample].

    Parameters
    ----------
    signals : (n_channels, n_samples) values; one channel may be given as (n_samples,). A copy is kept, but of a
        float64 ``numpy.memmap`` opened with mode "r", so that hours of data stay on the disk.
    names : name of each channel, all different.
    units : unit of each channel.
    sample_rate : [Hz].
    start : time of the first sample [s].
    period : samples in one period of the excitation; None where it is not periodic. Periods need not begin with
        the record and the last one need not be complete.
    title : what was recorded, for figures and messages.

    Raises
    ------
    RecordError : shapes, names or units that do not fit each other; values that are not finite.
    """

    signals: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    sample_rate: float
    start: float
    period: int | None
    title: str

    @known_keywords
    def __init__(
        self,
        signals: ArrayLike,
        names: Sequence[str],
        units: Sequence[str],
        sample_rate: float,
        start: float = 0.0,
        period: int | None = None,
        title: str = "record",
    ) -> None:
        named = _texts(names, "names", title)
        for name in named:
            if named.count(name) > 1:
                raise RecordError(f"{title}: {named.count(name)} channels are called {name!r}; names must differ.")
        values = _signals(signals, named, title)
        united = _texts(units, "units", title)
        if len(united) != len(named):
            raise RecordError(f"{title}: {len(united)} units for {len(named)} channels {list(named)}.")
        if period is not None and (not isinstance(period, Integral) or isinstance(period, bool) or period < 1):
            raise RecordError(
                f"{title}: period must be a whole number of samples, got {period!r}. A period that is no whole number "
                "of samples leaks; choose sample_rate as a multiple of the excitation's base frequency."
            )
        if period is not None and period > values.shape[1]:
            raise RecordError(
                f"{title}: a period has {period} samples, the record only {values.shape[1]}; it needs one full period."
            )
        fields = {
            "signals": values,
            "names": named,
            "units": united,
            "sample_rate": _finite(sample_rate, "sample_rate [Hz]", title, positive=True),
            "start": _finite(start, "start [s]", title),
            "period": None if period is None else int(period),
            "title": title,
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    def __repr__(self) -> str:
        """Name the channels, the length and the rate."""
        return (
            f"TimeRecord({self.title!r}: {len(self.names)} channels x {self.n_samples} samples, "
            f"{self.duration:.4g} s at {self.sample_rate:g} Hz)"
        )

    def __getitem__(self, name: str) -> Array:
        """Return the (n_samples,) values of a channel; UnknownNameError if there is none of that name."""
        return np.asarray(self.signals[self.index(name)])

    def index(self, name: str) -> int:
        """Return a channel's row; UnknownNameError if there is none of that name."""
        if name not in self.names:
            raise UnknownNameError(f"{self.title}: no channel {name!r}. {nearest(str(name), self.names)}")
        return self.names.index(name)

    @property
    def n_samples(self) -> int:
        """Samples of each channel."""
        return int(self.signals.shape[1])

    @property
    def time(self) -> Array:
        """(n_samples,) times of the samples [s]."""
        return self.start + np.arange(self.n_samples) / self.sample_rate

    @property
    def duration(self) -> float:
        """Length [s]: samples over rate."""
        return self.n_samples / self.sample_rate

    @property
    def rms(self) -> Array:
        """(n_channels,) root mean square about the mean, in each channel's unit."""
        rms: Array = np.std(self.signals, axis=1)
        return rms

    def select(self, names: str | Sequence[str]) -> TimeRecord:
        """Return some channels in the order asked; UnknownNameError for one that is not there."""
        rows = [self.index(name) for name in ([names] if isinstance(names, str) else names)]
        return replace(
            self,
            signals=self.signals[rows],
            names=tuple(self.names[row] for row in rows),
            units=tuple(self.units[row] for row in rows),
        )

    def to_xarray(self) -> Any:
        """Return an xarray.DataArray over channel and time (extra ``xarray``)."""
        from ibsdyn.interchange.views import record_to_xarray

        return record_to_xarray(self)

    def to_dataframe(self) -> Any:
        """Return a pandas.DataFrame: times [s] down, channels across (extra ``pandas``)."""
        from ibsdyn.interchange.views import record_to_dataframe

        return record_to_dataframe(self)

    def plot(self, axes: Sequence[Axes] | np.ndarray | None = None, label: str | None = None) -> np.ndarray:
        """Draw the channels over time, those of one unit in one panel.

        Parameters
        ----------
        axes : what an earlier call returned, to draw over it; a new figure if None.
        label : put before the channels' names in the legend.

        Returns
        -------
        (n_units,) array of matplotlib Axes.
        """
        from ibsdyn.plotting.time_history import plot_time_history

        return plot_time_history(self, axes, label)


def _signals(signals: ArrayLike, names: tuple[str, ...], title: str) -> Array:
    try:
        kept = isinstance(signals, np.memmap) and signals.dtype == np.float64 and signals.mode == "r"
        values = np.atleast_2d(signals) if kept else np.array(signals, dtype=np.float64, ndmin=2)
    except (TypeError, ValueError):
        lengths = [np.size(row) for row in signals] if isinstance(signals, (list, tuple)) else []
        if len(set(lengths)) > 1:
            raise RecordError(
                f"{title}: channels {list(names)} have unequal lengths {lengths}; cut or resample them to one."
            ) from None
        raise RecordError(f"{title}: signals must be real numbers (n_channels, n_samples).") from None
    if values.ndim != 2 or values.shape[0] != len(names) or values.shape[1] == 0:
        turned = " Turn it over (.T)." if values.ndim == 2 and values.shape[1] == len(names) else ""
        raise RecordError(
            f"{title}: signals have shape {values.shape}, but there are {len(names)} channels {list(names)}; the order "
            f"is [channel, sample].{turned}"
        )
    for name, channel in zip(names, values, strict=True):  # one by one: the check of hours of data takes memory too
        broken = ~np.isfinite(channel)
        if broken.any():
            first = int(broken.argmax())
            raise RecordError(
                f"{title}: channel {name!r} is {channel[first]} at sample {first} ({int(broken.sum())} of its values "
                "are not finite). Cut the record before it, or mend the gap; a spectrum cannot leave samples out."
            )
    values.flags.writeable = False
    return np.asarray(values)


def _texts(values: object, what: str, title: str) -> tuple[str, ...]:
    listed = (values,) if isinstance(values, str) else tuple(values) if isinstance(values, (list, tuple)) else ()
    if not listed or not all(isinstance(value, str) for value in listed):
        raise RecordError(f"{title}: {what} must be a list of texts, one a channel, got {values!r}.")
    if what == "names" and not all(value.strip() for value in listed):
        raise RecordError(f"{title}: an empty channel name in {list(listed)}.")
    return listed


def _finite(value: object, what: str, title: str, positive: bool = False) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]  # whatever it is, float() says whether it is a number
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number) or (positive and number <= 0.0):
        raise RecordError(f"{title}: {what} must be a {'positive' if positive else 'finite'} number, got {value!r}.")
    return number
