"""From a deflection that is allowed to the stiffness and the frequency that are needed, and who gets which share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from fem_import.names import ReadOnlyMapping
from ibsdyn.errors import ModelError, UnknownNameError, known_keywords, nearest
from ibsdyn.validation import number

# Shares typed with a few digits may add up to a little more than 1.
SHARE_TOLERANCE = 1e-6


@known_keywords
def mirror_deflection(
    beam_angle: float | None = None, beam_displacement: float | None = None, distance: float | None = None
) -> float:
    """Return how far a mirror may turn for what its reflected beam is allowed [rad].

    Parameters
    ----------
    beam_angle : of the reflected beam, in the plane of incidence [rad].
    beam_displacement : of the spot [m] at ``distance``, in place of the angle.
    distance : from the mirror to where the spot is [m].

    Raises
    ------
    ModelError : not exactly one of angle and displacement, a displacement without distance, a value not above 0.

    Notes
    -----
    The beam turns twice as far as the mirror. Other planes and several mirrors: ``BeamPath``.
    """
    what = "mirror_deflection"
    if (beam_angle is None) == (beam_displacement is None):
        raise ModelError(f"{what}: give either beam_angle= or beam_displacement= with distance=.")
    if beam_angle is not None:
        if distance is not None:
            raise ModelError(f"{what}: beam_angle needs no distance; leave it out, or give beam_displacement.")
        return number(beam_angle, f"{what}: beam_angle", "rad", above=0.0) / 2
    if distance is None:
        raise ModelError(f"{what}: beam_displacement needs distance=, from the mirror to the spot [m].")
    shift = number(beam_displacement, f"{what}: beam_displacement", "m", above=0.0)
    return shift / number(distance, f"{what}: distance", "m", above=0.0) / 2


@known_keywords
def required_stiffness(
    inertia: float,
    acceleration: float,
    deflection: float | None = None,
    beam_deflection: float | None = None,
) -> float:
    """Return the least stiffness that keeps a quasi-static deflection within its limit.

    Parameters
    ----------
    inertia : of what is carried, about the axis [kg m²]; a mass [kg] gives a translational stiffness.
    acceleration : [rad/s²] (or [m/s²]).
    deflection : allowed for the mirror [rad] (or [m]).
    beam_deflection : allowed for the reflected beam [rad]; it turns twice as far as the mirror, deflection =
        beam_deflection / 2.

    Returns
    -------
    k = inertia acceleration / deflection [N·m/rad] (or [N/m]).

    Raises
    ------
    ModelError : not exactly one of the two deflections, or a value that is not positive.

    Notes
    -----
    Torque balance k delta = I phidd. The formula holds well below the resonance at sqrt(k/I); the form
    I sqrt(phidd/delta) that is found in print has the unit kg m²/s and is not a stiffness.
    """
    what = "required_stiffness"
    carried = number(inertia, f"{what}: inertia", "kg m²", above=0.0)
    return carried * _acceleration_per_deflection(acceleration, deflection, beam_deflection, what)


@known_keywords
def required_frequency(
    acceleration: float, deflection: float | None = None, beam_deflection: float | None = None
) -> float:
    """Return the least natural frequency that keeps a quasi-static deflection within its limit [Hz].

    Parameters
    ----------
    acceleration : of the base [rad/s²] or [m/s²].
    deflection : allowed for the mirror [rad] or [m].
    beam_deflection : allowed for the reflected beam [rad], twice the mirror's.

    Returns
    -------
    f = sqrt(acceleration / deflection) / (2 pi) [Hz], whatever the inertia.

    Raises
    ------
    ModelError : not exactly one of the two deflections, or a value that is not positive.

    Notes
    -----
    omega² = k / I with the k of ``required_stiffness``. The frequency, not the stiffness, goes with the square root.
    """
    ratio = _acceleration_per_deflection(acceleration, deflection, beam_deflection, "required_frequency")
    return math.sqrt(ratio) / (2 * math.pi)


@dataclass(frozen=True, eq=False)
class StiffnessShares:
    """Stiffnesses of a chain of sub-modules that together keep a deflection.

    Attributes
    ----------
    inertias : {sub-module: inertia} from the base outwards [kg m²] or [kg].
    shares : {sub-module: share of the deflection} that the connection below each takes.
    stiffness : {sub-module: stiffness} of the connection below each [N·m/rad] or [N/m].
    deflection : of the last sub-module relative to the base [rad] or [m].
    frequency : lowest natural frequency of the chain [Hz].
    """

    inertias: Mapping[str, float]
    shares: Mapping[str, float]
    stiffness: Mapping[str, float]
    deflection: float
    frequency: float

    def __str__(self) -> str:
        """Return a table: inertia, share and stiffness of each sub-module."""
        wide = max(len(name) for name in [*self.inertias, "sub-module"])
        lines = [f"{'sub-module':{wide}}  inertia  share [%]  stiffness below"]
        for name, inertia in self.inertias.items():
            lines.append(f"{name:{wide}}  {inertia:7.3g}  {100 * self.shares[name]:9.3g}  {self.stiffness[name]:15.4g}")
        lines.append(f"deflection {self.deflection:.4g}, lowest frequency {self.frequency:.4g} Hz")
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)


@known_keywords
def distribute_stiffness(
    inertias: Mapping[str, float],
    acceleration: float,
    deflection: float | None = None,
    beam_deflection: float | None = None,
    shares: Mapping[str, float] | None = None,
) -> StiffnessShares:
    """Divide an allowed deflection among the sub-modules of a chain and return the stiffness each one needs.

    Parameters
    ----------
    inertias : {sub-module: inertia} in the order in which they carry each other, the base's neighbour first and the
        mirror last; [kg m²], or [kg] for a translation.
    acceleration : of the base [rad/s²] or [m/s²].
    deflection : allowed for the last sub-module relative to the base [rad] or [m].
    beam_deflection : allowed for the beam that it reflects [rad], twice as much.
    shares : {sub-module: share of the deflection}, 1 in all; equal if None. What is left below 1 stays as reserve.

    Raises
    ------
    ModelError : values that are not above 0, shares that are more than 1 in all or miss a sub-module.

    Notes
    -----
    The connection below sub-module i carries all inertia outside of it: k_i = sum_{j >= i} I_j phidd / (share_i delta).
    One that carries more is stiffer for the same share. The compliances 1/k_i, weighted with what they carry, add up to
    that of the whole.
    """
    what = "distribute_stiffness"
    if not isinstance(inertias, Mapping) or not inertias:
        raise ModelError(f"{what}: inertias must be a dict {{sub-module: inertia}}, got {inertias!r}.")
    carried = {
        name: number(inertia, f"{what}: inertia of {name!r}", "kg m²", above=0.0) for name, inertia in inertias.items()
    }
    for name in carried:
        if not isinstance(name, str):
            raise ModelError(f"{what}: a sub-module is called by a text, got {name!r}.")
    allowed_ratio = _acceleration_per_deflection(acceleration, deflection, beam_deflection, what)
    parts = _checked_shares(carried, shares, what)
    outside = np.cumsum(list(carried.values())[::-1])[::-1]
    stiffness = {name: float(load) * allowed_ratio / parts[name] for name, load in zip(carried, outside, strict=True)}
    k = np.array(list(stiffness.values()))
    chain = np.diag(k + np.append(k[1:], 0.0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    lowest = scipy.linalg.eigh(chain, np.diag(list(carried.values())), eigvals_only=True)[0]
    total = sum(parts.values())
    accelerated = number(acceleration, f"{what}: acceleration", "rad/s²", above=0.0)
    return StiffnessShares(
        inertias=ReadOnlyMapping(carried),
        shares=ReadOnlyMapping(parts),
        stiffness=ReadOnlyMapping(stiffness),
        deflection=total * accelerated / allowed_ratio,
        frequency=math.sqrt(float(lowest)) / (2 * math.pi),
    )


def _checked_shares(carried: Mapping[str, float], shares: Mapping[str, float] | None, what: str) -> dict[str, float]:
    if shares is None:
        return dict.fromkeys(carried, 1.0 / len(carried))
    if not isinstance(shares, Mapping):
        raise ModelError(f"{what}: shares must be a dict {{sub-module: share of the deflection}}, got {shares!r}.")
    for name in shares:
        if name not in carried:
            raise UnknownNameError(f"{what}: shares name {name!r}, which has no inertia. {nearest(str(name), carried)}")
    for name in carried:
        if name not in shares:
            raise ModelError(f"{what}: shares miss {name!r}; every connection gives way a little.")
    parts = {name: number(shares[name], f"{what}: share of {name!r}", "", above=0.0) for name in carried}
    total = sum(parts.values())
    if total > 1 + SHARE_TOLERANCE:
        raise ModelError(f"{what}: shares add up to {total:.4g}; more than 1 breaks the allowed deflection.")
    return parts


def _acceleration_per_deflection(
    acceleration: float, deflection: float | None, beam_deflection: float | None, what: str
) -> float:
    """Return acceleration over the mirror's deflection [1/s²], from whichever deflection is given."""
    if (deflection is None) == (beam_deflection is None):
        raise ModelError(f"{what}: give either deflection= (the mirror's) or beam_deflection= (the beam's).")
    if deflection is not None:
        allowed = number(deflection, f"{what}: deflection", "rad", above=0.0)
    else:
        allowed = mirror_deflection(number(beam_deflection, f"{what}: beam_deflection", "rad", above=0.0))
    return number(acceleration, f"{what}: acceleration", "rad/s²", above=0.0) / allowed
