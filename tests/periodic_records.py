"""Exactly periodic records of known linear responses, made in the frequency domain."""

import numpy as np

import ibsdyn as ibs


def names_of(n_in, n_out):
    return [f"u{k + 1}" for k in range(n_in)], [f"y{k + 1}" for k in range(n_out)]


def periodic_run(rng, response, harmonics, period, periods, output_noise=0.0, distortion=0.0, phases=None):
    """One run: random-phase multisine of amplitude 1 on each input.

    ``output_noise`` is the standard deviation of a line of one period, E|N|^2 = output_noise^2; ``distortion`` the same
    of what repeats in every period of this run.
    """
    n_out, n_in, n_lines = response.shape
    U = np.exp(2j * np.pi * rng.random((n_in, n_lines))) if phases is None else phases
    Y = np.einsum("oif,if->of", response, U) + distortion * complex_normal(rng, (n_out, n_lines))
    spectrum = np.zeros((n_in + n_out, period // 2 + 1), dtype=complex)
    spectrum[:, harmonics] = np.vstack([U, Y]) * period / 2
    signals = np.tile(np.fft.irfft(spectrum, period), periods)
    # White noise of variance s^2 has lines of amplitude with E|2/N sum|^2 = 4 s^2 / N.
    signals[n_in:] += output_noise * np.sqrt(period) / 2 * rng.standard_normal((n_out, period * periods))
    inputs, outputs = names_of(n_in, n_out)
    return ibs.TimeRecord(signals, inputs + outputs, ["N"] * n_in + ["m/s²"] * n_out, 1000.0, period=period)


def complex_normal(rng, shape):
    """Circular, E|z|^2 = 1."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
