"""What a shaker, an actuator or a floor does over time: samples at one rate, periodic or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft
import scipy.interpolate
import scipy.signal
from numpy.typing import ArrayLike, NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import ExcitationError, known_keywords
from ibsdyn.validation import checked_seed, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# A sampled signal that is no sum of known sinusoids is drawn through its samples by splines of this degree.
SPLINE_DEGREE = 5
# Lines below this share of the largest are rounding of the FFT.
LINE_FLOOR = 1e-9


@dataclass(frozen=True, eq=False)
class Excitation:
    """A signal that drives an input of a model.

    Attributes
    ----------
    samples : (n,) one period, or all of a signal that has none.
    sample_rate : [Hz].
    periods : how often a run repeats the period unless told otherwise; 1 where there is none.
    is_periodic : whether the samples are one period.
    name : what it is, for figures and messages.
    """

    samples: Array
    sample_rate: float
    periods: int
    is_periodic: bool
    name: str
    # Whether the end joins the beginning: then the signal between samples is a sum of sinusoids, known exactly.
    _circular: bool = field(repr=False)

    def __post_init__(self) -> None:
        """Keep a copy that nobody changes."""
        kept = np.array(self.samples, dtype=float)
        kept.setflags(write=False)
        object.__setattr__(self, "samples", kept)

    def __repr__(self) -> str:
        """Name the length, the rate and the size."""
        what = f"{self.periods} periods of {self.n_samples}" if self.is_periodic else f"{self.n_samples}"
        return (
            f"{type(self).__name__}({self.name!r}: {what} samples at {self.sample_rate:g} Hz, RMS {self.rms:.4g}, "
            f"crest factor {self.crest_factor:.3g})"
        )

    @property
    def n_samples(self) -> int:
        """Samples of one period, or of all."""
        return len(self.samples)

    @property
    def duration(self) -> float:
        """Length of all periods [s]."""
        return self.periods * self.n_samples / self.sample_rate

    @property
    def resolution(self) -> float:
        """Distance of the lines that it can have [Hz]: one over the period."""
        return self.sample_rate / self.n_samples

    @property
    def rms(self) -> float:
        """Root mean square."""
        return float(np.sqrt(np.mean(self.samples**2)))

    @property
    def peak(self) -> float:
        """Largest absolute value."""
        return float(np.abs(self.samples).max())

    @property
    def crest_factor(self) -> float:
        """Peak over RMS; a sine has 1.41, Gaussian noise 4 and more."""
        return self.peak / self.rms if self.rms > 0 else np.inf

    @property
    def spectrum(self) -> NDArray[np.complexfloating]:
        """(n // 2 + 1,) complex amplitude of the sinusoid at each multiple of the resolution, cosine phase."""
        lines = np.asarray(scipy.fft.rfft(self.samples)) * (2.0 / self.n_samples)
        lines[0] *= 0.5
        if self.n_samples % 2 == 0:
            lines[-1] *= 0.5
        return lines

    @property
    def line_numbers(self) -> NDArray[np.intp]:
        """Which multiples of the resolution it excites, 0 (the mean) left out."""
        size = np.abs(self.spectrum)
        size[0] = 0.0
        return np.flatnonzero(size > LINE_FLOOR * size.max(initial=0.0))

    def band(self, share: float = 0.9999) -> tuple[float, float]:
        """Return the frequencies [Hz] between which ``share`` of its power lies, the mean left out."""
        bands = [self._band(self.samples, share)]
        if not self._circular:
            # The jump from the end of a signal without period to its beginning is none of its own; nor is the slope
            # that takes it away.
            ends = np.linspace(self.samples[0], self.samples[-1], self.n_samples)
            bands.append(self._band(self.samples - ends, share))
        lows, highs = zip(*bands, strict=True)
        return max(lows), min(highs)

    def _band(self, samples: Array, share: float) -> tuple[float, float]:
        power = np.abs(np.asarray(scipy.fft.rfft(samples))) ** 2
        power[0] = 0.0
        if not power.any():
            return 0.0, 0.0
        summed = np.cumsum(power) / power.sum()
        rest = 0.5 * (1.0 - share)
        low, high = np.searchsorted(summed, [rest, 1.0 - rest])
        return float(low * self.resolution), float(min(high, len(power) - 1) * self.resolution)

    def refined(self, factor: int) -> Array:
        """Return (factor n,) the signal at a multiple of its rate.

        Notes
        -----
        Exact where it is a sum of sinusoids (periodic signals and noise); else a spline of degree five through the
        samples, good to 1e-4 where they are ten or more a period.
        """
        if factor == 1:
            return np.array(self.samples)
        if self._circular:
            lines = np.asarray(scipy.fft.rfft(self.samples))
            if self.n_samples % 2 == 0:
                lines[-1] *= 0.5  # the Nyquist line stands for two
            fine: Array = scipy.fft.irfft(lines, factor * self.n_samples) * factor
            return fine
        times = np.arange(self.n_samples)
        spline = scipy.interpolate.make_interp_spline(times, self.samples, k=spline_degree(self.n_samples))
        drawn: Array = spline(np.minimum(np.arange(factor * self.n_samples) / factor, times[-1]))
        return drawn

    def at_rate(self, sample_rate: float) -> Excitation:
        """Return the same signal sampled at another rate, for a sum of sinusoids exactly.

        Raises
        ------
        ExcitationError : the signal between its samples is not known exactly, the new rate gives no whole number of
            samples, or is too low for the highest line.
        """
        if sample_rate == self.sample_rate:
            return self
        exact = self.n_samples * sample_rate / self.sample_rate
        count = round(exact)
        if not self._circular:
            raise ExcitationError(
                f"{self.name} is sampled at {self.sample_rate:g} Hz, the run at {sample_rate:g} Hz; give both the same "
                "sample_rate (periodic signals can be taken over to another one, this has no period)."
            )
        if abs(exact - count) > 1e-9 * exact:
            raise ExcitationError(
                f"{self.name}: {self.n_samples / self.sample_rate:g} s are {exact:.6g} samples at {sample_rate:g} Hz, "
                f"no whole number; {self.sample_rate:g} Hz or a multiple of it would fit."
            )
        lines = np.asarray(scipy.fft.rfft(self.samples))
        highest = self.line_numbers.max(initial=0) * self.resolution
        below_nyquist(float(highest), sample_rate, self.name)
        kept = lines[: count // 2 + 1] if count < self.n_samples else lines
        samples = scipy.fft.irfft(kept, count) * (count / self.n_samples)
        return replace(self, samples=samples, sample_rate=sample_rate)

    def scaled(self, factor: float) -> Excitation:
        """Return it ``factor`` times as large; a negative factor turns its sign."""
        size = number(factor, f"{self.name}: factor", "")
        return replace(self, samples=size * self.samples)

    def plot(self, axes: Sequence[Axes] | np.ndarray | None = None, unit: str = "") -> np.ndarray:
        """Draw the signal over time and the amplitudes of its lines (of a signal without period: its spectrum).

        Parameters
        ----------
        axes : two axes that an earlier call returned; a new figure if None.
        unit : of the signal, for the labels.

        Returns
        -------
        (2,) array of matplotlib Axes.
        """
        from ibsdyn.plotting.excitation import plot_excitation

        return plot_excitation(self, axes, unit)


def spline_degree(count: int) -> int:
    """Return the odd degree of the spline through ``count`` samples."""
    return next((degree for degree in (SPLINE_DEGREE, 3, 1) if degree < count), 0)


def sampled(samples: ArrayLike, sample_rate: float, name: str) -> Excitation:
    """Return plain samples as an excitation without period.

    Raises
    ------
    ExcitationError : not real numbers, fewer than two, not finite.
    """
    try:
        if np.iscomplexobj(samples):
            raise TypeError
        values = np.array(samples, dtype=float)
    except (TypeError, ValueError):
        raise ExcitationError(f"{name}: the samples must be real numbers (n,), got {samples!r}.") from None
    if values.ndim != 1 or len(values) < 2:
        raise ExcitationError(f"{name}: the samples must be (n,) with two or more of them, got shape {values.shape}.")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise ExcitationError(f"{name}: sample {bad[0]} is {values[bad[0]]}; every sample must be finite.")
    return Excitation(values, sample_rate, 1, False, name, _circular=False)


@known_keywords
def swept_sine(
    start_frequency: float,
    stop_frequency: float,
    amplitude: float,
    sample_rate: float,
    duration: float,
    scale: str = "linear",
) -> Excitation:
    """Return a sine whose frequency runs from one value to another, once.

    Parameters
    ----------
    start_frequency, stop_frequency : [Hz], either may be the larger; below half the sample rate.
    amplitude : of the sine, in the unit of the input that it drives.
    sample_rate : [Hz].
    duration : [s].
    scale : "linear" (so many Hz a second) or "logarithmic" (so many octaves a second).

    Raises
    ------
    ExcitationError : a frequency that the rate cannot carry, an unknown scale.
    ModelError : a value that is no number or not positive.
    """
    what = "swept_sine"
    rate = positive(sample_rate, f"{what}: sample_rate", "Hz")
    ends = [positive(f, f"{what}: frequency", "Hz") for f in (start_frequency, stop_frequency)]
    below_nyquist(max(ends), rate, what)
    size = positive(amplitude, f"{what}: amplitude", "")
    count = sample_count(duration, rate, what)
    time, length = np.arange(count) / rate, count / rate
    if scale == "linear":
        cycles = ends[0] * time + (ends[1] - ends[0]) * time**2 / (2 * length)
    elif scale == "logarithmic":
        growth = np.log(ends[1] / ends[0]) / length
        cycles = ends[0] * (np.expm1(growth * time) / growth if growth else time)
    else:
        raise ExcitationError(f"{what}: scale={scale!r} is not known; 'linear' or 'logarithmic'.")
    name = f"swept sine {ends[0]:g} to {ends[1]:g} Hz"
    return Excitation(size * np.sin(2 * np.pi * cycles), rate, 1, False, name, _circular=False)


@known_keywords
def random_noise(
    frequencies: ArrayLike, psd: ArrayLike, sample_rate: float, duration: float, seed: int = 0
) -> Excitation:
    """Return Gaussian noise with a given one-sided PSD, zero outside its frequencies.

    Parameters
    ----------
    frequencies : (n,) rising [Hz]; two are enough for a flat band.
    psd : (n,) one-sided [unit²/Hz], or one number for all; straight lines between the points.
    sample_rate, duration : [Hz], [s].
    seed : another one is another realisation.

    Raises
    ------
    ExcitationError : a PSD that is negative or does not fit, a band that the rate or the duration cannot carry.
    """
    what = "random_noise"
    rate = positive(sample_rate, f"{what}: sample_rate", "Hz")
    count = sample_count(duration, rate, what)
    hertz, density = _real(frequencies, f"{what}: frequencies [Hz]"), _real(psd, f"{what}: psd [unit²/Hz]")
    if hertz.ndim != 1 or len(hertz) < 2 or not np.all(np.diff(hertz) > 0) or hertz[0] < 0:
        raise ExcitationError(f"{what}: frequencies must be two or more that rise [Hz], got {hertz.tolist()}.")
    if density.ndim and density.shape != hertz.shape:
        raise ExcitationError(
            f"{what}: psd must be one number or one a frequency, got shape {density.shape} for {len(hertz)} "
            "frequencies."
        )
    if not np.isfinite(density).all() or (density < 0).any():
        raise ExcitationError(f"{what}: psd must be finite and not negative [unit²/Hz], got {density.tolist()}.")
    density = np.broadcast_to(density, hertz.shape)
    below_nyquist(float(hertz[-1]), rate, what)
    lines = np.arange(count // 2 + 1) * rate / count
    wanted = np.where(lines > 0, np.interp(lines, hertz, density, left=0.0, right=0.0), 0.0)
    if count % 2 == 0:
        wanted[-1] = 0.0
    if not wanted.any():
        raise ExcitationError(
            f"{what}: no line of a record of {count / rate:g} s (multiples of {rate / count:g} Hz) lies between "
            f"{hertz[0]:g} and {hertz[-1]:g} Hz with a PSD above zero; make the record longer."
        )
    rng = np.random.default_rng(checked_seed(seed))
    # E|X_k|² = S_k f_s n / 2 of the one-sided density
    spread = np.sqrt(wanted * rate * count / 4)
    spectrum = spread * (rng.normal(size=len(lines)) + 1j * rng.normal(size=len(lines)))
    name = f"noise {hertz[0]:g} to {hertz[-1]:g} Hz"
    return Excitation(scipy.fft.irfft(spectrum, count), rate, 1, False, name, _circular=True)


@known_keywords
def burst_random(
    minimum: float,
    maximum: float,
    rms: float,
    sample_rate: float,
    frame: float,
    burst: float = 0.5,
    frames: int = 1,
    seed: int = 0,
) -> Excitation:
    """Return frames of band-limited noise, each a burst and then silence in which the response dies out.

    Parameters
    ----------
    minimum, maximum : band of the noise [Hz].
    rms : during the burst, in the unit of the input.
    sample_rate : [Hz].
    frame : length of one frame [s], a whole number of samples.
    burst : share of the frame that is driven.
    frames : how many, each with noise of its own.
    seed : another one is another realisation.

    Raises
    ------
    ExcitationError : a band or a share that cannot be.

    Notes
    -----
    The burst begins and ends within a twentieth of its length, with a cosine taper.
    """
    what = "burst_random"
    share = positive(burst, f"{what}: burst", "")
    if share >= 1.0:
        raise ExcitationError(f"{what}: burst must be a share between 0 and 1 of the frame, got {burst!r}.")
    if not isinstance(frames, int) or isinstance(frames, bool) or frames < 1:
        raise ExcitationError(f"{what}: frames must be a whole number from 1 on, got {frames!r}.")
    size = positive(rms, f"{what}: rms", "")
    low, high = number(minimum, f"{what}: minimum", "Hz", minimum=0.0), positive(maximum, f"{what}: maximum", "Hz")
    if low >= high:
        raise ExcitationError(f"{what}: the band must rise from 0 or more, got {minimum!r} to {maximum!r} Hz.")
    seeds = np.random.SeedSequence(checked_seed(seed)).spawn(frames)
    pieces = []
    for child in seeds:
        noise = random_noise(
            (low, high), size**2 / (high - low), sample_rate, frame, seed=int(child.generate_state(1)[0])
        )
        driven = max(2, round(share * noise.n_samples))
        gate = np.zeros(noise.n_samples)
        gate[:driven] = scipy.signal.windows.tukey(driven, 0.1)
        pieces.append(gate * noise.samples)
    name = f"{frames} bursts {low:g} to {high:g} Hz"
    return Excitation(np.concatenate(pieces), float(sample_rate), 1, False, name, _circular=True)


def _real(values: ArrayLike, what: str) -> Array:
    """Return real numbers as an array; ExcitationError otherwise."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ExcitationError(f"{what} must be real numbers, got {values!r}.") from None


def positive(value: object, what: str, unit: str) -> float:
    """Return a positive number; ModelError otherwise."""
    return number(value, what, unit, above=0.0)


def sample_count(duration: object, rate: float, what: str) -> int:
    """Return the whole number of samples in a duration.

    Raises
    ------
    ExcitationError : it is not whole; the message says which durations would fit.
    """
    seconds = positive(duration, f"{what}: duration", "s")
    exact = seconds * rate
    count = round(exact)
    if count < 2 or abs(exact - count) > 1e-6 * max(1.0, exact * 1e-3):
        fits = max(2, count) / rate
        raise ExcitationError(
            f"{what}: {seconds:g} s at {rate:g} Hz are {exact:.6g} samples; it takes a whole number of two or more, as "
            f"in {fits:.9g} s."
        )
    return count


def below_nyquist(frequency: float, rate: float, what: str) -> None:
    """Refuse a frequency at or above half the sample rate.

    Raises
    ------
    ExcitationError : says which rate would do.
    """
    if frequency >= 0.5 * rate:
        raise ExcitationError(
            f"{what}: {frequency:g} Hz needs a sample rate above {2 * frequency:g} Hz, got {rate:g} Hz; 2.56 times the "
            f"highest frequency ({2.56 * frequency:g} Hz) is usual."
        )
