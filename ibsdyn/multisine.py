"""Multisines: periodic signals that excite chosen lines with chosen amplitudes.

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., Wiley 2012, chapters 2 to 5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np
import scipy.fft
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import ExcitationError, known_keywords, nearest
from ibsdyn.excitation import Excitation, below_nyquist, positive
from ibsdyn.validation import checked_seed, number

PHASES = ("random", "schroeder", "low-crest")
MATRICES = ("dft", "hadamard")
# Frequencies are typed with some digits; a line this share off a multiple of the base frequency is on it.
LINE_TOLERANCE = 1e-9
# More samples a period than this is a frequency typed with odd digits, not a wish.
LONGEST_PERIOD = 50_000_000
# Rounds of clipping and restoring the amplitudes; the crest factor settles within them.
CLIPPING_ROUNDS = 400

Amplitude = float | ArrayLike | Callable[[Array], ArrayLike]


@dataclass(frozen=True, eq=False, repr=False)
class Multisine(Excitation):
    """A sum of sinusoids, sum A_k cos(2 pi f_k t + phi_k), as many samples a period as the lines need.

    Attributes
    ----------
    lines : (n_lines,) [Hz].
    amplitudes : (n_lines,) of each line's sinusoid, in the unit of the input.
    phases : (n_lines,) [rad].
    initial_crest_factor : before the phases were optimised; that of the signal itself where they were not.
    """

    lines: Array
    amplitudes: Array
    phases: Array
    initial_crest_factor: float
    _seed: int | None = field(repr=False)

    @property
    def base_frequency(self) -> float:
        """One over the period [Hz]; every line is a multiple of it."""
        return self.resolution

    @property
    def detection_lines(self) -> Array:
        """The multiples of the base frequency [Hz] within the band that are not excited.

        What a response has there is noise, and distortion by nonlinearity: of even order at even multiples, of odd
        order at odd ones.
        """
        numbers = np.round(self.lines / self.base_frequency).astype(int)
        within = np.arange(numbers.min(), numbers.max() + 1)
        missing = np.setdiff1d(within, numbers)
        return np.asarray(missing * self.base_frequency, dtype=np.float64)

    def realisations(self, count: int) -> tuple[Multisine, ...]:
        """Return multisines of the same amplitudes, each with random phases of its own.

        Averages over them separate the linear response from nonlinear distortion, which changes with the phases.

        Parameters
        ----------
        count : how many; the first is this one.

        Raises
        ------
        ExcitationError : the phases are not random.
        """
        if self._seed is None:
            raise ExcitationError(
                f"{self.name}: realisations differ in their random phases, but these phases are not random; take "
                "phases='random'."
            )
        children = np.random.SeedSequence(self._seed).spawn(_whole(count, "realisations", 1) - 1)
        others = [
            self._with_phases(_random_phases(len(self.lines), np.random.default_rng(child))) for child in children
        ]
        return (self, *others)

    def scaled(self, factor: float) -> Multisine:
        """Return it ``factor`` times as large; a negative factor turns its sign."""
        size = number(factor, f"{self.name}: factor", "")
        phases = self.phases if size >= 0 else self.phases + np.pi
        return replace(self, samples=size * self.samples, amplitudes=abs(size) * self.amplitudes, phases=phases)

    def _with_phases(self, phases: Array) -> Multisine:
        samples = _samples(self.lines, self.base_frequency, self.amplitudes, phases, self.n_samples)
        return replace(self, samples=samples, phases=phases, initial_crest_factor=_crest(samples))


@known_keywords
def band_lines(
    minimum: float,
    maximum: float,
    resolution: float,
    odd: bool = False,
    detection: int | None = None,
    seed: int = 0,
) -> Array:
    """Return the multiples of a resolution within a band, for ``multisine``.

    Parameters
    ----------
    minimum, maximum : [Hz], both ends included.
    resolution : [Hz]; about a third of the narrowest resonance's width 2 zeta f or less.
    odd : only odd multiples, so that even nonlinear distortion falls between the lines.
    detection : of every so many lines in turn one is left out at random, to see odd distortion too; 3 or 4 is usual.
    seed : of that choice.

    Returns
    -------
    (n_lines,) [Hz].

    Raises
    ------
    ExcitationError : no line in the band, or a group of detection lines below two.
    """
    what = "band_lines"
    step = positive(resolution, f"{what}: resolution", "Hz")
    low, high = (positive(f, f"{what}: {name}", "Hz") for f, name in ((minimum, "minimum"), (maximum, "maximum")))
    slack = 1e-6
    numbers = np.arange(max(1, math.ceil(low / step - slack)), math.floor(high / step + slack) + 1)
    if odd:
        numbers = numbers[numbers % 2 == 1]
    if detection is not None:
        group = _whole(detection, f"{what}: detection", 2)
        rng = np.random.default_rng(checked_seed(seed))
        starts = np.arange(0, len(numbers), group)
        # The last group may be short: a place beyond its end drops none.
        dropped = starts + rng.integers(group, size=len(starts))
        numbers = np.delete(numbers, dropped[dropped < len(numbers)])
    if not numbers.size:
        raise ExcitationError(f"{what}: no multiple of {step:g} Hz that is asked for lies in {low:g} to {high:g} Hz.")
    return np.asarray(numbers * step, dtype=np.float64)


@known_keywords
def multisine(
    frequencies: ArrayLike,
    amplitude: Amplitude = 1.0,
    sample_rate: float | None = None,
    phases: str | ArrayLike = "random",
    seed: int = 0,
    rms: float | None = None,
    periods: int = 1,
    base_frequency: float | None = None,
    name: str | None = None,
) -> Multisine:
    """Return a periodic sum of sinusoids.

    Parameters
    ----------
    frequencies : (n_lines,) [Hz], all multiples of one base frequency; ``band_lines`` makes them for a band.
    amplitude : of each line's sinusoid in the unit of the input: one number, (n_lines,) numbers, or a function of the
        frequencies [Hz].
    sample_rate : [Hz]; a period must be a whole number of samples.
    phases : "random" (from ``seed``; for averages over realisations), "schroeder" (low crest factor, for flat
        equidistant lines only), "low-crest" (optimised by clipping), or (n_lines,) [rad].
    seed : of the random phases; for "low-crest" of those it begins with.
    rms : scale all amplitudes to this root mean square.
    periods : how often a run repeats it unless told otherwise.
    base_frequency : [Hz]; the largest of which all lines are multiples if None.
    name : for figures and messages.

    Raises
    ------
    ExcitationError : lines that have no common base, or a period that is no whole number of samples; the message
        says what would fit. Amplitudes or phases that do not fit the lines.
    """
    what = "multisine" if name is None else name
    if sample_rate is None:
        raise ExcitationError(f"{what}: sample_rate= [Hz] is missing.")
    rate = positive(sample_rate, f"{what}: sample_rate", "Hz")
    lines = _lines(frequencies, what)
    below_nyquist(float(lines.max()), rate, what)
    count = _period(lines, rate, base_frequency, what)
    base = rate / count
    lines = np.round(lines / base) * base
    sizes = _amplitudes(amplitude, lines, rms, what)
    angles = _phases(phases, lines, sizes, seed, what)
    samples = _samples(lines, base, sizes, angles, count)
    initial = _crest(samples)
    if isinstance(phases, str) and phases == "low-crest":
        angles = _low_crest(lines, base, sizes, angles, count)
        samples = _samples(lines, base, sizes, angles, count)
    title = f"multisine of {len(lines)} lines, {lines.min():g} to {lines.max():g} Hz" if name is None else name
    return Multisine(
        samples,
        rate,
        _whole(periods, f"{what}: periods", 1),
        True,
        title,
        _circular=True,
        lines=lines,
        amplitudes=sizes,
        phases=angles,
        initial_crest_factor=initial,
        _seed=seed if isinstance(phases, str) and phases == "random" else None,
    )


@known_keywords
def orthogonal_multisines(multisine: Multisine, inputs: int, matrix: str = "dft") -> tuple[tuple[Multisine, ...], ...]:
    """Return experiments that drive several inputs at once and tell them apart at every line.

    Parameters
    ----------
    multisine : the lines and amplitudes; each input gets random phases of its own.
    inputs : how many inputs, and as many experiments.
    matrix : "dft" for any number, "hadamard" for 2, 4, 8 ... (signs only: all experiments share a crest factor shape).

    Returns
    -------
    [experiment][input]. At each line the matrix of complex amplitudes is a multiple of a unitary one, the best
    condition there is.

    Raises
    ------
    ExcitationError : an unknown matrix, or a Hadamard matrix of a size that does not exist.
    """
    what = "orthogonal_multisines"
    count = _whole(inputs, f"{what}: inputs", 1)
    if matrix not in MATRICES:
        raise ExcitationError(f"{what}: matrix={matrix!r} is not known. {nearest(str(matrix), MATRICES)}")
    if matrix == "hadamard" and count & (count - 1):
        raise ExcitationError(f"{what}: a Hadamard matrix needs 1, 2, 4, 8 ... inputs, got {count}; take matrix='dft'.")
    turns = scipy.linalg.hadamard(count) if matrix == "hadamard" else scipy.linalg.dft(count)
    angles = np.angle(turns.astype(complex))
    own = [sine.phases for sine in multisine.realisations(count)]
    return tuple(
        tuple(
            replace(multisine._with_phases(own[i] + angles[e, i]), name=f"{multisine.name}, experiment {e + 1}")
            for i in range(count)
        )
        for e in range(count)
    )


def _lines(frequencies: ArrayLike, what: str) -> Array:
    try:
        lines = np.atleast_1d(np.array(frequencies, dtype=float))
    except (TypeError, ValueError):
        raise ExcitationError(f"{what}: frequencies must be numbers [Hz], got {frequencies!r}.") from None
    if lines.ndim != 1 or not lines.size or not np.isfinite(lines).all() or (lines <= 0).any():
        raise ExcitationError(f"{what}: frequencies must be finite and above zero [Hz], got {lines.tolist()}.")
    lines = np.sort(lines)
    twice = lines[1:][np.diff(lines) <= LINE_TOLERANCE * lines[1:]]
    if twice.size:
        raise ExcitationError(f"{what}: the line {twice[0]:g} Hz is there twice.")
    return lines


def _period(lines: Array, rate: float, base: float | None, what: str) -> int:
    """Return the samples in a period."""
    if base is not None:
        wanted = positive(base, f"{what}: base_frequency", "Hz")
        count = round(rate / wanted)
        if count < 2 or abs(rate / wanted - count) > LINE_TOLERANCE * count:
            fits = max(2, count)
            raise ExcitationError(
                f"{what}: a period of {1 / wanted:g} s has {rate / wanted:.6g} samples at {rate:g} Hz; a whole number "
                f"would have base_frequency={rate / fits:.9g} Hz or sample_rate={wanted * fits:.9g} Hz."
            )
        off = np.abs(lines / wanted - np.round(lines / wanted)) > 1e-6
        if off.any():
            first = lines[off][0]
            raise ExcitationError(
                f"{what}: {first:g} Hz is no multiple of base_frequency={wanted:g} Hz; the nearest that is one is "
                f"{max(1, round(first / wanted)) * wanted:.9g} Hz."
            )
        return count
    count = 1
    for line in lines:
        fraction = Fraction(line / rate).limit_denominator(LONGEST_PERIOD)
        exact = abs(float(fraction) * rate - line) <= LINE_TOLERANCE * line
        count = math.lcm(count, fraction.denominator) if exact else LONGEST_PERIOD + 1
        if count > LONGEST_PERIOD:
            spacing = float(np.diff(lines).min()) if len(lines) > 1 else float(line)
            samples = max(2, round(float(rate / spacing)))
            nearby = rate / samples
            raise ExcitationError(
                f"{what}: the lines {lines[0]:g} ... {lines[-1]:g} Hz have no common base frequency with a whole "
                f"number of samples a period at {rate:g} Hz (up to {LONGEST_PERIOD:g} samples were tried, {line:.9g} "
                f"Hz broke it). What would fit: base_frequency={nearby:.9g} Hz ({samples} samples) and the lines "
                f"rounded to its multiples, np.round(frequencies / {nearby:.9g}) * {nearby:.9g}; or ibs.band_lines."
            )
    return max(count, 2)


def _amplitudes(amplitude: Amplitude, lines: Array, rms: float | None, what: str) -> Array:
    given = amplitude(lines) if callable(amplitude) else amplitude
    try:
        sizes = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise ExcitationError(
            f"{what}: amplitude must be a number, numbers or a function, got {amplitude!r}."
        ) from None
    if sizes.ndim > 1 or (sizes.ndim == 1 and len(sizes) != len(lines)):
        raise ExcitationError(f"{what}: amplitude has shape {sizes.shape}, but there are {len(lines)} lines.")
    sizes = np.array(np.broadcast_to(sizes, lines.shape))
    if not np.isfinite(sizes).all() or (sizes <= 0).any():
        raise ExcitationError(
            f"{what}: every line's amplitude must be finite and above zero; leave out the lines that have none. Got "
            f"{sizes[(~np.isfinite(sizes)) | (sizes <= 0)][0]}."
        )
    if rms is not None:
        sizes *= positive(rms, f"{what}: rms", "") / np.sqrt(np.sum(sizes**2) / 2)
    return np.asarray(sizes, dtype=np.float64)


def _phases(phases: str | ArrayLike, lines: Array, sizes: Array, seed: int, what: str) -> Array:
    if isinstance(phases, str):
        if phases not in PHASES:
            raise ExcitationError(f"{what}: phases={phases!r} are not known. {nearest(phases, PHASES)}")
        if phases != "schroeder":
            return _random_phases(len(lines), np.random.default_rng(checked_seed(seed)))
        spacing = np.diff(lines)
        even = len(lines) < 3 or np.ptp(spacing) <= 1e-6 * spacing.max()
        if not even or np.ptp(sizes) > 1e-6 * sizes.max():
            raise ExcitationError(
                f"{what}: Schroeder's phases need equidistant lines of one amplitude (log-spaced ones come out worse "
                "than random); take phases='low-crest'."
            )
        number = np.arange(1, len(lines) + 1)
        return np.asarray(-np.pi * number * (number - 1) / len(lines))
    angles = np.array(phases, dtype=float)
    if angles.shape != lines.shape or not np.isfinite(angles).all():
        raise ExcitationError(f"{what}: phases must be {len(lines)} finite numbers [rad], got shape {angles.shape}.")
    return angles


def _random_phases(count: int, rng: np.random.Generator) -> Array:
    return rng.uniform(-np.pi, np.pi, count)


def _spectrum(lines: Array, base: float, amplitudes: NDArray[np.complexfloating], count: int) -> Array:
    spectrum = np.zeros(count // 2 + 1, dtype=complex)
    spectrum[np.round(lines / base).astype(int)] = 0.5 * count * amplitudes
    return np.asarray(scipy.fft.irfft(spectrum, count), dtype=np.float64)


def _samples(lines: Array, base: float, sizes: Array, phases: Array, count: int) -> Array:
    return _spectrum(lines, base, sizes * np.exp(1j * phases), count)


def _crest(samples: Array) -> float:
    return float(np.abs(samples).max() / np.sqrt(np.mean(samples**2)))


def _low_crest(lines: Array, base: float, sizes: Array, phases: Array, count: int) -> Array:
    """Return phases of low crest factor by clipping the peaks and restoring the amplitudes, again and again.

    E. Van der Ouderaa, J. Schoukens, J. Renneboog, Peak factor minimization using a time-frequency domain swapping
    algorithm, IEEE Transactions on Instrumentation and Measurement 37 (1988) 145-147.
    """
    numbers = np.round(lines / base).astype(int)
    best, angles = phases, phases
    samples = _samples(lines, base, sizes, angles, count)
    lowest = _crest(samples)
    # The level rises slowly: low ones first find the rough shape, high ones then smooth the last peaks.
    for level in np.linspace(0.75, 0.99, CLIPPING_ROUNDS):
        top = level * np.abs(samples).max()
        angles = np.angle(scipy.fft.rfft(np.clip(samples, -top, top))[numbers])
        samples = _samples(lines, base, sizes, angles, count)
        crest = _crest(samples)
        if crest < lowest:
            best, lowest = angles, crest
    return np.asarray(best)


def _whole(value: object, what: str, least: int) -> int:
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < least:
        raise ExcitationError(f"{what} must be a whole number from {least} on, got {value!r}.")
    return int(value)


def common_period(excitations: Sequence[Excitation]) -> int | None:
    """Return the samples after which all excitations repeat together; None where one never does."""
    if not excitations or not all(excitation.is_periodic for excitation in excitations):
        return None
    return math.lcm(*(excitation.n_samples for excitation in excitations))
