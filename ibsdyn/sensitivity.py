"""Exact first-order sensitivities of what a model predicts to every number of its components."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.budget import CHUNK_BYTES, power_grid
from ibsdyn.disturbances import Tone
from ibsdyn.errors import AnalysisError, ModelError, known_keywords, warn_user
from ibsdyn.harmonic import checked_frequencies
from ibsdyn.linear_system import LinearSystem
from ibsdyn.mode_derivatives import ModeDerivatives, mode_derivatives
from ibsdyn.parameter_derivatives import MatrixChange, MotionBasis, matrix_changes
from ibsdyn.parameters import Parameter, checked_model, chosen_parameters, model_parameters
from ibsdyn.quantities import ModeDamping, ModeFrequency, PeakResponse, Quantity, ResponseAt, RmsResponse
from ibsdyn.response_derivatives import ResponseDerivatives
from ibsdyn.sensitivity_results import PLACE_STEP, RELATIVE_STEP, ResponseSensitivities, Sensitivities
from ibsdyn.signals import Input, Output, checked_inputs, checked_outputs

if TYPE_CHECKING:
    from ibsdyn.model import Model

# Central differences of quantities whose derivative is not known in closed form: relative step, and that of places [m].
DIFFERENCE_STEP = 1e-4
DIFFERENCE_PLACE = 1e-6


class SystemDerivatives:
    """What derivatives of one linear system have in common, prepared once.

    Parameters
    ----------
    system : the linear system.
    parameters : what to differentiate to.

    Attributes
    ----------
    parameters : those that have a derivative.
    without : why others have none, by address.
    """

    def __init__(self, system: LinearSystem, parameters: Sequence[Parameter]) -> None:
        self.system = system
        self.basis = MotionBasis(system)
        self.parameters: list[Parameter]
        self.parameters, self._changes, self.without = matrix_changes(self.basis, parameters)

    @property
    def changes(self) -> list[MatrixChange]:
        """Derivatives of M, C and K, one of each parameter."""
        return self._changes

    @cached_property
    def modes(self) -> ModeDerivatives:
        """Derivatives of the modes."""
        return mode_derivatives(self.basis, self._changes)

    def responses(self, inputs: Sequence[Input], outputs: Sequence[Output]) -> ResponseDerivatives:
        """Return what gives responses and their derivatives at any frequency."""
        return ResponseDerivatives(self.basis, self.parameters, self._changes, self.modes, inputs, outputs)

    def frequencies(self) -> Array:
        """Return the (P, n) derivatives of the natural frequencies [Hz]; 0 for rigid-body modes."""
        omega = np.where(self.basis.rigid, np.inf, self.basis.omega)
        return self.modes.eigenvalues / (4 * np.pi * omega)

    def gradient(self, quantity: Quantity) -> Array | None:
        """Return the (P,) derivatives of a quantity, None where its kind has no closed form here."""
        for kind, gradient in _GRADIENTS.items():
            if isinstance(quantity, kind):
                return gradient(self, quantity)
        return None


def _frequency_gradient(derivatives: SystemDerivatives, quantity: Quantity) -> Array:
    assert isinstance(quantity, ModeFrequency)
    return derivatives.frequencies()[:, _elastic(derivatives, quantity.mode)]


def _damping_gradient(derivatives: SystemDerivatives, quantity: Quantity) -> Array:
    assert isinstance(quantity, ModeDamping)
    return derivatives.modes.ratios[:, _elastic(derivatives, quantity.mode)]


def _response_gradient(derivatives: SystemDerivatives, quantity: Quantity) -> Array:
    assert isinstance(quantity, ResponseAt)
    return _magnitude_gradient(derivatives, quantity.input, quantity.output, quantity.frequency)


def _peak_gradient(derivatives: SystemDerivatives, quantity: Quantity) -> Array:
    # At a maximum the magnitude does not change with frequency: the peak moves, its height as if it did not.
    assert isinstance(quantity, PeakResponse)
    frequency, _ = quantity.locate(derivatives.system)
    return _magnitude_gradient(derivatives, quantity.input, quantity.output, frequency)


def _rms_gradient(derivatives: SystemDerivatives, quantity: Quantity) -> Array:
    """Differentiate the integral of G S G^H on the grid on which the RMS itself is integrated."""
    assert isinstance(quantity, RmsResponse)
    system, count = derivatives.system, len(derivatives.parameters)
    grid, limits = power_grid(system, quantity.disturbances, quantity.band)
    power, change = 0.0, np.zeros(count)
    for cause in quantity.disturbances:
        inputs = (cause.input,) if isinstance(cause, Tone) else cause.inputs
        responses = derivatives.responses(inputs, [quantity.output])
        if isinstance(cause, Tone):
            if not limits[0] <= cause.frequency <= limits[1]:
                continue
            hertz, weights = np.array([cause.frequency]), np.ones(1)
        else:
            hertz, weights = grid.frequencies, grid.weights
        step = max(1, int(CHUNK_BYTES / (16 * max(count, 1) * len(inputs))))
        for start in range(0, len(hertz), step):
            part = slice(start, start + step)
            spectra = (
                np.full((1, 1, 1), cause.amplitude**2 / 2, dtype=complex)
                if isinstance(cause, Tone)
                else cause.cross_spectra(hertz[part])
            )
            response, changes = responses.at(hertz[part])
            others = np.einsum("ikf,kf->if", spectra, response[0].conj()) * weights[part]
            power += float(np.einsum("if,if->", response[0], others).real)
            change += 2.0 * np.einsum("pif,if->p", changes[:, 0], others, optimize=True).real
    gradient: Array = change / (2.0 * np.sqrt(power)) if power else change
    return gradient


_GRADIENTS: Mapping[type, Callable[[SystemDerivatives, Quantity], Array]] = {
    ModeFrequency: _frequency_gradient,
    ModeDamping: _damping_gradient,
    ResponseAt: _response_gradient,
    PeakResponse: _peak_gradient,
    RmsResponse: _rms_gradient,
}


def _magnitude_gradient(derivatives: SystemDerivatives, source: Input, sensor: Output, frequency: float) -> Array:
    responses = derivatives.responses([source], [sensor])
    response, change = responses.at(np.array([frequency]))
    if not np.isfinite(response).all() or not np.isfinite(change).all():
        # At 0 Hz inertia-driven motion over its driving acceleration is a limit; it has been reached long before here.
        elastic = derivatives.system._modal[0][~derivatives.system._modal[2]]
        near = 1e-4 * float(elastic[0]) / (2 * np.pi) if len(elastic) else 1e-4
        response, change = responses.at(np.array([near]))
    H, dH = response[0, 0, 0], change[:, 0, 0, 0]
    gradient: Array = (np.conj(H) * dH).real / abs(H) if H else np.abs(dH)
    return gradient


def _elastic(derivatives: SystemDerivatives, mode: int) -> int:
    elastic = np.flatnonzero(~derivatives.basis.rigid)
    if mode > len(elastic):
        raise AnalysisError(f"mode {mode} does not exist; the model has {len(elastic)} elastic modes.")
    return int(elastic[mode - 1])


@known_keywords
def sensitivities(
    model: Model,
    quantities: Quantity | Sequence[Quantity],
    parameters: Iterable[str] | None = None,
) -> Sensitivities:
    """Return the exact first derivatives of quantities to the numbers of a model's components.

    Parameters
    ----------
    model : the model.
    quantities : as ``ibs.ModeFrequency(1)``, ``ibs.PeakResponse(...)``; one or several.
    parameters : addresses, as ``["mirror.mass", "mount.kx"]``; all that have a derivative if None.

    Returns
    -------
    Sensitivities, which prints as a table of what moves each quantity most.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : something that is no quantity.
    AnalysisError : an asked parameter that has no derivative, as a locked (inf) stiffness.

    Warns
    -----
    ModelWarning : modes of repeated frequencies whose damping ratio strain energy does not determine.

    Notes
    -----
    Frequencies: phi^T (K' - omega² M') phi / (2 omega); responses: residues, poles and rates of every mode, or the
    adjoint solution where explicit dampers couple modes; the damping matrix follows the modes and their ratios. The
    height of a peak needs no derivative of its frequency. Derivatives of repeated frequencies are the eigenvalues of
    the projected change, for an increase of the parameter. Quantities of other kinds are differentiated by central
    differences.
    """
    listed = checked_quantities(quantities)
    system = checked_model(model, "sensitivities").linearize()
    values = np.array([quantity.evaluate(system) for quantity in listed])
    derivatives = _derivatives(model, system, parameters, "sensitivities")
    rows = []
    remarks = _remarks(derivatives, listed)
    for quantity in listed:
        gradient = derivatives.gradient(quantity)
        if gradient is None:
            gradient = np.array([_difference(model, quantity, parameter) for parameter in derivatives.parameters])
            remarks.append(f"{quantity.name}: by central differences.")
        rows.append(gradient)
    return Sensitivities(
        quantities=tuple(quantity.name for quantity in listed),
        quantity_units=tuple(quantity.unit for quantity in listed),
        values=values,
        parameters=tuple(parameter.address for parameter in derivatives.parameters),
        parameter_units=tuple(parameter.unit for parameter in derivatives.parameters),
        parameter_values=np.array([parameter.value for parameter in derivatives.parameters]),
        derivatives=np.array(rows),
        steps=np.array([_step(model, parameter) for parameter in derivatives.parameters]),
        without=derivatives.without,
        remarks=tuple(remarks),
    )


@known_keywords
def response_sensitivities(
    model: Model,
    inputs: Input | Sequence[Input],
    outputs: Output | Sequence[Output],
    frequencies: Sequence[float] | Array,
    parameters: Iterable[str] | None = None,
) -> ResponseSensitivities:
    """Return frequency responses with their exact first derivatives to the numbers of a model's components.

    Parameters
    ----------
    model : the model.
    inputs, outputs : as of ``LinearSystem.frf``.
    frequencies : (n_freq,) [Hz].
    parameters : addresses; all that have a derivative if None.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : an input or output that the model does not have.
    AnalysisError : an asked parameter that has no derivative, or frequencies at which the response is infinite.
    """
    sources, sensors = checked_inputs(inputs), checked_outputs(outputs)
    hertz = checked_frequencies(frequencies)
    system = checked_model(model, "response_sensitivities").linearize()
    response = system.frf(sources, sensors, hertz)
    derivatives = _derivatives(model, system, parameters, "response_sensitivities")
    changes = derivatives.responses(sources, sensors).derivatives_at(hertz)
    return ResponseSensitivities(
        response=response,
        parameters=tuple(parameter.address for parameter in derivatives.parameters),
        parameter_units=tuple(parameter.unit for parameter in derivatives.parameters),
        parameter_values=np.array([parameter.value for parameter in derivatives.parameters]),
        derivatives=changes,
        without=derivatives.without,
    )


def _derivatives(model: Model, system: LinearSystem, parameters: Iterable[str] | None, what: str) -> SystemDerivatives:
    known = model_parameters(model.items, model.connections, model.axis)
    derivatives = SystemDerivatives(system, chosen_parameters(known, parameters, what))
    if parameters is not None and derivatives.without:
        raise AnalysisError(f"{what}: {next(iter(derivatives.without.values()))}")
    return derivatives


def checked_quantities(quantities: object) -> list[Quantity]:
    """Return quantities as a list; a single one is taken as a list of one.

    Raises
    ------
    ModelError : empty, or something that is no quantity.
    """
    listed: list[Any] = list(quantities) if isinstance(quantities, (list, tuple)) else [quantities]
    for quantity in listed:
        if not callable(getattr(quantity, "evaluate", None)) or isinstance(quantity, type):
            raise ModelError(f"quantities must be as ibs.ModeFrequency(1), got {quantity!r}.")
    if not listed:
        raise ModelError("quantities are empty; give at least one, as ibs.ModeFrequency(1).")
    return listed


def _remarks(derivatives: SystemDerivatives, quantities: Sequence[Quantity]) -> list[str]:
    if all(derivatives.gradient(quantity) is None for quantity in quantities):
        return []
    remarks = []
    frequencies = derivatives.basis.omega / (2 * np.pi)
    rigid = int(derivatives.basis.rigid.sum())
    for cluster in derivatives.modes.clusters:
        if derivatives.basis.rigid[cluster[0]]:
            continue
        numbers = " and ".join(str(mode + 1 - rigid) for mode in cluster)
        remarks.append(
            f"elastic modes {numbers} share one frequency ({frequencies[cluster[0]]:.4g} Hz): derivatives are those of "
            "an increase, in ascending order; for a decrease they change places."
        )
    for cluster in derivatives.modes.uneven:
        numbers = " and ".join(str(mode + 1 - rigid) for mode in cluster)
        words = (
            f"elastic modes {numbers} share one frequency ({frequencies[cluster[0]]:.4g} Hz), but the ratio that "
            "strain energy gives them depends on which combinations of them are taken; sensitivities of their damping "
            "hold for the modes as they are. Give what they strain the same zeta, or explicit dampers."
        )
        remarks.append(words)
        warn_user(words)
    return remarks


def _step(model: Model, parameter: Parameter) -> float:
    if parameter.kind == "place":
        return PLACE_STEP
    if parameter.kind == "inertia" and parameter.entry >= 3:
        moments = model.parameters()
        first, second = parameter.address[-2], parameter.address[-1]
        stem = parameter.address[:-2]
        return RELATIVE_STEP * float(np.sqrt(moments[stem + 2 * first] * moments[stem + 2 * second]))
    return RELATIVE_STEP * abs(parameter.value)


def _difference(model: Model, quantity: Quantity, parameter: Parameter) -> float:
    step = DIFFERENCE_PLACE if parameter.kind == "place" else DIFFERENCE_STEP * _step(model, parameter) / RELATIVE_STEP
    if step == 0.0:
        raise AnalysisError(
            f"{quantity.name}: {parameter.address} is 0 and gives no step to take differences with; name the "
            "parameters that you want."
        )
    above, below = (
        quantity.evaluate(model.with_parameters({parameter.address: parameter.value + sign * step}).linearize())
        for sign in (1, -1)
    )
    return (above - below) / (2 * step)
