"""Rigid against averaged interfaces: the two ends between which the truth lies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import InterfaceError, ReductionError, UnknownKeywordError
from fem_import.fe_model import FEModel
from fem_import.flexible_modes import flexible_modes
from fem_import.interfaces import Interface, Nodes
from fem_import.keywords import known_keywords
from fem_import.reduced_body import FRAME_DIRECTIONS, ReducedBody
from fem_import.reduction import reduce

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TieComparison:
    """The same part with all its interfaces rigid and with all of them averaged.

    Attributes
    ----------
    rigid, average : the two bodies.
    rigid_frequencies, average_frequencies : (k,) of the flexible modes by themselves, below the trusted frequency of
        both [Hz].
    rigid_stiffness, average_stiffness : {interface: (6,)} force over displacement and torque over rotation of each
        interface, the first one held and the others free (all but this one free, where the part is held itself)
        [N/m, N m/rad].
    """

    rigid: ReducedBody
    average: ReducedBody
    rigid_frequencies: FloatArray
    average_frequencies: FloatArray
    rigid_stiffness: dict[str, FloatArray]
    average_stiffness: dict[str, FloatArray]

    @property
    def frequency_spread(self) -> FloatArray:
        """(k,) how much higher the rigid tie puts each frequency, relative to the averaged one."""
        return np.asarray(self.rigid_frequencies / self.average_frequencies - 1.0)

    @property
    def stiffness_spread(self) -> dict[str, FloatArray]:
        """{interface: (6,)} how much stiffer the rigid tie makes each direction, relative to the averaged one."""
        return {name: self.rigid_stiffness[name] / soft - 1.0 for name, soft in self.average_stiffness.items()}

    def __str__(self) -> str:
        """Return frequencies and stiffnesses side by side with their spread."""
        lines = [f"{'mode':>4} {'average [Hz]':>13} {'rigid [Hz]':>13} {'spread':>9}"]
        for number, spread in enumerate(self.frequency_spread):
            soft, stiff = self.average_frequencies[number], self.rigid_frequencies[number]
            lines.append(f"{number + 1:>4} {soft:>13.6g} {stiff:>13.6g} {100 * spread:>7.2f} %")
        for name, spreads in self.stiffness_spread.items():
            lines.append(f"stiffness at {name} [N/m, N m/rad]")
            for index, direction in enumerate(FRAME_DIRECTIONS):
                soft, stiff = self.average_stiffness[name][index], self.rigid_stiffness[name][index]
                lines.append(f"{direction:>4} {soft:>13.6g} {stiff:>13.6g} {100 * spreads[index]:>7.2f} %")
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the spread of each frequency and of each interface's six stiffnesses; return the axes."""
        from matplotlib import pyplot  # here: drawing is optional and slow to import

        if axes is None:
            axes = pyplot.figure(figsize=(8, 4.5), layout="constrained").add_subplot()
        modes = [f"{frequency:.4g} Hz" for frequency in self.average_frequencies]
        axes.bar(modes, 100.0 * self.frequency_spread, width=0.6, label="frequency of the part by itself")
        for name, spread in self.stiffness_spread.items():
            labels = [f"{name}.{direction}" for direction in FRAME_DIRECTIONS]
            axes.bar(labels, 100.0 * spread, width=0.6, label=f"stiffness at {name}")
        axes.tick_params(axis="x", rotation=60)
        axes.set_ylabel("rigid interfaces raise it by [%]")
        axes.grid(axis="y", alpha=0.3)
        axes.legend(fontsize="small")
        return axes


@known_keywords(UnknownKeywordError)
def compare_ties(part: FEModel, interfaces: Mapping[str, Interface | Nodes], max_frequency: float) -> TieComparison:
    """Reduce a part with rigid and with averaged interfaces and show the spread between the two.

    A bolted flange lies near the rigid one, a load that enters through a compliant face near the averaged one. A
    spread that matters says that the interface needs a better model, or more of the neighbour in the mesh.

    Parameters
    ----------
    part, interfaces, max_frequency : as for ``fi.reduce``; each interface's own tie is overruled, weights hold for the
        averaged one.

    Raises
    ------
    InterfaceError, ReductionError, UnknownNameError : as ``fi.reduce``, and where no flexible mode can be compared.
    """
    if not isinstance(interfaces, Mapping):
        raise InterfaceError(f"interfaces must be a mapping {{name: nodes}} with at least one; got {interfaces!r}.")
    listed = {name: given if isinstance(given, Interface) else Interface(given) for name, given in interfaces.items()}
    averaged = {name: replace(item, tie="average") for name, item in listed.items()}
    average = reduce(part, averaged, max_frequency)
    # The frames stand where the averaged ones do, so that both stiffnesses are about one point.
    rigid = reduce(
        part,
        {
            name: replace(item, tie="rigid", weights=None, position=average.interfaces[name].position)
            for name, item in listed.items()
        },
        max_frequency,
    )
    stiff, soft = flexible_modes(rigid)[0], flexible_modes(average)[0]
    count = min(int(np.count_nonzero(found <= rigid.trusted_frequency)) for found in (stiff, soft))
    if count == 0:
        raise ReductionError(
            f"{part.source} has no flexible mode below {rigid.trusted_frequency:.4g} Hz to compare (the first: "
            f"{soft[0]:.4g} Hz averaged, {stiff[0]:.4g} Hz rigid). Raise max_frequency."
        )
    return TieComparison(rigid, average, stiff[:count], soft[:count], _stiffness(rigid), _stiffness(average))


def _stiffness(body: ReducedBody) -> dict[str, FloatArray]:
    n_frames, held = 6 * len(body.interfaces), 6 if body.is_free else 0
    compliance = np.diag(np.linalg.inv(body.K[held:n_frames, held:n_frames]))
    names = list(body.interfaces)[held // 6 :]
    return {name: 1.0 / compliance[6 * index : 6 * index + 6] for index, name in enumerate(names)}
