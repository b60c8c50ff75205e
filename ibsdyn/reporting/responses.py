"""Frequency responses of all fidelities, on grids that resolve every resonance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.comparison import Comparison
from ibsdyn.components import FlexibleBody
from ibsdyn.errors import IbsdynError
from ibsdyn.frequency_response import FrequencyResponse, unit_ratio
from ibsdyn.identification.frf_estimate import FrfEstimate
from ibsdyn.linear_system import LinearSystem
from ibsdyn.model import Model
from ibsdyn.plotting.bode import steady_phase
from ibsdyn.reporting.packing import packed
from ibsdyn.resonance_grid import poles, resonance_grid
from ibsdyn.signals import Input, Output

# Of all curves of a page together; one curve has so many lines at most.
MOST_VALUES, MOST_LINES = 120_000, 2500
FEWEST_LINES = 200


def default_band(system: LinearSystem, modes: int) -> tuple[float, float]:
    """Return a band [Hz] from well below the first elastic mode to above the last one that the report shows.

    It ends where the reduction of a flexible body is not to be trusted any more.
    """
    frequencies = system.modes().frequencies[~system.modes().rigid]
    if not len(frequencies):
        return 1.0, 1000.0
    trusted = [b.reduced.trusted_frequency for b in system._assembly.bodies if isinstance(b, FlexibleBody)]
    upper = min([1.5 * float(frequencies[min(modes, len(frequencies)) - 1]), *trusted])
    return 0.1 * float(frequencies[0]), max(upper, 3.0 * float(frequencies[0]))


def response_data(
    systems: Mapping[str, tuple[Model, LinearSystem]], band: tuple[float, float]
) -> tuple[dict[str, Any] | None, list[str]]:
    """Return what the page draws of the first model's inputs and sensors, and what is missing in words.

    systems: model and linear system of each fidelity by the name it has on the page, the reported one first.
    """
    (model, _), *_ = systems.values()
    inputs, sensors = list(model.inputs.values()), list(model.sensors.values())
    if not inputs or not sensors:
        missing = "inputs" if not inputs else "sensors"
        adding = "model.add_input(ibs.Force(...))" if not inputs else "model.add_sensor(ibs.Sensor(...))"
        return None, [f"The model has no {missing}; {adding} adds one."]
    allowed = int(np.clip(MOST_VALUES // (len(inputs) * len(sensors) * len(systems)), FEWEST_LINES, MOST_LINES))
    curves: list[dict[str, Any]] = []
    notes: list[str] = []
    for label, (own, system) in systems.items():
        frequencies = _lines(system, band, allowed)
        own_inputs = [own.inputs.get(signal.name, signal) for signal in inputs]
        own_sensors = [own.sensors.get(sensor.name, sensor) for sensor in sensors]
        lacking = []
        for o, sensor in enumerate(own_sensors):
            for i, signal in enumerate(own_inputs):
                frf = _response(system, signal, sensor, frequencies)
                if isinstance(frf, FrequencyResponse):
                    curves.append(
                        {"label": label, "output": o, "input": i, **_curve(frf.frequencies, frf.response[0, 0])}
                    )
                else:
                    lacking.append(f"{signal.name} → {sensor.name} ({frf})")
        if lacking:
            several = f" and {len(lacking) - 1} more responses" if len(lacking) > 1 else ""
            notes.append(f"{label} does not have {lacking[0]}{several}.")
    units = [[_unit(sensor, signal) for signal in inputs] for sensor in sensors]
    data = {
        "inputs": [signal.name for signal in inputs],
        "outputs": [sensor.name for sensor in sensors],
        "units": units,
        "curves": curves,
    }
    return (data if curves else None), notes


def comparison_data(comparison: Comparison) -> dict[str, Any]:
    """Return model and test, with the test's region where it has one."""
    model, test = comparison.model, comparison.test
    radius = None
    if isinstance(test, FrfEstimate) and comparison.confidence is not None:
        radius = np.asarray(test.radius(comparison.confidence))
    curves = []
    for o in range(len(model.outputs)):
        for i in range(len(model.inputs)):
            place = {"output": o, "input": i}
            curves.append({"label": "test", **place, **_curve(test.frequencies, test.response[o, i])})
            if radius is not None:
                size = np.abs(test.response[o, i])
                curves[-1]["low"] = packed(np.maximum(size - radius[o, i], 0.0), "f4")
                curves[-1]["high"] = packed(size + radius[o, i], "f4")
            curves.append({"label": "model", **place, **_curve(model.frequencies, model.response[o, i])})
    return {
        "inputs": list(model.inputs),
        "outputs": list(model.outputs),
        "units": [[model.unit(o, i) for i in range(len(model.inputs))] for o in range(len(model.outputs))],
        "curves": curves,
        "confidence": comparison.confidence,
    }


def _response(system: LinearSystem, signal: Input, sensor: Output, frequencies: Array) -> FrequencyResponse | str:
    try:
        return system.frf(signal, sensor, frequencies)
    except IbsdynError as error:
        return str(error).rstrip(".")


def _lines(system: LinearSystem, band: tuple[float, float], allowed: int) -> Array:
    """Equal steps of the logarithm, and where a resonance needs more of them, as many as are allowed."""
    even = np.geomspace(*band, allowed // 2)
    nodes = resonance_grid(poles(system), band).frequencies
    nodes = nodes[:: max(1, int(np.ceil(len(nodes) / (allowed - len(even)))))]
    modes = system.modes()
    peaks = modes.frequencies * np.sqrt(np.clip(1 - 2 * modes.damping_ratios**2, 0, 1))
    peaks = peaks[(peaks > band[0]) & (peaks < band[1])]
    return np.unique(np.concatenate([even, nodes, peaks]))


def _curve(frequencies: Array, response: Array | np.ndarray) -> dict[str, Any]:
    return {
        "x": packed(frequencies, "f4"),
        "magnitude": packed(np.abs(response), "f4"),
        "phase": packed(steady_phase(np.degrees(np.angle(response))), "f4"),
    }


def _unit(sensor: Output, signal: Input) -> str:
    return unit_ratio(sensor.unit, signal.unit)


def labels(models: Sequence[Model], fidelities: Sequence[str]) -> list[str]:
    """Return what each model is called on the page: its name, with its fidelity where names are the same."""
    names = [model.name for model in models]
    found: list[str] = []
    for name, fidelity in zip(names, fidelities, strict=True):
        label = name if names.count(name) == 1 else f"{name} ({fidelity})"
        while label in found:
            label += " ′"
        found.append(label)
    return found
