"""What a constant step of the generalised-alpha method makes of a sinusoid.

J. Chung, G. M. Hulbert, A time integration algorithm for structural dynamics with improved numerical dissipation: the
generalized-alpha method, Journal of Applied Mechanics 60 (1993) 371-375; equilibrium at the end of the step and
filtered accelerations as in M. Arnold, O. Brüls, Convergence of the generalized-alpha scheme for constrained mechanical
systems, Multibody System Dynamics 18 (2007) 185-202.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array

SPECTRAL_RADIUS = 0.9

_ALPHA_M = (2 * SPECTRAL_RADIUS - 1) / (SPECTRAL_RADIUS + 1)
_ALPHA_F = SPECTRAL_RADIUS / (SPECTRAL_RADIUS + 1)
_GAMMA = 0.5 + _ALPHA_F - _ALPHA_M
_BETA = 0.25 * (_GAMMA + 0.5) ** 2


def frequency_error(frequency: float | Array, step: float) -> Array:
    """Return by which share a mode's frequency comes out too low: (omega h)²/12.

    Parameters
    ----------
    frequency : [Hz].
    step : [s].
    """
    error: Array = np.square(2 * np.pi * np.asarray(frequency, dtype=float) * step) / 12
    return error


def longest_step(frequency: float | Array, error: float | Array) -> float:
    """Return the longest step [s] that keeps ``frequency_error`` at or below ``error`` everywhere."""
    return float(np.min(np.sqrt(12 * np.asarray(error)) / (2 * np.pi * np.asarray(frequency, dtype=float))))


def linear_frequency(frequency: float | Array, step: float) -> Array:
    """Return the frequency [Hz] at which the linear model has what the integrator shows at ``frequency`` [Hz]."""
    warped: Array = np.tan(np.pi * np.asarray(frequency, dtype=float) * step) / (np.pi * step)
    return warped


def derivatives(omega: Array, step: float) -> tuple[NDArray[np.complexfloating], NDArray[np.complexfloating]]:
    """Return (i omega) and (i omega)² as the integrator has them, in a steady oscillation.

    Parameters
    ----------
    omega : (n,) [rad/s], above zero and below the Nyquist frequency of the steps.
    step : [s].

    Returns
    -------
    (n,) velocity per displacement [1/s] and acceleration per displacement [1/s²]. A linear model with these in the
    place of i omega and -omega² answers exactly as the integrator does.
    """
    # expm1 keeps the digits of z - 1 where the step is a small part of the period.
    less_one = np.expm1(np.asarray(1j * omega * step, dtype=complex))
    z = less_one + 1.0
    filtered = less_one**2 / (step**2 * (_BETA * z**2 + (0.5 + _GAMMA - 2 * _BETA) * z + (0.5 - _GAMMA + _BETA)))
    velocity = filtered * step * (_GAMMA * z + 1.0 - _GAMMA) / less_one
    acceleration = filtered * ((1.0 - _ALPHA_M) * z + _ALPHA_M) / ((1.0 - _ALPHA_F) * z + _ALPHA_F)
    return velocity, acceleration
