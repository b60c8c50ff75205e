"""How far the linear model holds: its FRFs beside those of nonlinear runs over a range of amplitudes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ibsdyn.axes import Array
from ibsdyn.engine import FlexibleMapping
from ibsdyn.errors import ExcitationError, ModelError, SimulationError, known_keywords
from ibsdyn.generalized_alpha import linear_frequency
from ibsdyn.model import Model
from ibsdyn.multisine import Multisine
from ibsdyn.signals import Input, Sensor, checked_inputs, checked_outputs
from ibsdyn.simulation import steps_needed
from ibsdyn.validation import number


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """Nonlinear responses over amplitude, beside the linear one.

    Attributes
    ----------
    amplitudes : (n_amp,) RMS of the excitation, rising, in ``input_unit``.
    frequencies : (n_freq,) lines of the excitation [Hz].
    linear : (n_out, n_freq) responses of the linear model, with the integrator's shift of frequency.
    nonlinear : (n_amp, n_out, n_freq) responses of the runs; NaN where a run had no result.
    deviation : (n_amp, n_out) largest difference of the two as a share of the linear peak; inf where a run had none.
    tolerance : deviation up to which the linear model is said to hold.
    failures : {amplitude: message} of the runs that had no result.
    input, input_unit, outputs, output_units : names and units.
    """

    amplitudes: Array
    frequencies: Array
    linear: NDArray[np.complexfloating]
    nonlinear: NDArray[np.complexfloating]
    deviation: Array
    tolerance: float
    failures: dict[float, str]
    input: str
    input_unit: str
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]

    @property
    def holds_up_to(self) -> dict[str, float]:
        """By output the largest amplitude up to which every run was within the tolerance; 0 if none was."""
        within = np.logical_and.accumulate(self.deviation <= self.tolerance, axis=0)
        amplitudes = np.r_[0.0, self.amplitudes]
        return {name: float(amplitudes[count]) for name, count in zip(self.outputs, within.sum(axis=0), strict=True)}

    def __str__(self) -> str:
        """Say in words up to which amplitude the linear model holds."""
        lines = [f"Linear within {100 * self.tolerance:g} % of the peak, {self.input}, RMS:"]
        top = float(self.amplitudes[-1])
        for name, limit in self.holds_up_to.items():
            if limit == 0.0:
                words = f"at none of the amplitudes, {self.amplitudes[0]:.3g} {self.input_unit} and more"
            else:
                words = f"up to {limit:.3g} {self.input_unit}" + (", the largest that was run" if limit == top else "")
            lines.append(f"  {name}: {words}")
        lines += [f"  {amplitude:.3g} {self.input_unit}: {why}" for amplitude, why in self.failures.items()]
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)

    def plot(self, axes: Sequence[object] | np.ndarray | None = None) -> np.ndarray:
        """Draw the responses over frequency, the linear one dashed black, and the deviation over amplitude.

        Parameters
        ----------
        axes : what an earlier call returned; a new figure if None.

        Returns
        -------
        (n_out, 2) array of matplotlib Axes.
        """
        from ibsdyn.plotting.cross_check import plot_cross_check

        return plot_cross_check(self, axes)


@known_keywords
def cross_check(
    model: Model,
    amplitudes: ArrayLike,
    source: Input,
    sensors: Sensor | Sequence[Sensor],
    excitation: Multisine,
    tolerance: float = 0.05,
    gravity: Sequence[float] | None = None,
    flexible: FlexibleMapping = "floating-frame",
    progress: bool = True,
) -> CrossCheck:
    """Run the nonlinear model over amplitudes and say up to which its linear FRF holds.

    Parameters
    ----------
    model : what is run.
    amplitudes : RMS values of the excitation [unit of the input].
    source : the input that is driven.
    sensors : one or several.
    excitation : lines, relative amplitudes and phases; it is scaled to each amplitude.
    tolerance : deviation from the linear response, as a share of its peak, that still counts as linear.
    gravity, flexible, progress : as in ``Model.simulate``.

    Raises
    ------
    ModelError : amplitudes that are none, an input or sensor that the model does not have.
    ExcitationError : an excitation that is no multisine.
    SimulationError : already the smallest amplitude has no result.

    Notes
    -----
    A run starts in the linear steady state; its second period counts, when the first has brought it near its own.
    """
    try:
        rms = np.unique(np.atleast_1d(np.asarray(amplitudes, dtype=float)))
    except (TypeError, ValueError):
        raise ModelError(f"cross_check: amplitudes must be finite RMS values, got {amplitudes!r}.") from None
    allowed = number(tolerance, "cross_check: tolerance (a share of the peak)", "", above=0.0)
    if not rms.size or not np.isfinite(rms).all() or rms[0] <= 0:
        raise ModelError(f"cross_check: amplitudes must be finite RMS values above zero, got {amplitudes!r}.")
    if not isinstance(excitation, Multisine):
        raise ExcitationError(f"cross_check: excitation must come from ibs.multisine, got {excitation!r}.")
    (driven,) = checked_inputs(source)
    seen = checked_outputs(sensors)
    system = model.linearize()
    steps = steps_needed(system, [excitation], excitation.sample_rate)
    step = 1.0 / (steps * excitation.sample_rate)
    linear = system.frf(driven, seen, linear_frequency(excitation.lines, step)).response[:, 0]
    places = np.round(excitation.lines / excitation.base_frequency).astype(int)
    nonlinear = np.full((len(rms), *linear.shape), np.nan, dtype=complex)
    failures: dict[float, str] = {}
    for row, amplitude in enumerate(rms):
        try:
            record = model.simulate(
                {driven: excitation.scaled(float(amplitude) / excitation.rms)},
                seen,
                duration=2 * excitation.n_samples / excitation.sample_rate,
                start="steady",
                gravity=gravity,
                flexible=flexible,
                steps_per_sample=steps,
                progress=progress,
            )
        except SimulationError as error:
            if row == 0:
                raise
            failures[float(amplitude)] = str(error)
            continue
        spectra = np.fft.rfft(record.signals[:, excitation.n_samples :], axis=1)[:, places]
        nonlinear[row] = spectra[1:] / spectra[0]
    apart = np.abs(nonlinear - linear).max(axis=2) / np.abs(linear).max(axis=1)
    deviation = np.where(np.isfinite(apart), apart, np.inf)
    for array in (rms, linear, nonlinear, deviation):
        array.setflags(write=False)
    return CrossCheck(
        amplitudes=rms,
        frequencies=excitation.lines,
        linear=linear,
        nonlinear=nonlinear,
        deviation=deviation,
        tolerance=allowed,
        failures=failures,
        input=driven.name,
        input_unit=driven.unit,
        outputs=tuple(sensor.name for sensor in seen),
        output_units=tuple(sensor.unit for sensor in seen),
    )
