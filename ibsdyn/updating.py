"""Model updating: parameters that let a model agree with measurements, and how well those determine them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.optimize
import scipy.stats

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError, ModelError, UnknownNameError, known_keywords, nearest, warn_user
from ibsdyn.few_averages import equivalent_chi_squared, scatter_of_residuals
from ibsdyn.linear_system import LinearSystem
from ibsdyn.measured import Measured, MeasuredFrequencies, MeasuredResponse, checked_measured
from ibsdyn.mode_matching import ModeTracker
from ibsdyn.parameters import Parameter, checked_model, chosen_parameters, model_parameters
from ibsdyn.sensitivity import SystemDerivatives
from ibsdyn.validation import in_words, numbers_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.model import Model

# What a number of each kind is measured by in the fit: its own size, a place by a millimetre.
PLACE_SCALE = 1e-3
# Masses, stiffnesses and ratios stay above this share of their first value unless bounds say otherwise.
LEAST_SHARE = 1e-4
# Along a direction in which all scaled parameters may move by this much and still fit, data say nothing.
UNDETERMINED = 1.0
# Parts of a direction below this share of it are not named.
NAMED = 0.2
# The solver comes this near to a bound, in scaled parameters, without touching it.
AT_BOUND = 1e-6
# A misfit that is less probable than this is not the measurement's scatter.
IMPROBABLE = 1e-3


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to measurements.

    Attributes
    ----------
    model : the fitted model.
    parameters, units : p addresses and units.
    initial, values : (p,) before and after [SI].
    covariance : (p, p) of the values, from the uncertainties of what was measured.
    chi_squared : sum of the squares of weighted residuals.
    equivalent_chi_squared : the one that would be as improbable with exact uncertainties: smaller where responses know
        theirs from few averages only, which scatter more.
    degrees_of_freedom : data less parameters.
    residuals : weighted: differences over standard uncertainties, those of frequencies before ratios, real parts of
        responses before imaginary ones.
    undetermined : directions in which the data leave parameters open, in words.
    evaluations : of the model.
    """

    model: Model
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    initial: Array
    values: Array
    covariance: Array
    chi_squared: float
    equivalent_chi_squared: float
    degrees_of_freedom: int
    residuals: Array
    undetermined: tuple[str, ...]
    evaluations: int

    def __repr__(self) -> str:
        """Name the model and the parameters."""
        return f"Fit({self.model.name!r}, {', '.join(self.parameters)})"

    @property
    def uncertainties(self) -> Array:
        """(p,) standard uncertainties of the values; inf where data tell none."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array:
        """(p, p) correlation of the values; nan where data say nothing."""
        size = self.uncertainties
        finite = np.isfinite(np.outer(size, size))
        nothing = np.full(finite.shape, np.nan)
        correlation: Array = np.divide(self.covariance, np.outer(size, size), out=nothing, where=finite)
        return correlation

    def value(self, parameter: str) -> tuple[float, float]:
        """Return a parameter's fitted value and its standard uncertainty; UnknownNameError if it was not fitted."""
        if parameter not in self.parameters:
            raise UnknownNameError(f"the fit has no parameter {parameter!r}. {nearest(parameter, self.parameters)}")
        place = self.parameters.index(parameter)
        return float(self.values[place]), float(self.uncertainties[place])

    @property
    def probability(self) -> float:
        """How probable a misfit of this size or a larger one is, if the model is right; nan without spare data."""
        if self.degrees_of_freedom <= 0:
            return float("nan")
        return float(scipy.stats.chi2.sf(self.equivalent_chi_squared, self.degrees_of_freedom))

    def __str__(self) -> str:
        """Return a table: before, after, uncertainty; how well the model fits."""
        lines = [f"{self.model.name}: {len(self.residuals)} data, {len(self.parameters)} parameters"]
        rows = zip(self.parameters, self.units, self.initial, self.values, self.uncertainties, strict=True)
        for address, unit, before, after, spread in rows:
            shown = "" if unit == "-" else f" {unit}"
            lines.append(f"  {address:30} {before:11.5g} -> {after:11.6g} ± {spread:.2g}{shown}")
        if self.degrees_of_freedom > 0:
            estimated = not np.isclose(self.equivalent_chi_squared, self.chi_squared)
            lines.append(
                f"  chi² / degrees of freedom = {self.chi_squared:.4g} / {self.degrees_of_freedom} = "
                f"{self.chi_squared / self.degrees_of_freedom:.3g} (probability {self.probability:.2g}"
                f"{', with uncertainties from few averages' if estimated else ''})"
            )
        else:
            lines.append("  as many data as parameters: none is left to tell whether the model can be right")
        lines += [f"  Undetermined: {words}" for words in self.undetermined]
        return "\n".join(lines)

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw by how much each parameter moved, with two standard uncertainties to either side.

        Parameters
        ----------
        axes : where to draw; a new figure if None.

        Returns
        -------
        The matplotlib Axes drawn on.
        """
        from ibsdyn.plotting.updating import plot_fit

        return plot_fit(self, axes)


@known_keywords
def fit(
    model: Model,
    parameters: Sequence[str],
    measured: Measured | Sequence[Measured],
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> Fit:
    """Fit parameters of a model to measured frequencies, ratios and responses.

    Parameters
    ----------
    model : the first guess; it is not changed.
    parameters : addresses of what is to be found, as ``["mount.kx", "mount.zeta"]``.
    measured : ``ibs.MeasuredFrequencies`` and ``ibs.MeasuredResponse``, one or several.
    bounds : {address: (lower, upper)}; masses, moments of inertia, stiffnesses, dampers and ratios stay positive
        anyway.

    Returns
    -------
    Fit, with the fitted model, covariance and what the data leave open.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : nothing measured, bounds that leave the first guess out, a parameter that is 0 or inf.
    AnalysisError : fewer data than parameters, a parameter without derivative, a fit that does not converge.

    Warns
    -----
    ModelWarning : data that do not determine a parameter or a combination of them; a misfit that scatter does not
        explain; a value at its bound; responses from too few averages to tell an uncertainty.

    Notes
    -----
    Least squares of residuals over standard uncertainties (``scipy.optimize.least_squares``) with the exact
    sensitivities as Jacobian J and every parameter scaled by its first value; real and imaginary parts of a response
    have half of its variance each. Covariance (J^T J)^-1: valid if the uncertainties are and the model can be right.
    Where responses know their variance from nu complex degrees of freedom, their share of it is nu / (nu - 2) times as
    large, and the misfit is judged by the F-distribution (Schoukens, Pintelon et al., Automatica 33 (1997) 1073-1086).
    Modes are followed by their shapes as parameters change.
    """
    listed = checked_measured(measured)
    checked_model(model, "fit")
    known = model_parameters(model.items, model.connections, model.axis)
    chosen = chosen_parameters(known, parameters, "fit")
    scale = np.array([_scale(parameter) for parameter in chosen])
    initial = np.array([parameter.value for parameter in chosen])
    limits = _bounds(chosen, bounds or {})
    problem = _Problem(model, chosen, listed, initial, scale)
    start = problem.residuals(np.zeros(len(chosen)))
    if len(start) < len(chosen):
        raise AnalysisError(
            f"{len(start)} data cannot determine {len(chosen)} parameters; measure more, or fit fewer of them."
        )
    found = scipy.optimize.least_squares(
        problem.residuals_or_nan,
        np.zeros(len(chosen)),
        jac=problem.jacobian,
        bounds=((limits[0] - initial) / scale, (limits[1] - initial) / scale),
        method="trf",
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
        max_nfev=200,
    )
    if not found.success:
        raise AnalysisError(
            f"the fit has not converged after {found.nfev} evaluations of the model; begin nearer to the solution, or "
            "fit fewer parameters."
        )
    scatter = scatter_of_residuals(listed)
    covariance, undetermined = _covariance(problem.jacobian(found.x), scatter, chosen)
    values = initial + scale * found.x
    result = Fit(
        model=problem.model_at(found.x),
        parameters=tuple(parameter.address for parameter in chosen),
        units=tuple(parameter.unit for parameter in chosen),
        initial=initial,
        values=values,
        covariance=covariance * np.outer(scale, scale),
        chi_squared=float(found.fun @ found.fun),
        equivalent_chi_squared=equivalent_chi_squared(found.fun, listed),
        degrees_of_freedom=len(found.fun) - len(chosen),
        residuals=found.fun,
        undetermined=undetermined,
        evaluations=int(found.nfev),
    )
    at_bounds = np.minimum(values - limits[0], limits[1] - values) < AT_BOUND * scale
    _warn(result, [chosen[int(i)].address for i in np.flatnonzero(at_bounds)], scatter)
    return result


class _Problem:
    """Weighted residuals and their Jacobian over scaled parameters."""

    def __init__(
        self, model: Model, parameters: Sequence[Parameter], measured: Sequence[Measured], initial: Array, scale: Array
    ) -> None:
        self._model = model
        self._parameters = parameters
        self._measured = measured
        self._initial, self._scale = initial, scale
        system = model.linearize()
        self._trackers = {
            place: ModeTracker(each, system)
            for place, each in enumerate(measured)
            if isinstance(each, MeasuredFrequencies)
        }

    def model_at(self, x: Array) -> Model:
        """Return the model with its parameters at scaled steps ``x`` from the first guess."""
        values = (self._initial + self._scale * x).tolist()
        addresses = [parameter.address for parameter in self._parameters]
        return self._model.with_parameters(dict(zip(addresses, values, strict=True)))

    def residuals(self, x: Array) -> Array:
        """Return differences between model and measurement over standard uncertainties."""
        system = self.model_at(x).linearize()
        rows = []
        for place, measured in enumerate(self._measured):
            if isinstance(measured, MeasuredFrequencies):
                rows += _mode_residuals(measured, system, self._trackers[place].modes(system))
            else:
                lines = measured.lines
                hertz = measured.response.frequencies[lines]
                model = system.frf(measured.inputs, measured.outputs, hertz).response
                rows += _parts(model - measured.response.response[:, :, lines], measured)
        return np.concatenate(rows)

    def residuals_or_nan(self, x: Array) -> Array:
        """Return residuals, nan where no such model exists: the solver then takes a shorter step."""
        try:
            return self.residuals(x)
        except (ModelError, AnalysisError):
            return np.full(len(self.residuals(np.zeros(len(x)))), np.nan)

    def jacobian(self, x: Array) -> Array:
        """Return the (n_data, p) derivatives of the residuals, exact."""
        model = self.model_at(x)
        system = model.linearize()
        known = model_parameters(model.items, model.connections, model.axis)
        derivatives = SystemDerivatives(system, [known[parameter.address] for parameter in self._parameters])
        if derivatives.without:
            raise AnalysisError(f"fit: {next(iter(derivatives.without.values()))}")
        columns = []
        for place, measured in enumerate(self._measured):
            if isinstance(measured, MeasuredFrequencies):
                modes = self._trackers[place].modes(system)
                columns.append(derivatives.frequencies()[:, modes] / measured.sigma)
                if measured.damping_sigma is not None:
                    columns.append(derivatives.modes.ratios[:, modes] / measured.damping_sigma)
            else:
                responses = derivatives.responses(measured.inputs, measured.outputs)
                changes = responses.derivatives_at(measured.response.frequencies[measured.lines])
                parts = [_parts(change, measured) for change in changes]
                columns.append(np.array([np.concatenate(part) for part in parts]))
        jacobian: Array = np.concatenate(columns, axis=1).T * self._scale
        return jacobian


def _mode_residuals(measured: MeasuredFrequencies, system: LinearSystem, modes: np.ndarray) -> list[Array]:
    omega, shapes, _ = system._modal
    rows = [(omega[modes] / (2 * np.pi) - measured.frequencies) / measured.sigma]
    if measured.damping_ratios is not None and measured.damping_sigma is not None:
        own = shapes[:, modes]
        ratios = np.einsum("ir,ij,jr->r", own, system.C, own, optimize=True) / (2 * omega[modes])
        rows.append((ratios - measured.damping_ratios) / measured.damping_sigma)
    return rows


def _parts(difference: np.ndarray, measured: MeasuredResponse) -> list[Array]:
    weighted = (difference / (measured.sigma[:, :, measured.lines] / np.sqrt(2))).ravel()
    return [weighted.real, weighted.imag]


def _scale(parameter: Parameter) -> float:
    if parameter.kind == "place":
        return PLACE_SCALE
    if parameter.value == 0.0 or not np.isfinite(parameter.value):
        raise ModelError(
            f"fit: {parameter.address} is {parameter.value:g}; give the model a first guess of its order of magnitude."
        )
    return abs(parameter.value)


def _bounds(parameters: Sequence[Parameter], given: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    addresses = [parameter.address for parameter in parameters]
    if not isinstance(given, Mapping):
        raise ModelError(f"fit: bounds must be a dict {{address: (lower, upper)}}, got {given!r}.")
    for address in given:
        if address not in addresses:
            raise UnknownNameError(
                f"fit: bounds of {address!r}, which is not fitted. {nearest(str(address), addresses)}"
            )
    lower, upper = [], []
    for parameter in parameters:
        signed = parameter.kind == "place" or (parameter.kind == "inertia" and parameter.entry >= 3)
        own = given.get(parameter.address, (-np.inf if signed else LEAST_SHARE * parameter.value, np.inf))
        low, high = numbers_of(own, 2, f"fit: bounds of {parameter.address}", f"lower, upper [{parameter.unit}]")
        if not low < parameter.value < high:
            raise ModelError(
                f"fit: {parameter.address} begins at {parameter.value:g}, which its bounds {(low, high)} leave out."
            )
        lower.append(float(low))
        upper.append(float(high))
    return np.array(lower), np.array(upper)


def _covariance(jacobian: Array, scatter: Array, parameters: Sequence[Parameter]) -> tuple[Array, tuple[str, ...]]:
    """Return the covariance of the scaled parameters, and in words the directions that the data leave open.

    ``scatter`` are the (n_data,) variances of the weighted residuals, 1 of those whose uncertainties are known exactly.
    """
    left, singular, right = np.linalg.svd(jacobian, full_matrices=False)
    rounding = np.finfo(float).eps * max(jacobian.shape) * singular.max(initial=0.0)
    known = singular > rounding
    to_parameters = (right[known].T / singular[known]) @ left[:, known].T
    covariance: Array = np.full((len(parameters),) * 2, np.inf)
    if np.isfinite(scatter).all():
        covariance = (to_parameters * scatter) @ to_parameters.T
    words = []
    for value, direction in zip(singular, right, strict=True):
        if value > 1.0 / UNDETERMINED:
            continue
        largest = np.abs(direction).max()
        named = np.flatnonzero(np.abs(direction) > NAMED * largest)
        if value <= rounding:
            touched = np.abs(direction) > np.sqrt(np.finfo(float).eps)
            covariance[touched, :] = covariance[:, touched] = np.inf
        names = [parameters[int(i)].address for i in named]
        if len(named) == 1:
            words.append(f"the data do not determine {names[0]}.")
            continue
        same = np.sign(direction[named]) == np.sign(direction[named[0]])
        together = in_words([name for name, along in zip(names, same, strict=True) if along])
        against = [name for name, along in zip(names, same, strict=True) if not along]
        how = f"{together} together" if not against else f"{together} one way and {in_words(against)} the other"
        words.append(f"the data do not notice when {how} change; fix one of them, or measure what tells them apart.")
    return covariance, tuple(words)


def _warn(result: Fit, at_bounds: Sequence[str], scatter: Array) -> None:
    for words in result.undetermined:
        warn_user(f"fit of {result.model.name!r}: {words}")
    if at_bounds:
        warn_user(
            f"fit of {result.model.name!r}: {in_words(list(at_bounds))} ended at a bound; the model may be another "
            "than the machine, and uncertainties do not hold there."
        )
    if not np.isfinite(scatter).all():
        warn_user(
            f"fit of {result.model.name!r}: responses know their variance from two degrees of freedom or fewer "
            "(averages or periods, less inputs), which tells no uncertainty of the parameters; measure on, or give "
            "sigma=."
        )
    if result.degrees_of_freedom > 0 and result.probability < IMPROBABLE:
        ratio = result.equivalent_chi_squared / result.degrees_of_freedom
        warn_user(
            f"fit of {result.model.name!r}: the misfit is {ratio:.3g} times what the uncertainties of the measurement "
            "explain (chi² per degree of freedom); the model cannot be right, or sigma is too small. The parameters' "
            "uncertainties are too small then."
        )
