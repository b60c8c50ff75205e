"""Shocks: pulses, what a linear system answers to them, and shock response spectra."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError, ModelError, known_keywords
from ibsdyn.excitation import Excitation, positive, sample_count, sampled
from ibsdyn.harmonic import checked_frequencies
from ibsdyn.linear_system import LinearSystem, checked_system
from ibsdyn.signals import Input, Output, checked_inputs, checked_outputs
from ibsdyn.time_record import TimeRecord
from ibsdyn.validation import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# The peak of a vibration that is sampled this often a period is seen to 1 - cos(pi/32) = 0.5 %.
SAMPLES_PER_PERIOD = 32
FREQUENCIES_PER_OCTAVE = 12


@known_keywords
def half_sine(amplitude: float, pulse_duration: float, sample_rate: float, duration: float) -> Excitation:
    """Return a half-sine pulse that begins at once, followed by rest.

    Parameters
    ----------
    amplitude : peak, in the unit of the input that it drives.
    pulse_duration : of the half sine [s].
    sample_rate : [Hz]; twenty samples or more should fall on the pulse.
    duration : of the whole signal [s].

    Raises
    ------
    ExcitationError : a signal that is shorter than the pulse, or a rate that is too low for it.
    ModelError : a value that is no number or not positive.
    """
    what = "half_sine"
    rate = positive(sample_rate, f"{what}: sample_rate", "Hz")
    width = positive(pulse_duration, f"{what}: pulse_duration", "s")
    peak = number(amplitude, f"{what}: amplitude", "")
    count = sample_count(duration, rate, what)
    if count / rate < width or width * rate < 8:
        raise ModelError(
            f"{what}: a pulse of {width:g} s needs eight samples at least and a signal that is longer; it has "
            f"{width * rate:.3g} samples in {count / rate:g} s."
        )
    time = np.arange(count) / rate
    samples = np.where(time <= width, peak * np.sin(np.pi * time / width), 0.0)
    return Excitation(samples, rate, 1, False, f"half sine of {width:g} s", _circular=False)


@known_keywords
def transient_response(
    system: LinearSystem,
    excitations: Mapping[Input, Excitation | ArrayLike],
    outputs: Output | Sequence[Output],
    sample_rate: float | None = None,
) -> TimeRecord:
    """Return the linear response in time to given signals, from rest.

    Parameters
    ----------
    system : from ``model.linearize()``.
    excitations : {input: signal}; signals of one length, straight between their samples.
    outputs : Sensor or CombinedSensor, one or several.
    sample_rate : of plain arrays [Hz]; that of the excitations if None.

    Returns
    -------
    TimeRecord of the inputs and the outputs.

    Raises
    ------
    ModelError : an input or output that the model does not have, signals of different lengths or rates.
    AnalysisError : an output that needs the derivative of an input.

    Notes
    -----
    Exact for signals that are straight between their samples (first-order hold of the state-space form). The nonlinear
    run is ``model.simulate``.
    """
    what = "transient_response"
    checked_system(system, what)
    if not isinstance(excitations, Mapping) or not excitations:
        raise ModelError(f"{what}: excitations must be a dict {{input: signal}}, got {excitations!r}.")
    sources = checked_inputs(list(excitations))
    sensors = checked_outputs(outputs)
    rates = {signal.sample_rate for signal in excitations.values() if isinstance(signal, Excitation)}
    if sample_rate is not None:
        rates.add(positive(sample_rate, f"{what}: sample_rate", "Hz"))
    if len(rates) != 1:
        raise ModelError(f"{what}: one sample rate is needed, got {sorted(rates) or 'none'} Hz.")
    rate = rates.pop()
    signals = []
    for source, signal in excitations.items():
        drive = signal if isinstance(signal, Excitation) else sampled(signal, rate, source.name)
        signals.append(np.tile(drive.samples, drive.periods))
    if len({len(signal) for signal in signals}) > 1:
        raise ModelError(f"{what}: the signals have {[len(signal) for signal in signals]} samples; give one length.")
    space = system.to_state_space(sources, sensors)
    driven = np.array(signals)
    time = np.arange(driven.shape[1]) / rate
    _, response, _ = scipy.signal.lsim((space.A, space.B, space.C, space.D), driven.T, time)
    return TimeRecord(
        np.vstack([driven, np.asarray(response).reshape(len(time), -1).T]),
        [signal.name for signal in (*sources, *sensors)],
        [signal.unit for signal in (*sources, *sensors)],
        rate,
        title="linear response",
    )


@dataclass(frozen=True, eq=False)
class ShockSpectrum:
    """Largest absolute acceleration of single-DoF systems on a base that is shocked, over their natural frequency.

    Attributes
    ----------
    frequencies : (n,) natural frequencies [Hz].
    positive, negative : (n,) largest response of either sign, both as positive numbers [unit].
    damping_ratio : of the systems; the quality factor is 1 / (2 damping_ratio).
    unit : of the acceleration.
    title : what was shocked.
    """

    frequencies: Array
    positive: Array
    negative: Array
    damping_ratio: float
    unit: str
    title: str

    @property
    def maximax(self) -> Array:
        """(n,) largest response of either sign [unit]."""
        return np.maximum(self.positive, self.negative)

    def plot(self, axes: Axes | None = None, label: str | None = None) -> Axes:
        """Draw the maximax spectrum on log-log axes.

        Parameters
        ----------
        axes : where to draw; a new figure if None.
        label : name in the legend; the title if None.

        Returns
        -------
        The matplotlib Axes drawn on.
        """
        from ibsdyn.plotting.shock import plot_shock_spectrum

        return plot_shock_spectrum(self, axes, label)


@known_keywords
def shock_response_spectrum(
    record: TimeRecord,
    channel: str | None = None,
    frequencies: ArrayLike | None = None,
    damping_ratio: float = 0.05,
) -> ShockSpectrum:
    """Return the shock response spectrum of an acceleration.

    Parameters
    ----------
    record : with the acceleration of the base, beginning at rest.
    channel : its name; the only channel if None.
    frequencies : (n,) natural frequencies [Hz]; twelve an octave from the inverse of the record's length to a fifth of
        the sample rate if None.
    damping_ratio : of the systems; 0.05 is a quality factor of 10.

    Returns
    -------
    ShockSpectrum: during and after the record, until each system has swung once more.

    Raises
    ------
    ModelError : several channels and none named, a damping ratio that is not between 0 and 1.
    AnalysisError : frequencies that are none.

    Notes
    -----
    D. O. Smallwood, An improved recursive formula for calculating shock response spectra, Shock and Vibration Bulletin
    51 (1981): exact for an acceleration that is straight between its samples; it is sampled more finely where a system
    is quick.
    """
    what = "shock_response_spectrum"
    if not isinstance(record, TimeRecord):
        raise ModelError(
            f"{what} takes an ibs.TimeRecord, from ibs.transient_response or ibs.read_record, got {record!r}."
        )
    if channel is None and len(record.names) > 1:
        raise ModelError(f"{what}: {record.title!r} has several channels; name one of {list(record.names)}.")
    row = 0 if channel is None else record.index(channel)
    zeta = number(damping_ratio, f"{what}: damping_ratio", "", minimum=0.0)
    if zeta >= 1.0:
        raise ModelError(f"{what}: damping_ratio must be below 1, got {zeta:g}; was a percentage meant?")
    if frequencies is None:
        octaves = math.log2(record.sample_rate / 5 * record.duration)
        steps = np.arange(max(2, int(octaves * FREQUENCIES_PER_OCTAVE) + 1)) / FREQUENCIES_PER_OCTAVE
        hertz = 2.0**steps / record.duration
    else:
        hertz = checked_frequencies(frequencies)
        if (hertz <= 0).any():
            raise AnalysisError(f"{what}: natural frequencies must be above 0 Hz, got {hertz.min():g}.")
    peaks = np.array([_peaks(record.signals[row], record.sample_rate, float(f), zeta) for f in hertz])
    return ShockSpectrum(hertz, peaks[:, 0], peaks[:, 1], zeta, record.units[row], f"{record.names[row]}")


def _peaks(acceleration: Array, rate: float, frequency: float, zeta: float) -> tuple[float, float]:
    """Return the largest positive and negative absolute acceleration of one system."""
    factor = max(1, math.ceil(SAMPLES_PER_PERIOD * frequency / rate))
    n = len(acceleration)
    fine = np.interp(np.arange((n - 1) * factor + 1) / factor, np.arange(n), acceleration)
    # Straight down to zero within one sample, then rest for a period of the damped vibration.
    rest = np.linspace(fine[-1], 0.0, factor + 1)[1:]
    step = 1.0 / (rate * factor)
    omega = 2 * math.pi * frequency
    damped = omega * math.sqrt(1 - zeta**2)
    after = np.zeros(math.ceil(2 * math.pi / damped / step) + 1)
    driven = np.concatenate([fine, rest, after])
    decay, angle = math.exp(-zeta * omega * step), damped * step
    c, s = decay * math.cos(angle), decay * math.sin(angle)
    slope = s / angle
    response = scipy.signal.lfilter([1 - slope, 2 * (slope - c), decay**2 - slope], [1.0, -2 * c, decay**2], driven)
    return float(max(response.max(), 0.0)), float(max(-response.min(), 0.0))
