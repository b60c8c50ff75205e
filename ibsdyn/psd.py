"""One-sided power spectral densities, power laws between their points."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError, ModelError, known_keywords, nearest
from ibsdyn.resonance_grid import checked_band
from ibsdyn.time_record import TimeRecord
from ibsdyn.validation import in_words, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STANDARD_GRAVITY = 9.80665  # m/s², by definition
# Width of a one-third-octave band as a share of its centre frequency (base two).
THIRD_OCTAVE = 2 ** (1 / 6) - 2 ** (-1 / 6)
# Within a piece the logarithm of a PSD changes by no more than this, so that three nodes integrate it to nine digits.
MOST_GROWTH = 0.5
MOST_PIECES = 100
# Units that are time derivatives of each other.
_DERIVATIVES = (("m", "m/s", "m/s²"), ("rad", "rad/s", "rad/s²"))
_SPELLINGS = {"m/s^2": "m/s²", "m/s2": "m/s²", "rad/s^2": "rad/s²", "rad/s2": "rad/s²", "Nm": "N·m", "N m": "N·m"}
UNITS = ("m", "m/s", "m/s²", "rad", "rad/s", "rad/s²", "N", "N·m", "g")


@dataclass(frozen=True, eq=False, init=False)
class PSD:
    """A one-sided power spectral density, straight between its points on log-log axes, zero outside of them.

    Parameters
    ----------
    frequencies : (n,) rising, above 0 [Hz]; a frequency given twice is a step.
    values : (n,) in unit²/Hz, not negative; next to a zero the PSD is straight on linear axes.
    unit : of the signal, as "m/s²", "N", "rad"; "g" is turned into m/s².
    title : what it is, for figures and messages.

    Raises
    ------
    ModelError : frequencies or values that cannot be right, an unknown unit.

    Notes
    -----
    One-sided: the mean square of the signal is the integral over positive frequencies.
    """

    frequencies: Array
    values: Array
    unit: str
    title: str

    @known_keywords
    def __init__(self, frequencies: ArrayLike, values: ArrayLike, unit: str = "m/s²", title: str = "PSD") -> None:
        hertz, power = _numbers(frequencies, f"{title}: frequencies"), _numbers(values, f"{title}: values")
        if hertz.shape != power.shape or hertz.size < 2:
            raise ModelError(
                f"{title}: {hertz.size} frequencies and {power.size} values; a PSD needs as many of both, two at least."
            )
        if (power < 0).any():
            raise ModelError(f"{title}: values must not be negative, got {power[power < 0][0]:g} {unit}²/Hz.")
        if hertz[0] <= 0:
            raise ModelError(
                f"{title}: frequencies must be above 0 Hz, got {hertz[0]:g}; leave the 0 Hz line of a spectrum out."
            )
        steps = np.diff(hertz)
        if (steps < 0).any() or ((steps[:-1] == 0) & (steps[1:] == 0)).any() or hertz[0] == hertz[-1]:
            place = int(np.argmax(steps < 0)) if (steps < 0).any() else int(np.argmin(steps))
            raise ModelError(
                f"{title}: frequencies must rise (one may stand twice, for a step); after {hertz[place]:g} Hz comes "
                f"{hertz[place + 1]:g} Hz."
            )
        known = _SPELLINGS.get(unit, unit)
        if known not in UNITS:
            raise ModelError(
                f"{title}: unit {unit!r} is not known; give that of the signal, not of the PSD. {nearest(unit, UNITS)}"
            )
        if known == "g":
            known, power = "m/s²", power * STANDARD_GRAVITY**2
        hertz.flags.writeable = power.flags.writeable = False
        for field, value in {"frequencies": hertz, "values": power, "unit": known, "title": title}.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    @classmethod
    @known_keywords
    def white(cls, value: float, band: Sequence[float], unit: str = "m/s²", title: str = "white noise") -> PSD:
        """Return a constant PSD over a band.

        Parameters
        ----------
        value : in unit²/Hz, one-sided.
        band : (lower, upper) [Hz].
        unit : of the signal.
        title : what it is.
        """
        level = number(value, f"{title}: value", f"({unit})²/Hz", minimum=0.0)
        return cls(checked_band(band), (level, level), unit, title)

    @classmethod
    @known_keywords
    def from_third_octaves(
        cls, centres: ArrayLike, rms: ArrayLike, unit: str = "m/s", title: str = "one-third-octave spectrum"
    ) -> PSD:
        """Return the PSD that has given RMS values in one-third-octave bands.

        Parameters
        ----------
        centres : (n,) centre frequencies [Hz].
        rms : (n,) RMS of the signal in each band.
        unit : of the signal.
        title : what it is.

        Notes
        -----
        A band is 2^(1/6) - 2^(-1/6) = 0.232 of its centre frequency wide; the PSD is its mean square over its width.
        """
        hertz, level = _numbers(centres, f"{title}: centres"), _numbers(rms, f"{title}: rms")
        if hertz.shape != level.shape or (hertz <= 0).any():
            raise ModelError(f"{title}: give as many centre frequencies above 0 Hz as RMS values.")
        return cls(hertz, level**2 / (THIRD_OCTAVE * hertz), unit, title)

    @classmethod
    @known_keywords
    def from_record(cls, record: TimeRecord, channel: str | None = None, segment: float | None = None) -> PSD:
        """Return the PSD of a measured channel by Welch's method (Hann window, half overlapping segments).

        Parameters
        ----------
        record : the measurement.
        channel : its name; the only channel if None.
        segment : length of a segment [s], the inverse of the resolution; an eighth of the record if None.

        Raises
        ------
        ModelError : several channels and none named, or a segment that does not fit.
        """
        if channel is None and len(record.names) > 1:
            raise ModelError(f"{record.title}: it has {len(record.names)} channels; name one of {list(record.names)}.")
        row = 0 if channel is None else record.index(channel)
        length = record.duration / 8 if segment is None else number(segment, "segment", "s", above=0.0)
        samples = round(length * record.sample_rate)
        if not 8 <= samples <= record.n_samples:
            raise ModelError(
                f"{record.title}: a segment of {length:.4g} s is {samples} samples; it needs 8 at least and at most "
                f"the record's {record.n_samples}."
            )
        hertz, values = scipy.signal.welch(record.signals[row], record.sample_rate, nperseg=samples)
        return cls(hertz[1:], values[1:], record.units[row], f"{record.names[row]} ({record.title})")

    @classmethod
    @known_keywords
    def from_csv(cls, path: str | os.PathLike[str], unit: str = "m/s²", title: str | None = None) -> PSD:
        """Return a PSD from a text file of two columns, frequency [Hz] and value [unit²/Hz].

        Parameters
        ----------
        path : columns divided by commas, semicolons, tabs or blanks; lines of words are headings. With semicolons
            and tabs a comma is a decimal comma.
        unit : of the signal.
        title : what it is; the file's name if None.

        Raises
        ------
        ModelError : a line that has not two numbers.
        OSError : the file cannot be read.
        """
        file = Path(path)
        pairs: list[list[float]] = []
        for place, line in enumerate(file.read_text(encoding="utf-8-sig").splitlines(), 1):
            words = _columns(line)
            if not words or line.lstrip()[0] in "#%\"'" or (not pairs and not _is_number(words[0])):
                continue
            if len(words) != 2 or not all(_is_number(word) for word in words):
                raise ModelError(f"{file.name}, line {place}: expected frequency and PSD, got {line.strip()!r}.")
            pairs.append([float(word) for word in words])
        if len(pairs) < 2:
            raise ModelError(f"{file.name}: it has {len(pairs)} lines of two numbers; a PSD needs two at least.")
        hertz, values = np.array(pairs).T
        if hertz[0] == 0.0:  # spectrum analysers write it; log-log axes have no place for it
            hertz, values = hertz[1:], values[1:]
        return cls(hertz, values, unit, file.stem if title is None else title)

    def __eq__(self, other: object) -> bool:
        """Tell whether another PSD has the same points, unit and title, to the last digit."""
        if not isinstance(other, PSD):
            return NotImplemented
        return (
            (self.unit, self.title) == (other.unit, other.title)
            and np.array_equal(self.frequencies, other.frequencies)
            and np.array_equal(self.values, other.values)
        )

    def __hash__(self) -> int:
        """Return a hash that agrees with equality."""
        return hash((self.unit, self.title, self.frequencies.tobytes()))

    def __repr__(self) -> str:
        """Name the title, the band and the RMS."""
        lower, upper = self.band
        return f"PSD({self.title!r}, {lower:g} to {upper:g} Hz, {self.rms():.4g} {self.unit} RMS)"

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz]."""
        return float(self.frequencies[0]), float(self.frequencies[-1])

    def at(self, frequencies: ArrayLike) -> Array:
        """Return the PSD [unit²/Hz] at frequencies [Hz] of any shape, zero outside the band."""
        hertz = np.asarray(frequencies, dtype=float)
        last = len(self.frequencies) - 2
        # A step belongs to what comes after it, the upper end to the last segment.
        segment = np.clip(np.searchsorted(self.frequencies, hertz, side="right") - 1, 0, last)
        f1, f2 = self.frequencies[segment], self.frequencies[segment + 1]
        s1, s2 = self.values[segment], self.values[segment + 1]
        inside = (hertz >= self.frequencies[0]) & (hertz <= self.frequencies[-1])
        at = np.where(inside, hertz, f1)
        straight = (s1 == 0) | (s2 == 0)
        width = np.where(f2 > f1, f2 - f1, 1.0)
        share = np.where(f2 > f1, (at - f1) / width, 1.0)
        linear = s1 + (s2 - s1) * share
        safe1, safe2 = np.where(straight, 1.0, s1), np.where(straight, 1.0, s2)
        octave = np.where(f2 > f1, np.log(f2 / f1), 1.0)
        power = safe1 * np.exp(np.log(safe2 / safe1) * np.where(f2 > f1, np.log(at / f1) / octave, 1.0))
        values: Array = np.where(inside, np.where(straight, linear, power), 0.0)
        return values

    def mean_square(self, band: Sequence[float] | None = None) -> float:
        """Return the integral over a band [unit²], exactly; over all of it if None."""
        lower, upper = self.band if band is None else checked_band(band)
        lower, upper = max(lower, self.band[0]), min(upper, self.band[1])
        if lower >= upper:
            return 0.0
        total = 0.0
        for f1, f2, s1, s2 in zip(
            self.frequencies[:-1], self.frequencies[1:], self.values[:-1], self.values[1:], strict=True
        ):
            a, b = max(lower, f1), min(upper, f2)
            if a >= b:
                continue
            if s1 == 0 or s2 == 0:
                at = [s1 + (s2 - s1) * (f - f1) / (f2 - f1) for f in (a, b)]
                total += 0.5 * (at[0] + at[1]) * (b - a)
                continue
            slope = math.log(s2 / s1) / math.log(f2 / f1)
            start = s1 * (a / f1) ** slope
            exponent = (slope + 1) * math.log(b / a)
            growth = math.expm1(exponent) / exponent if abs(exponent) > 1e-12 else 1.0
            total += start * a * math.log(b / a) * growth
        return float(total)

    def rms(self, band: Sequence[float] | None = None) -> float:
        """Return the RMS over a band [unit], exactly; over all of it if None."""
        return math.sqrt(self.mean_square(band))

    def smooth_pieces(self) -> Array:
        """Return frequencies between which the PSD is a power law that changes little, for integration."""
        growth = np.zeros(len(self.frequencies) - 1)
        positive = (self.values[:-1] > 0) & (self.values[1:] > 0)
        growth[positive] = np.abs(np.diff(np.log(np.where(self.values > 0, self.values, 1.0))))[positive]
        counts = np.clip(np.ceil(growth / MOST_GROWTH), 1, MOST_PIECES).astype(int)
        spans = zip(self.frequencies[:-1], self.frequencies[1:], counts, strict=True)
        return np.unique(np.concatenate([np.linspace(f1, f2, count + 1) for f1, f2, count in spans]))

    @known_keywords
    def scaled(self, factor: float, title: str | None = None) -> PSD:
        """Return the PSD of the signal times a factor: its values grow with the factor's square.

        Parameters
        ----------
        factor : on the signal; 0.707 takes 3 dB off.
        title : what it is; as before if None.
        """
        gain = number(factor, f"{self.title}: factor", "", above=0.0)
        return PSD(self.frequencies, gain**2 * self.values, self.unit, self.title if title is None else title)

    def to(self, unit: str) -> PSD:
        """Return the PSD of the signal's derivative or integral, as of the velocity from that of an acceleration.

        Parameters
        ----------
        unit : "m", "m/s", "m/s²" from each other, or the same of rad.

        Raises
        ------
        ModelError : units that are no derivatives of each other.
        """
        wanted = _SPELLINGS.get(unit, unit) if isinstance(unit, str) else None
        if wanted == self.unit:
            return self
        known = next((family for family in _DERIVATIVES if self.unit in family), (self.unit,))
        if wanted in known:
            times = known.index(wanted) - known.index(self.unit)
            values = self.values * (2 * np.pi * self.frequencies) ** (2 * times)
            return PSD(self.frequencies, values, wanted, self.title)
        raise ModelError(f"{self.title}: a PSD of {self.unit} tells none of {unit!r}, only of {in_words(known)}.")

    def plot(self, axes: Axes | None = None, label: str | None = None) -> Axes:
        """Draw the PSD on log-log axes.

        Parameters
        ----------
        axes : where to draw; a new figure if None.
        label : name in the legend; the title if None.

        Returns
        -------
        The matplotlib Axes drawn on.
        """
        from ibsdyn.plotting.budget import plot_psd

        return plot_psd(self, axes, label)


def unit_of_psd(unit: str) -> str:
    """Return the unit of the PSD of a signal: ``(m/s²)²/Hz``, ``N²/Hz``."""
    return f"({unit})²/Hz" if "/" in unit or "·" in unit else f"{unit}²/Hz"


def _numbers(values: ArrayLike, what: str) -> Array:
    try:
        array = np.array(values, dtype=float, ndmin=1)
    except (TypeError, ValueError):
        raise ModelError(f"{what} must be real numbers, got {values!r}.") from None
    if array.ndim != 1 or not np.isfinite(array).all():
        raise ModelError(f"{what} must be a list of finite numbers, got {array.tolist()!r:.200}.")
    return array


def _columns(line: str) -> list[str]:
    if ";" in line or "\t" in line:
        return [word.strip().replace(",", ".") for word in re.split(r"[;\t]", line) if word.strip()]
    return [word for word in re.split(r"[,\s]+", line.strip()) if word]


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def require_band_overlap(psds: Sequence[PSD], band: tuple[float, float]) -> None:
    """Refuse a band in which no PSD has power.

    Raises
    ------
    AnalysisError : none of them reaches into the band.
    """
    if all(psd.band[1] <= band[0] or psd.band[0] >= band[1] for psd in psds):
        reach = ", ".join(f"{psd.title!r} {psd.band[0]:g} to {psd.band[1]:g} Hz" for psd in psds)
        raise AnalysisError(f"no disturbance has power between {band[0]:g} and {band[1]:g} Hz; they reach: {reach}.")
