"""The displacement of a base at every step of a run, from a displacement, velocity or acceleration that is sampled."""

from __future__ import annotations

import numpy as np
import scipy.fft
from scipy.integrate import cumulative_trapezoid

from ibsdyn.axes import Array
from ibsdyn.errors import SimulationWarning, warn_user
from ibsdyn.excitation import Excitation
from ibsdyn.generalized_alpha import derivatives

# A mean below this share of the RMS is rounding.
MEAN_SHARE = 1e-9


def displacement_table(excitation: Excitation, order: int, steps_per_sample: int, what: str) -> Array:
    """Return (n steps_per_sample,) displacements whose derivative, as the integrator has it, is the signal.

    Parameters
    ----------
    excitation : of the base.
    order : 0 if it is a displacement, 1 a velocity, 2 an acceleration.
    what : whose it is, for the warning.

    Warns
    -----
    SimulationWarning : a periodic velocity or acceleration with a mean, which no periodic motion has.

    Notes
    -----
    Sums of sinusoids line by line, zero mean. Other signals by the trapezoidal rule from rest at zero: the rule's
    error is the integrator's own, so that the base's acceleration in the run is the one asked for.
    """
    table = excitation.refined(steps_per_sample)
    if order == 0:
        return table
    step = 1.0 / (excitation.sample_rate * steps_per_sample)
    if not excitation._circular:
        for _ in range(order):
            table = np.asarray(cumulative_trapezoid(table, dx=step, initial=0), dtype=float)
        return table
    lines = np.asarray(scipy.fft.rfft(table))
    mean = float(table.mean())
    if excitation.is_periodic and abs(mean) > MEAN_SHARE * excitation.rms:
        warn_user(
            f"{what}: {excitation.name} has a mean of {mean:.3g}, which would carry the base ever further away; it is "
            "left out.",
            SimulationWarning,
        )
    lines[0] = 0.0
    # Beyond the band of the samples there is nothing but rounding.
    kept = np.arange(1, min(len(lines), excitation.n_samples // 2 + 1))
    omega = np.asarray(2 * np.pi * kept * excitation.resolution, dtype=np.float64)
    lines[kept] = lines[kept] / derivatives(omega, step)[order - 1]
    lines[kept[-1] + 1 :] = 0.0
    displaced: Array = scipy.fft.irfft(lines, len(table))
    return displaced
