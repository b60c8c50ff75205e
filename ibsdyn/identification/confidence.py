"""Quantiles of the regions in which true responses lie."""

from __future__ import annotations

import numpy as np
import scipy.stats

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError


def checked_confidence(confidence: float) -> float:
    """Return a level as a number between 0 and 1.

    Raises
    ------
    AnalysisError : it is none; 99 % is 0.99.
    """
    try:
        level = float(confidence)
    except (TypeError, ValueError):
        level = np.nan
    if not 0.0 < level < 1.0:
        raise AnalysisError(f"confidence must be between 0 and 1, as 0.99 for 99 %, got {confidence!r}.")
    return level


def circle_quantile(confidence: float, degrees_of_freedom: Array) -> Array:
    """Return the squared radius, over the variance, of the circle around an estimated complex number.

    Parameters
    ----------
    confidence : between 0 and 1.
    degrees_of_freedom : complex ones, of the estimated variance; half the real ones.

    Notes
    -----
    |dG|^2 / s^2 is F-distributed with 2 and 2 nu degrees of freedom, whose quantile has the closed form
    nu ((1 - p)^(-1/nu) - 1); it tends to -ln(1 - p), the chi-squared quantile of a known variance.
    """
    nu = np.asarray(degrees_of_freedom, dtype=float)
    quantile: Array = nu * np.expm1(-np.log1p(-confidence) / nu)
    return quantile


def marginal_quantile(confidence: float, degrees_of_freedom: Array) -> Array:
    """Return the two-sided bound, over the standard deviation, of a real number, as the magnitude or the phase alone.

    Notes
    -----
    Half of the complex variance is in each of the real and the imaginary part: sqrt(1/2) times Student's quantile.
    """
    nu = np.asarray(degrees_of_freedom, dtype=float)
    quantile: Array = scipy.stats.t.ppf(0.5 + confidence / 2, 2 * nu) / np.sqrt(2)
    return quantile
