"""Sensitivities as results: tables, comparisons, charts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import UnknownNameError, nearest
from ibsdyn.frequency_response import FrequencyResponse

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# What counts as an equally large step of numbers of different kinds: a hundredth of the value, a millimetre of a place.
RELATIVE_STEP = 0.01
PLACE_STEP = 1e-3


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """First derivatives of quantities to parameters.

    Attributes
    ----------
    quantities, quantity_units : n_q names and units.
    values : (n_q,) values of the quantities.
    parameters, parameter_units : n_p addresses, as ``mirror.mass``, and units.
    parameter_values : (n_p,) [SI].
    derivatives : (n_q, n_p) in the quantity's unit per unit of the parameter.
    steps : (n_p,) by how much each parameter is moved to be compared with others, see ``effects``.
    without : parameters that have no derivative, and why.
    remarks : what else is to be known, in words.
    """

    quantities: tuple[str, ...]
    quantity_units: tuple[str, ...]
    values: Array
    parameters: tuple[str, ...]
    parameter_units: tuple[str, ...]
    parameter_values: Array
    derivatives: Array
    steps: Array
    without: Mapping[str, str]
    remarks: tuple[str, ...]

    def __repr__(self) -> str:
        """Name the size and the quantities."""
        return f"Sensitivities({len(self.parameters)} parameters, of {', '.join(self.quantities)})"

    def derivative(self, quantity: str | int, parameter: str) -> float:
        """Return d quantity / d parameter in their units.

        Raises
        ------
        UnknownNameError : a quantity or a parameter that is not among them.
        """
        return float(self.derivatives[self._row(quantity), self._column(parameter)])

    def relative(self, quantity: str | int) -> dict[str, float]:
        """Return the relative change of a quantity per relative change of each parameter that is not zero.

        Raises
        ------
        UnknownNameError : a quantity that is not among them.
        """
        row = self._row(quantity)
        value = self.values[row]
        return {
            address: float(derivative * own / value)
            for address, derivative, own in zip(
                self.parameters, self.derivatives[row], self.parameter_values, strict=True
            )
            if own and value
        }

    def effects(self, quantity: str | int = 0) -> dict[str, float]:
        """Return what a step of each parameter does to a quantity, to first order, the largest first.

        The step is 1 % of the value, 1 mm of a place, for a product of inertia 1 % of the root of its two moments; it
        compares parameters with each other.

        Raises
        ------
        UnknownNameError : a quantity that is not among them.
        """
        effects = dict(zip(self.parameters, (self.derivatives[self._row(quantity)] * self.steps).tolist(), strict=True))
        return dict(sorted(effects.items(), key=lambda item: -abs(item[1])))

    def __str__(self) -> str:
        """Return for every quantity the parameters that move it most."""
        lines = []
        for row, (name, unit) in enumerate(zip(self.quantities, self.quantity_units, strict=True)):
            shown = "" if unit == "-" else f" {unit}"
            lines.append(f"{name}: {self.values[row]:.4g}{shown}; moved most by")
            for address, effect in list(self.effects(row).items())[:10]:
                if effect == 0.0:
                    break
                column = self.parameters.index(address)
                share = f" ({100 * effect / self.values[row]:+.2g} %)" if self.values[row] else ""
                lines.append(f"  {address:30} {'+' + self.step_words(column):>18}  {effect:+.3g}{shown}{share}")
        lines += [f"Remark: {remark}" for remark in self.remarks]
        if self.without:
            lines.append(f"Without a derivative: {', '.join(self.without)}")
        return "\n".join(lines)

    def plot(self, quantity: str | int = 0, parameters: int = 12, axes: Axes | None = None) -> Axes:
        """Draw a tornado chart: what a step of each parameter does to a quantity, to either side.

        Parameters
        ----------
        quantity : its name or number (from 0).
        parameters : how many, the most effective ones.
        axes : where to draw; a new figure if None.

        Returns
        -------
        The matplotlib Axes drawn on.

        Raises
        ------
        UnknownNameError : a quantity that is not among them.
        """
        from ibsdyn.plotting.sensitivity import plot_tornado

        return plot_tornado(self, self._row(quantity), parameters, axes)

    def step_words(self, column: int) -> str:
        """Return the size of a parameter's step, with its unit."""
        step, unit = self.steps[column], self.parameter_units[column]
        value = self.parameter_values[column]
        if unit == "m":
            return f"{1e3 * step:g} mm"
        if np.isclose(step, RELATIVE_STEP * abs(value)):
            return f"{100 * RELATIVE_STEP:g} %"
        return f"{step:.2g} {unit}"

    def _row(self, quantity: str | int) -> int:
        if isinstance(quantity, int) and -len(self.quantities) <= quantity < len(self.quantities):
            return range(len(self.quantities))[quantity]
        if quantity not in self.quantities:
            raise UnknownNameError(f"no quantity {quantity!r} here. {nearest(str(quantity), self.quantities)}")
        return self.quantities.index(str(quantity))

    def _column(self, parameter: str) -> int:
        if parameter not in self.parameters:
            reason = self.without.get(parameter)
            raise UnknownNameError(
                reason
                if reason is not None
                else f"no parameter {parameter!r} here. {nearest(parameter, self.parameters)}"
            )
        return self.parameters.index(parameter)


@dataclass(frozen=True, eq=False)
class ResponseSensitivities:
    """Frequency responses and their first derivatives to parameters.

    Attributes
    ----------
    response : the FrequencyResponse itself.
    parameters, parameter_units : n_p addresses and units.
    parameter_values : (n_p,) [SI].
    derivatives : (n_p, n_out, n_in, n_freq) complex, in the response's unit per unit of the parameter.
    without : parameters that have no derivative, and why.
    """

    response: FrequencyResponse
    parameters: tuple[str, ...]
    parameter_units: tuple[str, ...]
    parameter_values: Array
    derivatives: NDArray[np.complex128]
    without: Mapping[str, str]

    def derivative(self, parameter: str) -> NDArray[np.complex128]:
        """Return the (n_out, n_in, n_freq) derivative to one parameter; UnknownNameError if it is not among them."""
        if parameter not in self.parameters:
            reason = self.without.get(parameter)
            raise UnknownNameError(
                reason
                if reason is not None
                else f"no parameter {parameter!r} here. {nearest(parameter, self.parameters)}"
            )
        own: NDArray[np.complex128] = self.derivatives[self.parameters.index(parameter)]
        return own
