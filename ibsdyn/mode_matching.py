"""Which mode of a model is which: by resemblance to measured shapes, or to the modes that it had before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError
from ibsdyn.measured import MeasuredFrequencies

if TYPE_CHECKING:
    from ibsdyn.linear_system import LinearSystem

# What resembles a shape less than this is another mode.
LEAST_MAC = 0.3


class ModeTracker:
    """Finds the modes of measured frequencies in a model whose parameters change.

    Parameters
    ----------
    measured : the frequencies, with what says which mode each is.
    system : the model before anything changed.

    Raises
    ------
    AnalysisError : fewer elastic modes than frequencies, or a measured shape that no mode resembles.
    """

    def __init__(self, measured: MeasuredFrequencies, system: LinearSystem) -> None:
        self._measured = measured
        _, shapes, rigid = system._modal
        elastic = np.flatnonzero(~rigid)
        count = len(measured.frequencies)
        wanted = max(measured.modes) if measured.modes is not None else count
        if wanted > len(elastic):
            raise AnalysisError(f"{wanted} frequencies are measured; the model has {len(elastic)} elastic modes.")
        if measured.shapes is not None:
            places = self._resembling(system)
        else:
            numbers = measured.modes if measured.modes is not None else range(1, count + 1)
            places = elastic[np.array(numbers) - 1]
        self._reference = shapes[:, places]

    def modes(self, system: LinearSystem) -> NDArray[np.intp]:
        """Return the (n_modes,) places of the measured modes among those of a system."""
        if self._measured.shapes is not None:
            return self._resembling(system)
        # Modes have unit modal mass, so these are cosines between old and new shapes.
        _, shapes, rigid = system._modal
        likeness = np.abs(self._reference.T @ system.M @ shapes) ** 2
        likeness[:, rigid] = 0.0
        _, places = scipy.optimize.linear_sum_assignment(-likeness)
        return np.asarray(places, dtype=np.intp)

    def _resembling(self, system: LinearSystem) -> NDArray[np.intp]:
        assert self._measured.shapes is not None  # the caller has seen to it
        _, shapes, rigid = system._modal
        rows = system.sensors(self._measured.sensors)[0]
        likeness = mac(self._measured.shapes, rows @ shapes)
        likeness[:, rigid] = 0.0
        own, places = scipy.optimize.linear_sum_assignment(-likeness)
        worst = int(likeness[own, places].argmin())
        if likeness[own, places][worst] < LEAST_MAC:
            raise AnalysisError(
                f"the measured shape at {self._measured.frequencies[worst]:.4g} Hz resembles no mode of the model "
                f"(MAC {likeness[own, places][worst]:.2f} at best). Check the sensors, their order and their signs."
            )
        return np.asarray(places, dtype=np.intp)


def mac(first: NDArray[np.complex128], second: Array) -> Array:
    """Return the (n, m) modal assurance criterion of (n_sensors, n) and (n_sensors, m) shapes."""
    cross = np.abs(first.conj().T @ second) ** 2
    size = np.outer(np.sum(np.abs(first) ** 2, axis=0), np.sum(second**2, axis=0))
    criterion: Array = np.divide(cross, size, out=np.zeros(cross.shape), where=size > 0)
    return criterion
