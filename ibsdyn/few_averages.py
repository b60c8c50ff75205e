"""Fits to responses whose uncertainties are themselves estimated, from few averages or periods.

J. Schoukens, R. Pintelon, G. Vandersteen, P. Guillaume, Frequency-domain system identification using non-parametric
noise models estimated from a small number of data sets, Automatica 33 (1997) 1073-1086.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.stats

from ibsdyn.axes import Array
from ibsdyn.measured import Measured, MeasuredFrequencies


def scatter_of_residuals(measured: Sequence[Measured]) -> Array:
    """Return by how much more the weighted residuals spread a fit's parameters, in variance, (n_data,).

    Notes
    -----
    A variance that is estimated with nu complex degrees of freedom weights with 1/s², of which the sum expects
    nu / (nu - 1) times the true weights, and the sum of squares nu² / ((nu - 1) (nu - 2)): nu / (nu - 2) together.
    Infinite for two and fewer.
    """
    factors = []
    for each in measured:
        nu = None if isinstance(each, MeasuredFrequencies) else each.degrees_of_freedom
        if isinstance(each, MeasuredFrequencies) or nu is None:
            factors.append(np.ones(_count(each)))
        else:
            factor = np.divide(nu, nu - 2.0, out=np.full(len(nu), np.inf), where=nu > 2.0)
            factors.append(np.broadcast_to(factor, (2, *_shape(each))).ravel())
    return np.concatenate(factors)


def equivalent_chi_squared(residuals: Array, measured: Sequence[Measured]) -> float:
    """Return the sum of squares that would be as improbable if all uncertainties were known exactly.

    Notes
    -----
    At one frequency the squares of an output's residuals over n_in inputs, which share one estimated variance, are
    F-distributed with 2 n_in and 2 nu degrees of freedom; they are replaced by the value of chi² with 2 n_in that is
    exceeded as rarely.
    """
    total = 0.0
    for each, own in _parts(residuals, measured):
        nu = None if isinstance(each, MeasuredFrequencies) else each.degrees_of_freedom
        if isinstance(each, MeasuredFrequencies) or nu is None:
            total += float(own @ own)
            continue
        free = 2 * len(each.inputs)
        squares = np.sum(own.reshape(2, *_shape(each)) ** 2, axis=(0, 2))
        total += float(np.sum(scipy.stats.chi2.isf(scipy.stats.f.sf(squares / free, free, 2.0 * nu), free)))
    return total


def _shape(measured: Measured) -> tuple[int, ...]:
    """Return how the residuals stand: modes, or outputs, inputs and lines of one of the two parts."""
    if isinstance(measured, MeasuredFrequencies):
        return (len(measured.frequencies),)
    return len(measured.outputs), len(measured.inputs), len(measured.lines)


def _count(measured: Measured) -> int:
    parts = 1 if isinstance(measured, MeasuredFrequencies) and measured.damping_sigma is None else 2
    return parts * int(np.prod(_shape(measured)))


def _parts(residuals: Array, measured: Sequence[Measured]) -> Iterator[tuple[Measured, Array]]:
    start = 0
    for each in measured:
        yield each, residuals[start : start + _count(each)]
        start += _count(each)
