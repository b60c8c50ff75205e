"""The sample rate out of a time column, or why there is none."""

from __future__ import annotations

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError, RecordWarning, warn_user

# A lost sample shifts the rest by a whole step; jitter of a twentieth is what printing may leave.
_JITTER = 0.05
# Six printed digits of a step, as UFF 58 has them.
_PRINTED = 5e-6
# Rates further apart than this are not one rate that was rounded twice.
_ONE_RATE = 1e-3


def rate_of_time(time: Array, source: str) -> tuple[float, float]:
    """Return sample rate [Hz] and start [s] of equidistant times [s].

    Raises
    ------
    RecordError : fewer than two samples, times that do not rise, or steps that are unequal.
    """
    if len(time) < 2 or not np.isfinite(time).all():
        raise RecordError(f"{source}: the time column needs two finite times at least, got {time[:3].tolist()}.")
    steps = np.diff(time)
    mean = float(time[-1] - time[0]) / (len(time) - 1)
    if not np.isfinite(mean) or mean <= 0.0 or steps.min() < 0.0:
        at = int(np.argmin(steps))
        raise RecordError(
            f"{source}: the time column does not rise ({time[at]:.9g} s at sample {at}, then {time[at + 1]:.9g} s). Is "
            "it time, and one record only?"
        )
    rounding = _printed_step(time)
    typical = float(np.median(steps))
    if np.abs(steps - typical).max() > _JITTER * typical + rounding:
        at = int(np.argmax(np.abs(steps - typical)))
        raise RecordError(
            f"{source}: the time column is not equidistant: steps of {typical:.6g} s, but {steps[at]:.6g} s after "
            f"sample {at} (t = {time[at]:.9g} s). Samples are lost or the rate changed; resample it, or cut the record "
            "there. If only the times are wrong, give sample_rate= and leave the column out with time=False."
        )
    return whole_rate(1.0 / mean, max(rounding / float(time[-1] - time[0]), 1e-9)), float(time[0])


def whole_rate(rate: float, precision: float = _PRINTED) -> float:
    """Return the whole number of Hz that a printed rate stands for, or the rate itself where it stands for none."""
    return float(round(rate)) if round(rate) and abs(rate - round(rate)) <= precision * rate else rate


def one_rate(rates: dict[str, float | None], given: float | None, source: str) -> float:
    """Return the rate of channels that must agree with each other and with the one that the caller gave.

    Parameters
    ----------
    rates : {channel: what the file says [Hz], None where it says nothing}.
    given : what the caller says [Hz], None where nothing.

    Raises
    ------
    RecordError : no rate at all, different ones, or one that contradicts the caller's.
    """
    said = {name: rate for name, rate in rates.items() if rate is not None}
    if not said:
        if given is None:
            raise RecordError(
                f"{source} says nothing of the sample rate; give sample_rate= [Hz], or time= with the column of times."
            )
        return given
    first, rate = next(iter(said.items()))
    if not rate > 0.0:
        raise RecordError(
            f"{source}: its sample rate of {rate:g} Hz is none; write it anew with fs above zero, or with times."
        )
    for name, other in said.items():
        if abs(other - rate) > _PRINTED * rate:
            raise RecordError(
                f"{source}: channel {first!r} is sampled at {rate:g} Hz, {name!r} at {other:g} Hz. Read them as two "
                "records, or resample them to one rate."
            )
    if given is not None and abs(given - rate) > _ONE_RATE * rate:
        raise RecordError(
            f"{source} is sampled at {rate:g} Hz by its own account, but sample_rate={given:g} was given; every "
            "frequency would be wrong by that ratio. Leave sample_rate out, or correct it."
        )
    return rate if given is None else given


def warn_of_other_rate(source: str, who: str, said: float | None, rate: float) -> None:
    """Warn where a file's times, which are taken, tell another sample rate [Hz] than it says elsewhere."""
    if said is not None and not abs(said - rate) <= _ONE_RATE * rate:
        warn_user(
            f"{source}: its times are those of {rate:g} Hz, {who} says {said:g} Hz; the times are taken. If they are "
            "wrong, use time=False.",
            RecordWarning,
        )


def _printed_step(time: Array) -> float:
    """Return the last printed digit of times, 0 where they have more than twelve decimals."""
    some = time[:: max(1, len(time) // 1000)]
    for decimals in range(13):
        if np.abs(some - np.round(some, decimals)).max() <= 1e-14 * max(1.0, float(np.abs(some).max())):
            return float(10.0**-decimals)
    return 0.0
