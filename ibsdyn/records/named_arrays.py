"""Arrays by name, as MAT, NPZ and HDF5 files hold them, taken apart into columns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError
from ibsdyn.records.columns import Columns, different
from ibsdyn.records.sampling import rate_of_time, warn_of_other_rate

_RATES = ("fs", "sample_rate", "samplerate", "sampling_rate", "sampling_frequency", "sample_frequency")
_STEPS = ("dt", "sample_interval", "sampling_interval", "time_step")
_STARTS = ("start", "t0")
_PERIODS = ("period",)
_TIMES = ("t", "time", "times")
_LABELS, _UNITS = "names", "units"
# A rate and a step further apart than this are not one that was rounded.
_ROUNDED = 1e-3


def columns_of_arrays(
    arrays: Mapping[str, NDArray[Any]],
    source: str,
    time: str | bool | None = None,
    units: Mapping[str, str] | None = None,
    rates: Mapping[str, float] | None = None,
) -> Columns:
    """Return every vector and every row of a matrix (its long side is time) as a column.

    Parameters
    ----------
    arrays : by name; scalars called fs, sample_rate or dt are the rate, one called period counts samples, a vector
        called t or time is the time, texts called names and units belong to the rows of the matrix. Matrix rows are
        called ``data[0]``, ``data[1]`` ...
    source : the file's name.
    time : name of the vector of times; False where there is none in spite of its name.
    units, rates : what the file says of an array by its name.

    Raises
    ------
    RecordError : nothing but scalars, a time vector that does not fit, complex numbers.
    """
    scalars = {
        name.casefold(): float(np.real(array).item())
        for name, array in arrays.items()
        if array.size == 1 and array.dtype.kind in "iufb"
    }
    texts = {
        name.casefold(): [str(text) for text in array.ravel()] for name, array in arrays.items() if _is_text(array)
    }
    vectors = {name: array for name, array in arrays.items() if array.size > 1 and array.dtype.kind in "iufbc"}
    clock = _time_name(vectors, time, source)
    sample_rate, start = _first(scalars, _RATES), _first(scalars, _STARTS) or 0.0
    step, period = _first(scalars, _STEPS), _first(scalars, _PERIODS)
    if step:
        if sample_rate is not None and abs(sample_rate * step - 1.0) > _ROUNDED:
            raise RecordError(
                f"{source}: its sample rate of {sample_rate:g} Hz and its step of {step:g} s contradict each other; "
                "leave the wrong one out of the file."
            )
        sample_rate = sample_rate or 1.0 / step
    if clock is not None:
        times = np.asarray(vectors.pop(clock), dtype=np.float64).ravel()
        if vectors and not any(times.size in array.shape for array in vectors.values()):
            listed = ", ".join(f"{name!r} {array.shape}" for name, array in vectors.items())
            raise RecordError(
                f"{source}: {clock!r} has {times.size} times, which fit none of the arrays: {listed}. Cut them to one "
                "length, or leave the times out with time=False and give sample_rate=."
            )
        announced, (sample_rate, start) = sample_rate, rate_of_time(times, f"{source}, {clock}")
        warn_of_other_rate(source, "its scalar rate or step", announced, sample_rate)
    labels: list[str] = []
    values: list[Array] = []
    said: list[str | None] = []
    own_rates: list[float | None] = []
    matrices = sum(min(array.shape) > 1 for array in vectors.values())
    for name, array in vectors.items():
        rows = _rows(array, f"{source}, {name}")
        named = texts.get(_LABELS, []) if len(rows) > 1 and matrices == 1 else []
        if len(named) == len(rows):
            labels += named
        else:
            labels += [f"{name}[{row}]" for row in range(len(rows))] if len(rows) > 1 else [name]
        united = texts.get(_UNITS, []) if len(named) == len(rows) else []
        own_unit = (units or {}).get(name)
        said += united if len(united) == len(rows) else [own_unit] * len(rows)
        own_rates += [(rates or {}).get(name, sample_rate)] * len(rows)
        values += list(rows)
    if not values:
        raise RecordError(f"{source} holds no array of samples; it holds {', '.join(arrays) or 'nothing'}.")
    return Columns(
        source=source,
        labels=different(labels),
        values=tuple(values),
        units=tuple(said),
        sample_rates=tuple(own_rates),
        starts=(start,) * len(values),
        period=None if period is None else _whole(period, source),
    )


def _whole(period: float, source: str) -> int:
    if not period.is_integer() or period < 1:
        raise RecordError(
            f"{source}: its period of {period!r} is no whole number of samples; a period that is none leaks. Sample at "
            "a multiple of the excitation's base frequency, or leave the period out of the file."
        )
    return int(period)


def _is_text(array: NDArray[Any]) -> bool:
    return array.dtype.kind == "U"


def _first(scalars: Mapping[str, float], names: tuple[str, ...]) -> float | None:
    return next((scalars[name] for name in names if name in scalars), None)


def _time_name(vectors: Mapping[str, NDArray[Any]], time: str | bool | None, source: str) -> str | None:
    if time is False:
        return None
    if isinstance(time, str):
        if time not in vectors:
            raise RecordError(f"{source} has no array {time!r} of times; it has {', '.join(vectors) or 'none'}.")
        return time
    return next(
        (name for name, array in vectors.items() if name.casefold() in _TIMES and max(array.shape) == array.size), None
    )


def _rows(array: NDArray[Any], what: str) -> Array:
    """Return channels as rows of float64."""
    if array.dtype.kind == "c":
        raise RecordError(f"{what} is complex; a time record is real. Is it a spectrum?")
    squeezed = np.squeeze(array)
    if squeezed.ndim > 2:
        raise RecordError(f"{what} has the shape {array.shape}; a record has channels and samples only.")
    rows = np.atleast_2d(squeezed)
    if rows.shape[0] > rows.shape[1]:
        rows = rows.T
    return np.ascontiguousarray(rows, dtype=np.float64)
