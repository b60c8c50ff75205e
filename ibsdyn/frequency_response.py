"""Frequency responses that carry their names and units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError, UnknownNameError, nearest

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from typing_extensions import Self


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Complex responses, array order [output, input, frequency], e^{+i omega t}.

    Attributes
    ----------
    frequencies : (n_freq,) [Hz].
    response : (n_out, n_in, n_freq) complex.
    outputs, inputs : names.
    output_units, input_units : units of each.
    """

    frequencies: Array
    response: NDArray[np.complex128]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    output_units: tuple[str, ...]
    input_units: tuple[str, ...]

    def __repr__(self) -> str:
        """Name the size, the band and the signals."""
        return (
            f"FrequencyResponse({len(self.outputs)} outputs x {len(self.inputs)} inputs x {len(self.frequencies)} "
            f"frequencies, {self.frequencies[0]:.4g} to {self.frequencies[-1]:.4g} Hz)"
        )

    @property
    def magnitude(self) -> Array:
        """(n_out, n_in, n_freq) absolute values in output unit per input unit."""
        return np.abs(self.response)

    @property
    def phase(self) -> Array:
        """(n_out, n_in, n_freq) phase, not unwrapped [deg]."""
        return np.degrees(np.angle(self.response))

    def unit(self, output: int, input_: int) -> str:
        """Return the unit of one response, ``-`` where output and input have the same."""
        return unit_ratio(self.output_units[output], self.input_units[input_])

    def select(
        self,
        outputs: str | int | Sequence[str | int] | None = None,
        inputs: str | int | Sequence[str | int] | None = None,
    ) -> Self:
        """Return the responses of some outputs and inputs by name or number (from 0), in the order asked.

        Raises
        ------
        UnknownNameError : a name or number that is not among them.
        AnalysisError : a name that several have.
        """
        rows = places(outputs, self.outputs, "output")
        columns = places(inputs, self.inputs, "input")
        return replace(
            self,
            response=self.response[np.ix_(rows, columns)],
            outputs=tuple(self.outputs[i] for i in rows),
            inputs=tuple(self.inputs[i] for i in columns),
            output_units=tuple(self.output_units[i] for i in rows),
            input_units=tuple(self.input_units[i] for i in columns),
        )

    def within(self, first: float, last: float) -> Self:
        """Return the responses from one frequency to another [Hz], both included.

        Raises
        ------
        AnalysisError : no line lies there.
        """
        kept = (self.frequencies >= first) & (self.frequencies <= last)
        if not kept.any():
            raise AnalysisError(
                f"no line lies from {first:g} to {last:g} Hz; there are {len(self.frequencies)} from "
                f"{self.frequencies[0]:.4g} to {self.frequencies[-1]:.4g} Hz."
            )
        return self._at(kept)

    def _at(self, kept: NDArray[np.bool_]) -> Self:
        return replace(self, frequencies=self.frequencies[kept], response=self.response[..., kept])

    def to_xarray(self) -> Any:
        """Return a complex xarray.DataArray over output, input, frequency (extra ``xarray``)."""
        from ibsdyn.interchange.views import frf_to_xarray

        return frf_to_xarray(self)

    def to_dataframe(self) -> Any:
        """Return a complex pandas.DataFrame: frequencies [Hz] down, (output, input) across (extra ``pandas``)."""
        from ibsdyn.interchange.views import frf_to_dataframe

        return frf_to_dataframe(self)

    def plot(self, axes: Sequence[Axes] | np.ndarray | None = None, label: str | None = None) -> np.ndarray:
        """Draw magnitude and phase over frequency, a pair of Axes for each output and input.

        Parameters
        ----------
        axes : what an earlier call returned, to draw over it; a new figure if None.
        label : name of this curve in the legend.

        Returns
        -------
        (2 n_out, n_in) array of matplotlib Axes: magnitude above phase.
        """
        from ibsdyn.plotting.bode import plot_bode

        return plot_bode(self, axes, label)


def unit_ratio(over: str, under: str) -> str:
    """Return the unit of an output per input, ``-`` where they are the same."""
    if over == under:
        return "-"
    numerator = f"({over})" if "/" in over or "·" in over else over
    return f"{numerator}/({under})" if "/" in under or "·" in under else f"{numerator}/{under}"


def places(names: str | int | Sequence[str | int] | None, known: tuple[str, ...], what: str) -> list[int]:
    """Return the places of names or numbers among the known ones, all of them for None.

    Raises
    ------
    UnknownNameError : a name or number that is not among them.
    AnalysisError : a name that several have.
    """
    if names is None:
        return list(range(len(known)))
    wanted = [names] if isinstance(names, (str, int)) else list(names)
    places = []
    for name in wanted:
        if isinstance(name, int) and -len(known) <= name < len(known):
            places.append(range(len(known))[name])
        elif name not in known:
            raise UnknownNameError(f"the response has no {what} {name!r}. {nearest(str(name), known)}")
        elif known.count(str(name)) > 1:
            raise AnalysisError(
                f"{known.count(str(name))} {what}s are called {name!r}; give each a name= of its own, or ask by number."
            )
        else:
            places.append(known.index(str(name)))
    return places
