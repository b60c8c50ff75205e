"""Undamped modes of a linear system, and which part of the machine makes each of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg
from scipy.linalg import lapack

from fem_import.names import ReadOnlyMapping
from ibsdyn.assembly import Assembly, body_mass_matrix
from ibsdyn.axes import Array
from ibsdyn.damping import modal_diagonal
from ibsdyn.elastic_parts import free_motions
from ibsdyn.errors import AnalysisError
from ibsdyn.reduction_trust import reduction_errors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from mpl_toolkits.mplot3d import Axes3D


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes in the order of their frequency, rigid-body modes first at 0 Hz.

    Attributes
    ----------
    frequencies : (n_modes,) undamped natural frequencies [Hz].
    damping_ratios : (n_modes,) phi^T C phi / (2 omega), rigid-body modes 0 [-].
    shapes : (n, n_modes) over ``coordinates``, unit modal mass, translations [m], rotations [rad].
    coordinates : n names.
    strain_energy : share of each connection and flexible body in the mode's strain energy, (n_modes,) each;
        zero for rigid-body modes.
    rigid : (n_modes,) which of them strain nothing.
    """

    frequencies: Array
    damping_ratios: Array
    shapes: Array
    coordinates: tuple[str, ...]
    strain_energy: Mapping[str, Array]
    rigid: np.ndarray
    _assembly: Assembly
    _full_shapes: Array

    @cached_property
    def kinetic_energy(self) -> Mapping[str, Array]:
        """Share of each body in the mode's kinetic energy, (n_modes,) each."""
        shares = {}
        for body in self._assembly.bodies:
            moved = self._full_shapes[self._assembly.places[body.name]]
            shares[body.name] = modal_diagonal(moved, body_mass_matrix(body))
            shares[body.name].setflags(write=False)
        return ReadOnlyMapping(shares)

    @cached_property
    def reduction_errors(self) -> Array:
        """By how much the reductions of flexible bodies have raised each frequency, relative, (n_modes,).

        An estimate that is sharp up to half of a body's cut-off and too low above; nan where a body does not know.
        """
        errors = reduction_errors(self._assembly, self.frequencies, self._full_shapes)
        errors.setflags(write=False)
        return errors

    def __len__(self) -> int:
        """Return the number of modes."""
        return len(self.frequencies)

    def __str__(self) -> str:
        """Return a table: frequency, damping ratio, what strains and what moves."""
        shown = min(len(self), 30)
        strain = ["rigid-body motion" if self.rigid[r] else _leading(self.strain_energy, r) for r in range(shown)]
        wide = max(len(words) for words in [*strain, "strain energy in"])
        lines = [f"mode  frequency [Hz]  zeta [%]  {'strain energy in':{wide}}  kinetic energy of"]
        for r in range(shown):
            numbers = f"{r + 1:4d}  {in_hertz(self.frequencies[r]):>14}  {100 * self.damping_ratios[r]:8.3g}"
            lines.append(f"{numbers}  {strain[r]:{wide}}  {_leading(self.kinetic_energy, r)}")
        if len(self) > shown:
            lines.append(f"      ... {len(self) - shown} more, up to {in_hertz(self.frequencies[-1])} Hz")
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)

    def to_dataframe(self) -> Any:
        """Return a pandas.DataFrame of frequencies, damping ratios and energy shares (extra ``pandas``)."""
        from ibsdyn.interchange.views import modes_to_dataframe

        return modes_to_dataframe(self)

    def plot(self, modes: int = 10, axes: Axes | None = None) -> Axes:
        """Draw the shares of strain energy of the first elastic modes as stacked bars.

        Parameters
        ----------
        modes : how many.
        axes : where to draw; a new figure if None.

        Returns
        -------
        The matplotlib Axes drawn on.
        """
        from ibsdyn.plotting.energy import plot_strain_energy

        return plot_strain_energy(self, modes, axes)

    def plot_shape(self, mode: int, axes: Axes3D | None = None, scale: float | None = None) -> Axes3D:
        """Draw one mode as a stick model, undeformed in grey.

        Parameters
        ----------
        mode : its number, from 1.
        axes : a 3-D Axes to draw on; a new figure if None.
        scale : factor on the unit-mass shape [m]; by default the largest motion is 15 % of the model's size.

        Returns
        -------
        The matplotlib 3-D Axes drawn on.

        Raises
        ------
        AnalysisError : no such mode, or a 1-D model, which has no shape in space.
        """
        from ibsdyn.plotting.mode_shape import plot_mode_shape

        if not 1 <= mode <= len(self):
            raise AnalysisError(f"mode {mode} does not exist; the model has modes 1 to {len(self)}.")
        if self._assembly.axis is not None:
            raise AnalysisError(f"a 1-D model along {self._assembly.axis} has no shape in space to draw.")
        return plot_mode_shape(self, mode, axes, scale)


def undamped_modes(M: Array, rows: Array) -> tuple[Array, Array, np.ndarray]:
    """Solve K phi = omega² M phi with unit modal masses, the base at rest.

    Parameters
    ----------
    M : (n, n) symmetric positive definite.
    rows : (m, n) of what stores the strain energy; K is rows^T rows.

    Returns
    -------
    omega (n,) [rad/s] with exact zeros for rigid-body modes, shapes (n, n), rigid (n,) of bool.

    Raises
    ------
    AnalysisError : M is not positive definite.

    Notes
    -----
    With M = L L^T the singular values of the stacked rows times L^-T are omega and the right singular vectors L^T phi.
    Their error is relative to the highest omega, that of an eigensolver of K to its square: a 30 Hz mount under a
    part that is glued with 1e13 N/m keeps ten digits instead of none. The rigid-body modes are the motions that strain
    nothing by geometry, split off before.
    """
    n = len(M)
    L, not_positive = lapack.dpotrf(M, lower=1, clean=1)
    if not_positive:
        raise AnalysisError("the mass matrix is not positive definite: some coordinate has no mass or inertia.")
    free = free_motions(rows)
    count = free.shape[1]
    weighted = lapack.dtrtrs(L, rows.T, lower=1)[0].T
    if count:
        # An orthonormal basis whose first columns are the rigid motions and whose others are the rest.
        basis = scipy.linalg.qr(L.T @ free)[0]
        weighted = weighted @ basis[:, count:]
    # The left singular vectors are of no use: a triangular factor has the same values and right vectors. Pivoting
    # orders it from stiff to soft, which keeps more digits of what is soft.
    factor, order, *_ = lapack.dgeqp3(weighted)
    _, singular, right = np.linalg.svd(np.triu(factor[: n - count]), full_matrices=True)
    motions = np.empty((n - count, n - count))
    motions[order - 1] = right[::-1].T  # LAPACK counts from 1
    if count:
        motions = np.hstack([basis[:, :count], basis[:, count:] @ motions])
    omega = np.zeros(n)
    omega[n - len(singular) :] = singular[::-1]
    shapes = lapack.dtrtrs(L, motions, lower=1, trans=1)[0]
    # The sign of an eigenvector is arbitrary; the largest coordinate is made positive so that runs agree.
    largest = np.abs(shapes).argmax(axis=0)
    shapes = shapes * np.where(shapes[largest, np.arange(n)] < 0, -1.0, 1.0)
    return omega, shapes, omega == 0


def in_hertz(frequency: float) -> str:
    """Return a frequency with four digits as people read it: 10110 rather than 1.011e+04."""
    return f"{frequency:.4g}" if frequency < 1e4 else f"{float(f'{frequency:.4g}'):.0f}"


def _leading(shares: Mapping[str, Array], mode: int) -> str:
    # Rounded before sorting: parts with equal shares keep the order in which they were added.
    ranked = sorted(((round(float(share[mode]), 6), name) for name, share in shares.items()), key=lambda s: -s[0])
    return ", ".join(f"{name} {100 * share:.0f} %" for share, name in ranked[:3] if share >= 0.005)
