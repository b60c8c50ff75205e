"""Responses out of spectra: H1, H2 and Hv for any number of inputs, with what they leave unexplained."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError, RecordWarning, warn_user
from ibsdyn.identification.cross_spectra import ComplexArray, CrossSpectra
from ibsdyn.identification.effective_averages import after_regression

ESTIMATORS = ("H1", "H2", "Hv")
# Of inputs scaled to unit power, the smallest share that may be independent of the others: below, it is rounding.
DEPENDENT = 1e-11
# Digits lost in subtracting what is explained from an output's power.
ROUNDING = 1e-14


@dataclass(frozen=True, eq=False)
class Regression:
    """Outputs explained by inputs, one line of frequency after the other.

    Attributes
    ----------
    response : (n_freq, n_out, n_in).
    residual : (n_freq, n_out, n_out) unbiased covariance of what is left, per average.
    gain : (n_freq, n_in, n_in) inverse of the inputs' summed power.
    coherence : (n_freq, n_out) multiple coherence.
    partial_coherence : (n_freq, n_out, n_in) of output and input, the other inputs taken out of both.
    degrees_of_freedom : complex ones of ``residual``.
    """

    response: ComplexArray
    residual: ComplexArray
    gain: ComplexArray
    coherence: Array
    partial_coherence: Array
    degrees_of_freedom: float


def h1(spectra: CrossSpectra, n_inputs: int, names: tuple[str, ...]) -> Regression:
    """Return the least squares response: unbiased where noise is on the outputs only.

    Raises
    ------
    RecordError : inputs that depend on each other.

    Warns
    -----
    RecordWarning : a lag window that makes spectra negative.

    Notes
    -----
    G = S_yu S_uu^-1; Cov(G) = S_uu^-1 / n times the residual spectrum with n - n_in degrees of freedom, for n equal
    averages. Bendat and Piersol, Random Data, chapter 9.
    """
    q = n_inputs
    s_uu, s_yu, s_yy = spectra.matrix[:, :q, :q], spectra.matrix[:, q:, :q], spectra.matrix[:, q:, q:]
    inverse = inverse_power(s_uu, spectra.frequencies, names)
    response = s_yu @ inverse
    left = s_yy - response @ s_yu.conj().transpose(0, 2, 1)
    power = np.einsum("fii->fi", s_yy).real
    coherence = 1.0 - np.einsum("fii->fi", left).real / np.where(power > 0, power, 1.0)
    if np.any(coherence > 1.0 + 1e-6) or np.any(power < 0):
        count = int(np.count_nonzero((coherence > 1.0 + 1e-6).any(axis=1) | (power < 0).any(axis=1)))
        warn_user(
            f"the lag window makes spectra negative at {count} of {len(power)} frequencies, where the confidence "
            'region means nothing; window="parzen" cannot do that.',
            RecordWarning,
        )
    floored = _floored(left, ROUNDING * np.abs(power))
    partial = partial_coherence(response, np.einsum("fii->fi", floored).real, inverse)
    worth = after_regression(spectra.averages, q)
    if worth.degrees_of_freedom == 0:
        return _without_variance(response, coherence)
    return Regression(
        response,
        floored / worth.residual_share,
        inverse * worth.per_average,
        np.clip(coherence, 0.0, 1.0),
        partial,
        worth.degrees_of_freedom,
    )


def h2(spectra: CrossSpectra, n_inputs: int, names: tuple[str, ...]) -> Regression:
    """Return the inverse of the inputs' regression on the outputs: unbiased where noise is on the inputs only.

    Raises
    ------
    RecordError : as many outputs as inputs are needed; inputs or outputs that depend on each other.

    Notes
    -----
    With H = (S_uy S_yy^-1)^-1 and dH = -H d(H^-1) H the covariance keeps its form.
    """
    q, count = n_inputs, spectra.matrix.shape[1]
    if count != 2 * q:
        raise RecordError(
            f"H2 inverts the response and needs as many outputs as inputs, not {count - q} and {q}; estimate the "
            'outputs one by one or take estimator="H1" or "Hv".'
        )
    forward = h1(spectra, q, names)
    turned = np.roll(np.arange(count), q)
    matrix = spectra.matrix[:, turned][:, :, turned]
    back = h1(CrossSpectra(spectra.frequencies, matrix, spectra.averages, spectra.resolution), q, names[q:] + names[:q])
    response = np.asarray(np.linalg.inv(back.response), dtype=np.complex128)
    adjoint = response.conj().transpose(0, 2, 1)
    return Regression(
        response,
        response @ back.residual @ adjoint,
        adjoint @ back.gain @ response,
        forward.coherence,
        forward.partial_coherence,
        back.degrees_of_freedom,
    )


def hv(spectra: CrossSpectra, n_inputs: int, names: tuple[str, ...]) -> Regression:
    """Return the total least squares response: noise on every channel in proportion to its power.

    Raises
    ------
    RecordError : inputs that depend on each other.

    Notes
    -----
    Per output the eigenvector of the smallest eigenvalue of the spectra of inputs and output, each scaled to unit
    power; the geometric mean of H1 and H2 where there is one input. The noise that this eigenvalue holds is taken out
    of the inputs' power before it is inverted for the covariance.
    """
    q, count = n_inputs, spectra.matrix.shape[1]
    plain = h1(spectra, q, names)
    scale = np.sqrt(np.einsum("fii->fi", spectra.matrix).real)
    scale = np.where(scale > 0, scale, 1.0)
    scaled = spectra.matrix / (scale[:, :, None] * scale[:, None, :])
    response = np.empty_like(plain.response)
    noise = np.zeros(len(scale))
    for output in range(count - q):
        chosen = np.r_[:q, q + output]
        values, vectors = np.linalg.eigh(scaled[:, chosen][:, :, chosen])
        # The smallest direction is the row (-G, 1) up to its length, of the conjugate.
        smallest = vectors[:, :, 0].conj()
        response[:, output] = -smallest[:, :q] / smallest[:, q:] * scale[:, q + output, None] / scale[:, :q]
        noise = np.maximum(noise, values[:, 0])
    s_uu = spectra.matrix[:, :q, :q]
    clean = s_uu - (noise[:, None] * scale[:, :q] ** 2)[:, :, None] * np.eye(q)
    s_yu, s_yy = spectra.matrix[:, q:, :q], spectra.matrix[:, q:, q:]
    adjoint = response.conj().transpose(0, 2, 1)
    left = s_yy - response @ s_yu.conj().transpose(0, 2, 1) - s_yu @ adjoint + response @ s_uu @ adjoint
    worth = after_regression(spectra.averages, q)
    if worth.degrees_of_freedom == 0:
        return _without_variance(response, plain.coherence)
    return Regression(
        response,
        _floored(left, ROUNDING * scale[:, q:] ** 2) / worth.residual_share,
        _inverse(clean) * worth.per_average,
        plain.coherence,
        plain.partial_coherence,
        worth.degrees_of_freedom,
    )


def partial_coherence(response: ComplexArray, unexplained: Array, inverse: ComplexArray) -> Array:
    """Return |G|^2 / (|G|^2 + unexplained power over the input's own), (n_freq, n_out, n_in).

    Parameters
    ----------
    response : (n_freq, n_out, n_in).
    unexplained : (n_freq, n_out) power that the inputs do not explain.
    inverse : (n_freq, n_in, n_in) of the inputs' power; one over its diagonal is what each has apart from the others.
    """
    explained = np.abs(response) ** 2
    total = explained + unexplained[:, :, None] * np.einsum("fjj->fj", inverse).real[:, None, :]
    # Where neither holds anything, nothing is coherent: 0 rather than 0/0.
    share: Array = np.divide(explained, total, out=np.zeros_like(explained), where=total > 0)
    return share


def _without_variance(response: ComplexArray, coherence: Array) -> Regression:
    n_freq, n_out, n_in = response.shape
    return Regression(
        response,
        np.full((n_freq, n_out, n_out), np.nan, dtype=np.complex128),
        np.full((n_freq, n_in, n_in), np.nan, dtype=np.complex128),
        np.full_like(coherence, np.nan),
        np.full((n_freq, n_out, n_in), np.nan),
        0.0,
    )


def inverse_power(power: ComplexArray, frequencies: Array, names: tuple[str, ...]) -> ComplexArray:
    """Return the inverse of the inputs' power matrix, (n_freq, n_in, n_in).

    Raises
    ------
    RecordError : an input without power, or inputs that depend on each other.
    """
    diagonal = np.einsum("fii->fi", power).real
    negative = diagonal < 0
    if negative.any():
        line, row = (int(place[0]) for place in np.nonzero(negative))
        raise RecordError(
            f"input {names[row]!r} has negative power at {frequencies[line]:g} Hz: side lobes of the lag window, from "
            'a much stronger line elsewhere. window="parzen" has none that are negative.'
        )
    silent = diagonal == 0
    if silent.any():
        line, row = (int(place[0]) for place in np.nonzero(silent))
        raise RecordError(f"input {names[row]!r} has no power at {frequencies[line]:g} Hz; leave it out or excite it.")
    scale = np.sqrt(diagonal)
    scaled = power / (scale[:, :, None] * scale[:, None, :])
    values, vectors = np.linalg.eigh(scaled)
    line = int(values[:, 0].argmin())
    if values[line, 0] < DEPENDENT:
        count = int(np.count_nonzero(values[line] >= DEPENDENT))
        moved = np.abs(vectors[line, :, 0])
        guilty = [name for name, part in zip(names, moved, strict=False) if part > 0.1 * moved.max()]
        raise RecordError(
            f"the {power.shape[1]} inputs moved in only {count} independent ways at {frequencies[line]:g} Hz; "
            f"{', '.join(map(repr, guilty))} depend on each other. Excite them independently, add runs with other "
            "excitation, or leave an input out."
        )
    inverse: ComplexArray = _inverse(scaled) / (scale[:, :, None] * scale[:, None, :])
    return inverse


def _inverse(matrix: ComplexArray) -> ComplexArray:
    inverse = np.linalg.inv(matrix)
    hermitian: ComplexArray = 0.5 * (inverse + inverse.conj().transpose(0, 2, 1))
    return hermitian


def _floored(matrix: ComplexArray, floor: Array) -> ComplexArray:
    """Keep rounding from making a variance zero or negative."""
    floored: ComplexArray = 0.5 * (matrix + matrix.conj().transpose(0, 2, 1))
    diagonal = np.einsum("fii->fi", floored)
    diagonal[:] = np.maximum(diagonal.real, floor)
    return floored
