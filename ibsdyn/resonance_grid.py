"""Frequencies that resolve every resonance, with the weights that integrate over them.

A response is smooth over an interval that is shorter than its distance from the nearest pole. Intervals are halved
until that holds, so that they crowd around lightly damped resonances, and each gets a Gauss-Legendre rule: the error
falls exponentially with the number of nodes, and no peak can slip through.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError

if TYPE_CHECKING:
    from ibsdyn.linear_system import LinearSystem

Complex = NDArray[np.complexfloating]

# An interval is halved until it is no longer than this many times its distance from the nearest pole.
LENGTH_PER_DISTANCE = 1.0
# Gauss-Legendre converges as rho^(-2 n); with the ratio above rho is at least 3.7 and ten nodes leave 1e-11.
NODES = 10
FEWEST_NODES = 3
# Poles nearer to the real axis than this share of their frequency are resolved as if they were here: undamped modes.
LEAST_RATIO = 1e-7


@dataclass(frozen=True, eq=False)
class ResonanceGrid:
    """Gauss-Legendre nodes in intervals that are graded towards the resonances.

    Attributes
    ----------
    frequencies : (n,) rising nodes [Hz].
    weights : (n,) [Hz]: the integral of g over the band is ``weights @ g(frequencies)``.
    edges : (n_intervals + 1,) ends of the intervals [Hz].
    first : (n_intervals,) number of the first node of each interval.
    """

    frequencies: Array
    weights: Array
    edges: Array
    first: NDArray[np.intp]

    def integral(self, values: Array) -> Array:
        """Return the integral over the band of (..., n) values."""
        return np.asarray(values @ self.weights)

    def cumulative(self, values: Array) -> Array:
        """Return the integral from the band's lower end up to each node, (..., n) of (..., n) values.

        Within an interval the polynomial through its nodes is integrated, so that the last interval ends in
        ``integral(values)``.
        """
        before = np.zeros((*values.shape[:-1], len(self.first) + 1))
        before[..., 1:] = np.cumsum(np.add.reduceat(values * self.weights, self.first, axis=-1), axis=-1)
        result = np.empty(values.shape)
        counts = np.diff(np.r_[self.first, len(self.frequencies)])
        for count in np.unique(counts):
            intervals = np.flatnonzero(counts == count)
            nodes = self.first[intervals][:, None] + np.arange(count)
            lengths = np.diff(self.edges)[intervals]
            within = (values[..., nodes] @ _up_to_node(int(count)).T) * lengths[:, None]
            result[..., nodes] = before[..., intervals][..., None] + within
        return result


def poles(system: LinearSystem, hysteretic: bool = False) -> Complex:
    """Return the poles of a system as complex frequencies f + i sigma [Hz], those with f >= 0 only."""
    omega, shapes, _ = system._modal
    damping = shapes.T @ (system._explicit_damping[: len(omega), : len(omega)] if hysteretic else system.C) @ shapes
    coupled = hysteretic or any(part.viscous for part in system._parts)
    if not coupled:
        half = np.diag(damping) / 2
        own = 1j * half + np.sqrt((omega**2 - half**2).astype(complex))
    else:
        stiffness = np.diag(omega**2).astype(complex)
        if hysteretic:
            for part in system._parts:
                rows = part.rows[:, : len(omega)] @ shapes
                stiffness += 2j * part.zeta * (rows.T @ rows)
        n = len(omega)
        first_order = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])
        own = np.linalg.eigvals(first_order) / 1j
    own = own[~((own.real == 0) & (own.imag == 0))] / (2 * np.pi)
    mirrored: Complex = np.where(own.real < 0, -own.conj(), own)
    return mirrored


def resonance_grid(
    singularities: Complex, band: tuple[float, float], breakpoints: Sequence[float] | Array = ()
) -> ResonanceGrid:
    """Return nodes and weights over a band.

    Parameters
    ----------
    singularities : complex frequencies near which the integrand is not smooth [Hz]; 0 Hz always is one (f^m).
    band : (lower, upper) [Hz], lower above 0.
    breakpoints : frequencies where the integrand has a kink or a step [Hz].

    Raises
    ------
    AnalysisError : a band that is none.
    """
    lower, upper = checked_band(band)
    width = np.maximum(np.abs(singularities.imag), LEAST_RATIO * np.abs(singularities.real))
    near = np.append(singularities.real + 1j * width, 0.0)
    inside = [f for f in np.asarray(breakpoints, dtype=float) if lower < f < upper]
    pending = np.unique([lower, *inside, upper])
    starts, ends = pending[:-1], pending[1:]
    done: list[tuple[Array, Array, Array]] = []
    while len(starts):
        distance = _distance(starts, ends, near)
        short = ends - starts <= LENGTH_PER_DISTANCE * distance
        done.append((starts[short], ends[short], distance[short]))
        starts, ends = starts[~short], ends[~short]
        middle = 0.5 * (starts + ends)
        starts, ends = np.r_[starts, middle], np.r_[middle, ends]
    start, end, distance = (np.concatenate(column) for column in zip(*done, strict=True))
    order = np.argsort(start)
    start, end, distance = start[order], end[order], distance[order]
    counts = _nodes_needed((end - start) / distance)
    frequencies, weights = np.empty(counts.sum()), np.empty(counts.sum())
    first = np.r_[0, np.cumsum(counts)[:-1]]
    for count in np.unique(counts):
        intervals = np.flatnonzero(counts == count)
        x, w = np.polynomial.legendre.leggauss(int(count))
        nodes = first[intervals][:, None] + np.arange(count)
        length = (end - start)[intervals][:, None]
        frequencies[nodes] = start[intervals][:, None] + 0.5 * length * (1 + x)
        weights[nodes] = 0.5 * length * w
    return ResonanceGrid(frequencies, weights, np.r_[start, end[-1]], first)


def checked_band(band: object) -> tuple[float, float]:
    """Return a band (lower, upper) [Hz].

    Raises
    ------
    AnalysisError : not two rising finite frequencies above 0 Hz.
    """
    try:
        lower, upper = (float(f) for f in band)  # type: ignore[attr-defined]  # whatever was given; except answers it
    except (TypeError, ValueError):
        raise AnalysisError(f"band must be two frequencies (lower, upper) [Hz], got {band!r}.") from None
    if not 0.0 < lower < upper < np.inf:
        raise AnalysisError(f"band must be two rising frequencies above 0 Hz, got {(lower, upper)}.")
    return lower, upper


def _distance(starts: Array, ends: Array, near: Complex) -> Array:
    """Return the least distance of each interval from the singularities and their mirror images."""
    distance = np.full(len(starts), np.inf)
    for singularity in near:
        along = np.maximum(0.0, np.maximum(starts - singularity.real, singularity.real - ends))
        distance = np.minimum(distance, np.hypot(along, singularity.imag))
    return distance


def _nodes_needed(length_per_distance: Array) -> NDArray[np.intp]:
    """Return how many nodes leave the same error in intervals that are shorter than they need be."""
    semi_axis = 1 + 2 / length_per_distance  # worst case: the singularity on the real axis beyond the end
    rho = semi_axis + np.sqrt(semi_axis**2 - 1)
    least = 3 + 2 * np.sqrt(2)  # of the longest interval
    needed = np.clip(np.ceil(NODES * np.log(least) / np.log(rho)), FEWEST_NODES, NODES)
    return np.asarray(needed, dtype=np.intp)


@cache
def _up_to_node(count: int) -> Array:
    """Return the (count, count) integrals from 0 to each node of the polynomials through the nodes, unit interval."""
    x, w = np.polynomial.legendre.leggauss(count)
    basis = np.polynomial.legendre.legvander(x, count - 1)
    # The Legendre coefficients of Lagrange's polynomials come from the rule itself: it is exact to degree 2 n - 1.
    coefficients = (basis * w[:, None]).T * (np.arange(count) + 0.5)[:, None]
    integrals = np.polynomial.legendre.legint(np.eye(count), lbnd=-1, axis=0)
    up_to: Array = 0.5 * np.polynomial.legendre.legvander(x, count) @ integrals @ coefficients
    return up_to
