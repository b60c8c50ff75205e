"""What was measured on a machine, with its uncertainty: what a model is fitted to."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import ModelError, known_keywords
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.identification import FrfEstimate
from ibsdyn.signals import Input, Sensor, checked_inputs, checked_outputs
from ibsdyn.validation import numbers_of


@dataclass(frozen=True, eq=False, init=False)
class MeasuredFrequencies:
    """Natural frequencies that were measured.

    Parameters
    ----------
    frequencies : (n_modes,) [Hz].
    sigma : their standard uncertainties [Hz]; one number for all or (n_modes,).
    modes : which elastic modes of the model they are, from 1; the first ones in order if None. Not needed with shapes.
    shapes : (n_sensors, n_modes) measured shapes, any scale, real or complex: each finds the model's mode that it
        resembles most.
    sensors : where and along what the shapes were measured, n_sensors.
    damping_ratios, damping_sigma : (n_modes,) measured ratios and their standard uncertainties, where these count too.

    Raises
    ------
    ModelError : numbers that do not fit each other, or that cannot be.
    """

    frequencies: Array
    sigma: Array
    modes: tuple[int, ...] | None
    shapes: NDArray[np.complex128] | None
    sensors: tuple[Sensor, ...]
    damping_ratios: Array | None
    damping_sigma: Array | None

    @known_keywords
    def __init__(
        self,
        frequencies: ArrayLike,
        sigma: ArrayLike,
        modes: Sequence[int] | None = None,
        shapes: ArrayLike | None = None,
        sensors: Sensor | Sequence[Sensor] | None = None,
        damping_ratios: ArrayLike | None = None,
        damping_sigma: ArrayLike | None = None,
    ) -> None:
        what = "MeasuredFrequencies"
        hertz = _positive(frequencies, None, f"{what}: frequencies [Hz]")
        count = len(hertz)
        if modes is not None and shapes is not None:
            raise ModelError(f"{what}: give modes= or shapes=, not both; either says which mode is which.")
        if (shapes is None) != (sensors is None):
            raise ModelError(f"{what}: shapes= and sensors= go together.")
        if (damping_ratios is None) != (damping_sigma is None):
            raise ModelError(f"{what}: damping_ratios= and damping_sigma= go together.")
        numbers = None if modes is None else tuple(modes) if isinstance(modes, Iterable) else (modes,)
        if numbers is not None and (
            len(numbers) != count
            or len(set(numbers)) < count
            or not all(isinstance(mode, Integral) and mode >= 1 for mode in numbers)
        ):
            raise ModelError(f"{what}: modes must be {count} different whole numbers from 1, got {modes!r}.")
        points = () if sensors is None else checked_outputs(sensors)
        try:
            seen = None if shapes is None else np.array(shapes, dtype=complex, ndmin=2)
        except (TypeError, ValueError):
            raise ModelError(f"{what}: shapes must be (n_sensors, n_modes) numbers, got {shapes!r}.") from None
        if seen is not None and seen.shape != (len(points), count):
            raise ModelError(
                f"{what}: shapes have shape {seen.shape}, but there are {len(points)} sensors and {count} frequencies."
            )
        fields = {
            "frequencies": hertz,
            "sigma": _positive(sigma, count, f"{what}: sigma [Hz]"),
            "modes": numbers,
            "shapes": seen,
            "sensors": points,
            "damping_ratios": None if damping_ratios is None else _positive(damping_ratios, count, f"{what}: ratios"),
            "damping_sigma": None if damping_sigma is None else _positive(damping_sigma, count, f"{what}: their sigma"),
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor


@dataclass(frozen=True, eq=False, init=False)
class MeasuredResponse:
    """Frequency responses that were measured.

    Parameters
    ----------
    response : from ``ibs.estimate_frf``, which knows its uncertainty, or any FrequencyResponse.
    inputs, outputs : what its inputs and outputs are on the model, in the same order.
    sigma : standard uncertainty of the complex values, the root of E|dG|², in their units: (n_out, n_in, n_freq) or
        what becomes that; that of the estimate if None.
    band : (lower, upper) [Hz] of the lines that count; all of them if None.

    Raises
    ------
    ModelError : signals that do not fit the response, no uncertainty, no line in the band.

    Attributes
    ----------
    lines : (n_lines,) places of the frequencies that count.
    degrees_of_freedom : (n_lines,) complex ones from which an estimate knows its variance; None for a given ``sigma``,
        which is taken as exact.
    """

    response: FrequencyResponse
    inputs: tuple[Input, ...]
    outputs: tuple[Sensor, ...]
    sigma: Array
    lines: NDArray[np.intp]
    degrees_of_freedom: Array | None

    @known_keywords
    def __init__(
        self,
        response: FrequencyResponse,
        inputs: Input | Sequence[Input],
        outputs: Sensor | Sequence[Sensor],
        sigma: ArrayLike | None = None,
        band: Sequence[float] | None = None,
    ) -> None:
        what = "MeasuredResponse"
        if not isinstance(response, FrequencyResponse):
            raise ModelError(
                f"{what}: response must be an ibs.FrequencyResponse, as ibs.estimate_frf gives, got {response!r}."
            )
        sources, sensors = checked_inputs(inputs), checked_outputs(outputs)
        pairs = (
            ("inputs", sources, response.inputs, response.input_units),
            ("outputs", sensors, response.outputs, response.output_units),
        )
        for label, given, names, units in pairs:
            if len(given) != len(names):
                raise ModelError(f"{what}: {len(given)} {label} for a response of {len(names)}: {', '.join(names)}.")
            for signal, name, unit in zip(given, names, units, strict=True):
                if signal.unit != unit:
                    raise ModelError(
                        f"{what}: {name!r} is measured in {unit}, but {signal.name!r} of the model is in {signal.unit}."
                    )
        freedom: Array | None = None
        if sigma is None:
            if not isinstance(response, FrfEstimate):
                raise ModelError(f"{what}: the response does not know its uncertainty; give sigma=.")
            deviation, freedom = np.sqrt(response.variance), response.degrees_of_freedom
        else:
            try:
                deviation = np.broadcast_to(np.asarray(sigma, dtype=float), response.response.shape)
            except (TypeError, ValueError):
                raise ModelError(
                    f"{what}: sigma must be numbers of shape {response.response.shape} or what becomes that, got "
                    f"{sigma!r}."
                ) from None
        lower, upper = (0.0, np.inf) if band is None else numbers_of(band, 2, f"{what}: band", "lower, upper [Hz]")
        lines = np.flatnonzero((response.frequencies >= lower) & (response.frequencies <= upper))
        if not len(lines):
            raise ModelError(f"{what}: no line of the response lies in the band {band}.")
        counted = deviation[:, :, lines]
        if not (np.isfinite(counted) & (counted > 0)).all():
            raise ModelError(f"{what}: sigma must be finite and above 0 at every line that counts.")
        fields = {
            "response": response,
            "inputs": sources,
            "outputs": sensors,
            "sigma": deviation,
            "lines": lines,
            "degrees_of_freedom": None if freedom is None else freedom[lines],
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor


Measured = MeasuredFrequencies | MeasuredResponse


def checked_measured(measured: object) -> list[Measured]:
    """Return what was measured as a list; a single one is taken as a list of one.

    Raises
    ------
    ModelError : empty, or something else.
    """
    listed = list(measured) if isinstance(measured, (list, tuple)) else [measured]
    kept = [each for each in listed if isinstance(each, (MeasuredFrequencies, MeasuredResponse))]
    if not listed or len(kept) < len(listed):
        raise ModelError(
            f"fit: measured must be ibs.MeasuredFrequencies or ibs.MeasuredResponse, one or several, got {measured!r}."
        )
    return kept


def _positive(values: ArrayLike, count: int | None, what: str) -> Array:
    try:
        array = np.array(values, dtype=float, ndmin=1)
        array = array if count is None else np.array(np.broadcast_to(array, (count,)))
    except (TypeError, ValueError):
        wanted = "numbers" if count is None else f"{count} numbers"
        raise ModelError(f"{what}: must be {wanted}, got {values!r}.") from None
    if array.ndim != 1 or not array.size or not (np.isfinite(array) & (array > 0)).all():
        raise ModelError(f"{what}: must be finite numbers above 0, got {values!r}.")
    return array
