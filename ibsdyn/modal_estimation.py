"""Modal parameters out of frequency responses, by the package sdypy-EMA (the extra ``modal``)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError, ExtraMissingError, known_keywords
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.identification.frf_estimate import FrfEstimate
from ibsdyn.resonances import distinct, find_resonances

# A pole further than this share from where it was looked for is another one.
NEAR = 0.05


@dataclass(frozen=True, eq=False)
class ModalEstimate:
    """Modes that fit frequency responses.

    Attributes
    ----------
    frequencies : (n_modes,) undamped natural frequencies, rising [Hz].
    damping_ratios : (n_modes,) [-].
    shapes : (n_out, n_modes) complex, over ``outputs``, the largest value 1.
    participation : (n_in, n_modes) complex, what each input of ``inputs`` does to the mode, the largest value 1.
    outputs, inputs : names.
    fit : the responses that these modes and their residuals make, to draw over the estimate.
    """

    frequencies: Array
    damping_ratios: Array
    shapes: NDArray[np.complex128]
    participation: NDArray[np.complex128]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    fit: FrequencyResponse

    def __str__(self) -> str:
        """Return a table: frequency and damping ratio."""
        lines = ["mode  frequency [Hz]  zeta [%]"]
        for r, (frequency, ratio) in enumerate(zip(self.frequencies, self.damping_ratios, strict=True)):
            lines.append(f"{r + 1:4d}  {frequency:14.4g}  {100 * ratio:8.3g}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)


@known_keywords
def estimate_modes(
    frf: FrequencyResponse, frequencies: Sequence[float] | Array | None = None, order: int = 30
) -> ModalEstimate:
    """Return natural frequencies, damping ratios and shapes that fit frequency responses.

    Parameters
    ----------
    frf : estimated or calculated, at lines of equal distance.
    frequencies : where to look for modes [Hz]; where the responses show resonances if None.
    order : modes at most of the fitted polynomials; poles are taken at the order from which they change least.

    Returns
    -------
    ModalEstimate; two of them, of model and test, give ``compare(..., modes=...)`` its MAC.

    Raises
    ------
    ExtraMissingError : sdypy-EMA is not installed.
    AnalysisError : lines that are not equally spaced, outputs of different quantities, no resonance, or no pole near
        the frequency asked for.

    Notes
    -----
    Poles by least squares complex frequency (LSCF) on a common denominator, residues by least squares (LSFD), both of
    sdypy-EMA; shape and participation are the leading singular vectors of a mode's residues. LSCF reads damping too
    low where there is much noise.
    """
    ema = _package()
    if isinstance(order, bool) or not isinstance(order, Integral) or order < 2:
        raise AnalysisError(f"order must be a whole number, 2 at least, got {order!r}.")
    wanted = _wanted(frf, frequencies)
    n_out, n_in, n_freq = frf.response.shape
    spacing = np.diff(frf.frequencies)
    lines = frf.frequencies / spacing.mean() if n_freq > 1 else np.zeros(1)
    if n_freq < 2 * order or np.abs(lines - np.rint(lines)).max() > 1e-3:
        raise AnalysisError(
            f"LSCF needs lines at multiples of one distance and {2 * order} of them at least; these {n_freq} stand "
            f"{spacing.min(initial=np.inf):.4g} to {spacing.max(initial=0):.4g} Hz apart. Excite every line, or "
            'estimate by method="welch" or "spectral".'
        )
    top = float(frf.frequencies[-1])
    flat = frf.response.reshape(n_out * n_in, n_freq)
    # The package leaves the line at its upper limit out; a copy of the last one keeps all that were measured.
    model: Any = ema.Model(
        np.column_stack([flat, flat[:, -1]]),
        np.append(frf.frequencies, 2 * top - frf.frequencies[-2]),
        lower=float(frf.frequencies[0]),
        upper=2 * top - float(frf.frequencies[-2]),
        pol_order_high=int(order),
        frf_form=_form(frf),
    )
    model.get_poles(method="lscf", show_progress=False)
    chosen = [_stable_pole(model, frequency) for frequency in wanted]
    model.pole_ind = [[at, pole] for at, pole, *_ in chosen]
    model.get_constants(f_lower=float(frf.frequencies[0]), f_upper=float(model.freq[-1]))
    residues = np.asarray(model.A).reshape(n_out, n_in, len(chosen))
    shapes = np.empty((n_out, len(chosen)), dtype=np.complex128)
    participation = np.empty((n_in, len(chosen)), dtype=np.complex128)
    for r in range(len(chosen)):
        left, _, right = np.linalg.svd(residues[:, :, r])
        shapes[:, r] = left[:, 0] / left[np.abs(left[:, 0]).argmax(), 0]
        participation[:, r] = right[0] / right[0, np.abs(right[0]).argmax()]
    rebuilt = np.asarray(model.H)[:, -n_freq:].reshape(n_out, n_in, n_freq)
    return ModalEstimate(
        np.array([frequency for _, _, frequency, _ in chosen]),
        np.array([ratio for _, _, _, ratio in chosen]),
        shapes,
        participation,
        frf.outputs,
        frf.inputs,
        FrequencyResponse(frf.frequencies, rebuilt, frf.outputs, frf.inputs, frf.output_units, frf.input_units),
    )


def _package() -> Any:
    try:
        from sdypy import EMA
    except ImportError as error:
        raise ExtraMissingError(
            'estimate_modes needs the package sdypy-EMA, which is not installed: pip install "ibsdyn[modal]".'
        ) from error
    return EMA


def _wanted(frf: FrequencyResponse, frequencies: Sequence[float] | Array | None) -> list[float]:
    if frequencies is not None:
        given = np.sort(np.atleast_1d(np.asarray(frequencies, dtype=float)))
        if given.size == 0 or not np.all((given >= frf.frequencies[0]) & (given <= frf.frequencies[-1])):
            raise AnalysisError(
                f"frequencies must lie within the response's {frf.frequencies[0]:g} to {frf.frequencies[-1]:g} Hz, got "
                f"{frequencies!r}."
            )
        return [float(frequency) for frequency in given]
    variance = None
    if isinstance(frf, FrfEstimate) and np.all(frf.degrees_of_freedom > 0):
        variance = frf.variance
    found = distinct(find_resonances(frf, variance))
    if not found:
        raise AnalysisError("the responses show no resonance; say where to look (frequencies=[...] in Hz).")
    return [resonance.frequency for resonance in found]


def _form(frf: FrequencyResponse) -> str:
    """Return what sdypy-EMA calls responses in displacement, velocity or acceleration: it decides their residuals."""
    plain = [unit.replace("²", "2").replace("^", "") for unit in frf.output_units]
    forms = {
        "accelerance" if unit.endswith("/s2") else "mobility" if unit.endswith("/s") else "receptance" for unit in plain
    }
    if len(forms) > 1:
        raise AnalysisError(
            f"outputs in {', '.join(sorted(set(frf.output_units)))} cannot be fitted together: their residuals differ; "
            "select those of one quantity."
        )
    return forms.pop()


def _stable_pole(model: Any, frequency: float) -> tuple[int, int, float, float]:
    """Return order, place, frequency and damping of the pole that changes least from one order to the next."""
    near: list[tuple[int, int, float, float]] = []
    for at, (poles, ratios) in enumerate(zip(model.pole_freq, model.pole_xi, strict=True)):
        usable = np.flatnonzero((np.asarray(ratios) > 0) & (np.asarray(ratios) < 1))
        if len(usable):
            place = int(usable[np.abs(np.asarray(poles)[usable] - frequency).argmin()])
            if abs(poles[place] - frequency) < NEAR * frequency:
                near.append((at, place, float(poles[place]), float(ratios[place])))
    changes = [
        (abs(now[2] / before[2] - 1) + abs(now[3] - before[3]), now)
        for before, now in pairwise(near)
        if now[0] == before[0] + 1
    ]
    if not changes:
        raise AnalysisError(
            f"no stable pole within {100 * NEAR:.0f} % of {frequency:.4g} Hz up to order {model.pol_order_high}; look "
            "elsewhere (frequencies=) or raise order=."
        )
    return min(changes, key=lambda change: change[0])[1]
