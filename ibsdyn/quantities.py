"""What a requirement is about: one number of a linear system, with its name and unit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import Protocol

import numpy as np
import scipy.optimize

from ibsdyn.axes import Array
from ibsdyn.budget import response_power
from ibsdyn.disturbances import AnyDisturbance, checked_disturbances
from ibsdyn.errors import AnalysisError, ModelError, known_keywords
from ibsdyn.frequency_response import unit_ratio
from ibsdyn.linear_system import LinearSystem, checked_system
from ibsdyn.resonance_grid import checked_band, poles, resonance_grid
from ibsdyn.signals import Input, Output, checked_inputs, checked_outputs
from ibsdyn.validation import in_words, number, shown_name

# At these shares of the lowest elastic frequency a response that has a limit at 0 Hz has reached it.
NEAR_ZERO = (1e-4, 1e-5)
LIMIT_TOLERANCE = 1e-6
# Local maxima below this share of the highest one on the grid cannot be the highest: the grid resolves every resonance.
PEAK_SHARE = 0.8


class Quantity(Protocol):
    """One number of a linear system."""

    @property
    def name(self) -> str:
        """How results call it."""

    @property
    def unit(self) -> str:
        """Its unit."""

    def evaluate(self, system: LinearSystem) -> float:
        """Return its value for a system."""


@dataclass(frozen=True, init=False)
class ModeFrequency:
    """The frequency of an elastic mode [Hz].

    Parameters
    ----------
    mode : its number, from 1; rigid-body modes (0 Hz) are not counted.
    name : how results call it.

    Raises
    ------
    ModelError : a number that is none.
    """

    mode: int
    name: str

    @known_keywords
    def __init__(self, mode: int = 1, name: str | None = None) -> None:
        _set(self, mode=_mode(mode, "ModeFrequency"), name=shown_name(name, f"frequency of mode {mode}"))

    @property
    def unit(self) -> str:
        """Hz."""
        return "Hz"

    def evaluate(self, system: LinearSystem) -> float:
        """Return the frequency [Hz]; AnalysisError if there are fewer elastic modes."""
        checked_system(system, f"the quantity {self.name!r}")
        return float(system.modes().frequencies[_elastic(system, self.mode)])


@dataclass(frozen=True, init=False)
class ModeDamping:
    """The damping ratio of an elastic mode.

    Parameters
    ----------
    mode : its number, from 1; rigid-body modes (0 Hz) are not counted.
    name : how results call it.

    Raises
    ------
    ModelError : a number that is none.
    """

    mode: int
    name: str

    @known_keywords
    def __init__(self, mode: int = 1, name: str | None = None) -> None:
        _set(self, mode=_mode(mode, "ModeDamping"), name=shown_name(name, f"damping ratio of mode {mode}"))

    @property
    def unit(self) -> str:
        """A ratio, ``-``."""
        return "-"

    def evaluate(self, system: LinearSystem) -> float:
        """Return the damping ratio; AnalysisError if there are fewer elastic modes."""
        checked_system(system, f"the quantity {self.name!r}")
        return float(system.modes().damping_ratios[_elastic(system, self.mode)])


@dataclass(frozen=True, init=False)
class ResponseAt:
    """The magnitude of a frequency response at one frequency.

    Parameters
    ----------
    input : Force, Torque or BaseMotion.
    output : Sensor or CombinedSensor.
    frequency : [Hz]; 0 where the response has a limit there, as a compliance or a transmissibility.
    name : how results call it.

    Raises
    ------
    ModelError : something that is no input, no sensor or no frequency.
    """

    input: Input
    output: Output
    frequency: float
    name: str

    @known_keywords
    def __init__(self, input: Input, output: Output, frequency: float, name: str | None = None) -> None:
        (source,), (sensor,) = checked_inputs(input), checked_outputs(output)
        hertz = number(frequency, "ResponseAt: frequency", "Hz", minimum=0.0)
        default = f"{sensor.name} / {source.name} at {hertz:g} Hz"
        _set(self, input=source, output=sensor, frequency=hertz, name=shown_name(name, default))

    @property
    def unit(self) -> str:
        """Unit of the output per unit of the input."""
        return unit_ratio(self.output.unit, self.input.unit)

    def evaluate(self, system: LinearSystem) -> float:
        """Return the magnitude; AnalysisError where it is infinite."""
        checked_system(system, f"the quantity {self.name!r}")
        try:
            return float(_magnitude(system, self.input, self.output, np.array([self.frequency]))[0])
        except AnalysisError:
            elastic = system.modes().frequencies[~system.modes().rigid]
            if self.frequency > 0.0:
                raise
            reference = float(elastic[0]) if len(elastic) else 1.0
            near = _magnitude(system, self.input, self.output, reference * np.array(NEAR_ZERO))
            if abs(near[0] - near[1]) > LIMIT_TOLERANCE * near[1]:
                raise
            return float(near[1])


@dataclass(frozen=True, init=False)
class PeakResponse:
    """The largest magnitude of a frequency response in a band, at a resonance or at an end of the band.

    Parameters
    ----------
    input : Force, Torque or BaseMotion.
    output : Sensor or CombinedSensor.
    band : (lower, upper) [Hz], lower above 0.
    name : how results call it.

    Raises
    ------
    ModelError : something that is no input or no sensor.
    AnalysisError : a band that is none.

    Notes
    -----
    Every resonance is resolved by a grid made from the poles, and the highest maxima on it are refined, so that no peak
    is missed or cut, however light the damping.
    """

    input: Input
    output: Output
    band: tuple[float, float]
    name: str

    @known_keywords
    def __init__(self, input: Input, output: Output, band: Sequence[float], name: str | None = None) -> None:
        (source,), (sensor,) = checked_inputs(input), checked_outputs(output)
        lower, upper = checked_band(band)
        default = f"peak of {sensor.name} / {source.name}, {lower:g} to {upper:g} Hz"
        _set(self, input=source, output=sensor, band=(lower, upper), name=shown_name(name, default))

    @property
    def unit(self) -> str:
        """Unit of the output per unit of the input."""
        return unit_ratio(self.output.unit, self.input.unit)

    def evaluate(self, system: LinearSystem) -> float:
        """Return the largest magnitude; AnalysisError where an undamped mode makes it infinite."""
        checked_system(system, f"the quantity {self.name!r}")
        return self.locate(system)[1]

    def locate(self, system: LinearSystem) -> tuple[float, float]:
        """Return the frequency of the peak [Hz] and its magnitude."""
        nodes = resonance_grid(poles(system), self.band).frequencies
        grid = np.r_[self.band[0], nodes, self.band[1]]
        values = _magnitude(system, self.input, self.output, grid)
        best = int(values.argmax())
        frequency, highest = float(grid[best]), float(values[best])
        inner = values[1:-1]
        maxima = 1 + np.flatnonzero((inner >= values[:-2]) & (inner >= values[2:]) & (inner > PEAK_SHARE * highest))
        for place in maxima:
            centre, reach = float(grid[place]), float(max(grid[place + 1] - grid[place], grid[place] - grid[place - 1]))

            def at(step: float, centre: float = centre, reach: float = reach) -> float:
                # In steps from the node: the search knows its variable to 1e-8 of itself, and a peak may be narrower.
                return -float(_magnitude(system, self.input, self.output, np.array([centre + step * reach]))[0])

            ends = ((grid[place - 1] - centre) / reach, (grid[place + 1] - centre) / reach)
            found = scipy.optimize.minimize_scalar(at, bounds=ends, method="bounded", options={"xatol": 1e-7})
            if -found.fun > highest:
                frequency, highest = centre + float(found.x) * reach, -float(found.fun)
        return frequency, highest


@dataclass(frozen=True, init=False)
class RmsResponse:
    """The RMS (one sigma) of an output under disturbances.

    Parameters
    ----------
    output : Sensor or CombinedSensor.
    disturbances : Disturbance, CorrelatedDisturbance, Tone; one or several, which add in power.
    band : (lower, upper) over which power is counted [Hz]; all that the disturbances reach if None.
    name : how results call it.

    Raises
    ------
    ModelError : something that is no sensor or no disturbance.
    AnalysisError : a band that is none.
    """

    output: Output
    disturbances: tuple[AnyDisturbance, ...]
    band: tuple[float, float] | None
    name: str

    @known_keywords
    def __init__(
        self,
        output: Output,
        disturbances: AnyDisturbance | Sequence[AnyDisturbance],
        band: Sequence[float] | None = None,
        name: str | None = None,
    ) -> None:
        (sensor,) = checked_outputs(output)
        causes = checked_disturbances(disturbances)
        limits = None if band is None else checked_band(band)
        reach = "" if limits is None else f", {limits[0]:g} to {limits[1]:g} Hz"
        default = f"RMS of {sensor.name} under {in_words([cause.name for cause in causes])}{reach}"
        _set(self, output=sensor, disturbances=causes, band=limits, name=shown_name(name, default))

    @property
    def unit(self) -> str:
        """Unit of the output."""
        return self.output.unit

    def evaluate(self, system: LinearSystem) -> float:
        """Return the RMS; AnalysisError where an undamped mode makes it infinite."""
        checked_system(system, f"the quantity {self.name!r}")
        return math.sqrt(response_power(system, self.output, self.disturbances, self.band))


def _magnitude(system: LinearSystem, source: Input, sensor: Output, frequencies: Array) -> Array:
    magnitude: Array = system.frf(source, sensor, frequencies).magnitude[0, 0]
    return magnitude


def _elastic(system: LinearSystem, mode: int) -> int:
    elastic = np.flatnonzero(~system.modes().rigid)
    if mode > len(elastic):
        raise AnalysisError(f"mode {mode} does not exist; the model has {len(elastic)} elastic modes.")
    return int(elastic[mode - 1])


def _mode(value: object, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise ModelError(f"{what}: mode must be a whole number from 1, got {value!r}.")
    return int(value)


def _set(target: object, **fields: object) -> None:
    for field, value in fields.items():
        object.__setattr__(target, field, value)  # frozen: this is its constructor
