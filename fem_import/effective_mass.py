"""How much of a part's mass its modes move, and what lies above the cut-off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ReductionError, UnknownKeywordError
from fem_import.keywords import known_keywords
from fem_import.reduced_body import FRAME_DIRECTIONS, ReducedBody
from fem_import.rigid_motion import rigid_motion_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EffectiveMasses:
    """Modal effective masses of a body whose interfaces move together as one rigid frame.

    Attributes
    ----------
    frequencies : (k,) of the interior modes [Hz].
    masses : (k, 6) effective mass along x, y, z [kg] and inertia about axes through the CoG [kg m²] of each mode.
    total : (6,) mass and inertia of the body.
    max_frequency : the cut-off [Hz].
    static_residual : (6,) share of the static deflection energy under unit accelerations that no interior mode of the
        body carries; nan where the body does not know, 0 with inertia vectors.

    Notes
    -----
    M_eff = (phi^T M R)^2 for unit modal mass, R the rigid motion of all interfaces and what they carry. What the modes
    below the cut-off lack of the total follows the interfaces rigidly in truth or belongs to modes above.
    """

    frequencies: FloatArray
    masses: FloatArray
    total: FloatArray
    max_frequency: float
    static_residual: FloatArray

    @property
    def above_cutoff(self) -> FloatArray:
        """(6,) share of the total that is in no mode below the cut-off: on the interfaces, or above it."""
        below = self.masses[self.frequencies <= self.max_frequency].sum(axis=0)
        return np.asarray(1.0 - below / self.total)

    def __str__(self) -> str:
        """Return the table of shares in percent."""
        head = "".join(f"{direction:>9}" for direction in FRAME_DIRECTIONS)
        lines = [f"{'mode':>6}{'[Hz]':>12}{head}   share of mass and inertia [%]"]
        for number, (frequency, masses) in enumerate(zip(self.frequencies, self.masses, strict=True), start=1):
            if frequency <= self.max_frequency:
                shares = "".join(f"{100 * share:>9.3f}" for share in masses / self.total)
                lines.append(f"{number:>6}{frequency:>12.5g}{shares}")
        for name, shares_of in (("above cut-off", self.above_cutoff), ("static residual", self.static_residual)):
            lines.append(f"{name:>18}" + "".join(f"{100 * share:>9.3f}" for share in shares_of))
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the mass collected by the modes over frequency, a step line for each direction; return the axes."""
        from matplotlib import pyplot  # here: drawing is optional and slow to import

        if axes is None:
            axes = pyplot.figure(figsize=(8, 4.5), layout="constrained").add_subplot()
        edges = np.concatenate([[0.0], self.frequencies, [1.05 * max(self.max_frequency, *self.frequencies, 0.0)]])
        shares = 100.0 * np.cumsum(self.masses / self.total, axis=0)
        for index, direction in enumerate(FRAME_DIRECTIONS):
            steps = np.concatenate([[0.0], shares[:, index], shares[-1:, index] if len(shares) else [0.0]])
            axes.step(edges, steps, where="post", label=direction, linestyle="-" if index < 3 else "--")
        axes.axvline(self.max_frequency, color="0.4", linestyle=":", label="cut-off")
        axes.set(
            xlabel="frequency [Hz]",
            ylabel="effective mass up to here [% of the total]",
            xlim=(0.0, edges[-1]),
            ylim=(0.0, None),
        )
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small")
        axes.grid(alpha=0.3)
        return axes


@known_keywords(UnknownKeywordError)
def effective_masses(body: ReducedBody) -> EffectiveMasses:
    """Return the modal effective masses of a body.

    Parameters
    ----------
    body : of ``fi.reduce`` with method "craig-bampton", or of another program with modes.

    Raises
    ------
    ReductionError : no body, or one without interior modes.
    """
    if not isinstance(body, ReducedBody):
        raise ReductionError(f"effective_masses takes a fi.ReducedBody (of fi.reduce); got {type(body).__name__}.")
    if not len(body.frequencies):
        raise ReductionError(f"{body!r} has no interior modes, so its whole mass follows the interfaces statically.")
    about_centre = rigid_motion_at(np.zeros(3), body.centre_of_mass)
    n_frames = 6 * len(body.interfaces)
    motion = body.rigid_body_motion @ about_centre
    factors = body.M[n_frames:] @ motion
    modal_mass = np.diag(body.M)[n_frames:]
    eigenvalues = (2.0 * np.pi * body.frequencies) ** 2
    residual = np.full(6, np.nan)
    if body.dynamic_compliance is not None:
        whole = np.einsum("ij,ik,kj->j", motion, body.dynamic_compliance, motion)
        carried = np.sum(factors**2 / (modal_mass * eigenvalues)[:, None], axis=0)
        lacking = np.maximum(whole - carried, 0.0)
        residual = np.divide(lacking, whole, out=np.zeros(6), where=whole > 0.0)
    total = np.concatenate([np.full(3, body.mass), np.diag(body.inertia)])
    return EffectiveMasses(
        frequencies=body.frequencies,
        masses=factors**2 / modal_mass[:, None],
        total=total,
        max_frequency=body.max_frequency,
        static_residual=residual,
    )
