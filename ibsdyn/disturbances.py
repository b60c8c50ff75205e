"""What shakes a machine: random signals by their PSDs, alone or correlated, and tones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import ModelError, known_keywords
from ibsdyn.psd import PSD
from ibsdyn.signals import Input, checked_inputs
from ibsdyn.validation import number

Complex = NDArray[np.complexfloating]

# A correlation matrix may be indefinite by this much: rounding, and the scatter of measured spectra.
INDEFINITE = 1e-6


@dataclass(frozen=True, init=False)
class Disturbance:
    """A random signal on one input.

    Parameters
    ----------
    name : how results call it.
    input : Force, Torque or BaseMotion that it acts through.
    psd : PSD of that input's quantity, or (frequencies [Hz], values [unit²/Hz]) in the input's unit. A PSD of a
        displacement, velocity or acceleration serves a BaseMotion of any of the three.

    Raises
    ------
    ModelError : a name or an input that is none, a PSD of another unit.
    """

    name: str
    input: Input
    psd: PSD

    @known_keywords
    def __init__(self, name: str, input: Input, psd: PSD | tuple[ArrayLike, ArrayLike]) -> None:
        what = _checked_name(name, "disturbance")
        (source,) = checked_inputs(input)
        _set(self, name=name, input=source, psd=_psd_of(psd, source, what))

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The input alone, as a tuple."""
        return (self.input,)

    @property
    def psds(self) -> tuple[PSD, ...]:
        """The PSD alone, as a tuple."""
        return (self.psd,)

    def cross_spectra(self, frequencies: Array) -> Complex:
        """Return the PSD as a (1, 1, n_freq) matrix of spectra."""
        return self.psd.at(frequencies)[None, None].astype(complex)


@dataclass(frozen=True, eq=False, init=False)
class CorrelatedDisturbance:
    """Random signals on several inputs that belong together, as the motions of one floor or a force and its torque.

    Parameters
    ----------
    name : how results call it.
    inputs : n inputs.
    psds : PSD of each, or one for all.
    correlation : (n, n) Hermitian, S_ij / sqrt(S_ii S_jj), ones on its diagonal: 1 where signals are one and the same
        (the default, all ones), -1 where they oppose, 0 where they have nothing to do with each other.
        Or (n, n, n_freq) at ``frequencies``, straight in between.
    frequencies : (n_freq,) [Hz] of a correlation that varies.

    Raises
    ------
    ModelError : numbers that do not fit each other, a correlation that no signals can have.

    Notes
    -----
    S_ij is the one-sided cross spectrum of the mean of X_i conj(X_j), e^{+i omega t}. ``scipy.signal.csd(x, y)`` gives
    its conjugate.
    """

    name: str
    inputs: tuple[Input, ...]
    psds: tuple[PSD, ...]
    correlation: Complex
    frequencies: Array | None

    @known_keywords
    def __init__(
        self,
        name: str,
        inputs: Sequence[Input],
        psds: PSD | Sequence[PSD],
        correlation: ArrayLike | None = None,
        frequencies: ArrayLike | None = None,
    ) -> None:
        what = _checked_name(name, "correlated disturbance")
        sources = checked_inputs(inputs)
        n = len(sources)
        spectra = [psds] * n if isinstance(psds, PSD) else list(psds)
        if len(spectra) != n:
            raise ModelError(f"{what}: {n} inputs and {len(spectra)} PSDs; give one for each, or one for all.")
        try:
            hertz = None if frequencies is None else np.array(frequencies, dtype=float, ndmin=1)
            matrix = np.ones((n, n), dtype=complex) if correlation is None else np.array(correlation, dtype=complex)
        except (TypeError, ValueError):
            given = correlation if frequencies is None else (correlation, frequencies)
            raise ModelError(f"{what}: correlation and its frequencies must be numbers, got {given!r}.") from None
        if hertz is not None and (np.diff(hertz) <= 0).any():
            raise ModelError(f"{what}: frequencies of the correlation must rise.")
        _set(
            self,
            name=name,
            inputs=sources,
            psds=tuple(_psd_of(psd, source, what) for psd, source in zip(spectra, sources, strict=True)),
            correlation=_checked_correlation(matrix, n, hertz, what),
            frequencies=hertz,
        )

    def __eq__(self, other: object) -> bool:
        """Tell whether another disturbance has the same inputs, PSDs and correlation, to the last digit."""
        if not isinstance(other, CorrelatedDisturbance):
            return NotImplemented
        own, others = self.frequencies, other.frequencies
        return (
            (self.name, self.inputs, self.psds) == (other.name, other.inputs, other.psds)
            and np.array_equal(self.correlation, other.correlation)
            and (own is others or (own is not None and others is not None and np.array_equal(own, others)))
        )

    def __hash__(self) -> int:
        """Return a hash that agrees with equality."""
        return hash((self.name, self.inputs, self.psds))

    @classmethod
    @known_keywords
    def from_cross_spectra(
        cls, name: str, inputs: Sequence[Input], frequencies: ArrayLike, spectra: ArrayLike
    ) -> CorrelatedDisturbance:
        """Return a disturbance from a measured matrix of cross spectra.

        Parameters
        ----------
        name : how results call it.
        inputs : n inputs.
        frequencies : (n_freq,) above 0 [Hz].
        spectra : (n, n, n_freq) one-sided, S_ij the mean of X_i conj(X_j), in the inputs' units.
        """
        hertz = np.array(frequencies, dtype=float, ndmin=1)
        matrix = np.array(spectra, dtype=complex)
        sources = checked_inputs(inputs)
        if matrix.shape != (len(sources), len(sources), len(hertz)):
            raise ModelError(
                f"correlated disturbance {name!r}: spectra have shape {matrix.shape}, but {len(sources)} inputs and "
                f"{len(hertz)} frequencies need {(len(sources), len(sources), len(hertz))}."
            )
        own = np.einsum("iif->if", matrix).real
        size = np.sqrt(own[:, None] * own[None, :])
        correlation = np.where(size > 0, matrix / np.where(size > 0, size, 1.0), np.eye(len(own))[:, :, None])
        psds = [PSD(hertz, row, source.unit, name) for row, source in zip(own, sources, strict=True)]
        return cls(name, sources, psds, correlation, hertz)

    def cross_spectra(self, frequencies: Array) -> Complex:
        """Return the (n, n, n_freq) matrix of one-sided cross spectra at frequencies [Hz]."""
        root = np.sqrt([psd.at(frequencies) for psd in self.psds])
        own: Complex = root[:, None] * root[None, :] * self._correlation_at(frequencies)
        return own

    def _correlation_at(self, frequencies: Array) -> Complex:
        if self.frequencies is None:
            return self.correlation[:, :, None]
        # A mean of two matrices that signals can have is one again, so straight lines keep the matrix definite.
        upper = np.clip(np.searchsorted(self.frequencies, frequencies), 1, len(self.frequencies) - 1)
        f1, f2 = self.frequencies[upper - 1], self.frequencies[upper]
        share = np.clip((frequencies - f1) / (f2 - f1), 0.0, 1.0)
        between: Complex = (1 - share) * self.correlation[:, :, upper - 1] + share * self.correlation[:, :, upper]
        return between


@dataclass(frozen=True, init=False)
class Tone:
    """A sinusoid on one input, as of a pump or an unbalance.

    Parameters
    ----------
    name : how results call it.
    input : Force, Torque or BaseMotion that it acts through.
    amplitude : peak, in the unit of the input.
    frequency : [Hz].

    Raises
    ------
    ModelError : a name or an input that is none, an amplitude or a frequency that is not above 0.

    Notes
    -----
    Its mean square is amplitude² / 2; in a cumulative spectrum it is a step.
    """

    name: str
    input: Input
    amplitude: float
    frequency: float

    @known_keywords
    def __init__(self, name: str, input: Input, amplitude: float, frequency: float) -> None:
        what = _checked_name(name, "tone")
        (source,) = checked_inputs(input)
        _set(
            self,
            name=name,
            input=source,
            amplitude=number(amplitude, f"{what}: amplitude", source.unit, above=0.0),
            frequency=number(frequency, f"{what}: frequency", "Hz", above=0.0),
        )


AnyDisturbance = Disturbance | CorrelatedDisturbance | Tone


def checked_disturbances(disturbances: object) -> tuple[AnyDisturbance, ...]:
    """Return disturbances as a tuple; a single one is taken as a list of one.

    Raises
    ------
    ModelError : empty, something that is no disturbance, or two of one name.
    """
    listed = list(disturbances) if isinstance(disturbances, (list, tuple)) else [disturbances]
    found = [d for d in listed if isinstance(d, (Disturbance, CorrelatedDisturbance, Tone))]
    for item in listed:
        if not isinstance(item, (Disturbance, CorrelatedDisturbance, Tone)):
            raise ModelError(f"disturbances must be Disturbance, CorrelatedDisturbance or Tone, got {item!r}.")
    if not found:
        raise ModelError("disturbances are empty; give at least one.")
    names = [d.name for d in found]
    for name in names:
        if names.count(name) > 1:
            raise ModelError(f"{names.count(name)} disturbances are called {name!r}; names must differ.")
    return tuple(found)


def _psd_of(psd: PSD | tuple[ArrayLike, ArrayLike], source: Input, what: str) -> PSD:
    if isinstance(psd, PSD):
        try:
            return psd.to(source.unit)
        except ModelError as error:
            raise ModelError(f"{what}: {source.name!r} takes {source.unit}. {error}") from None
    if not isinstance(psd, (tuple, list)) or len(psd) != 2:
        raise ModelError(f"{what}: psd must be an ibs.PSD, or (frequencies, values), got {psd!r}.")
    return PSD(psd[0], psd[1], source.unit, what)


def _checked_correlation(matrix: Complex, n: int, hertz: Array | None, what: str) -> Complex:
    wanted = (n, n) if hertz is None else (n, n, len(hertz))
    if matrix.shape != wanted or (hertz is not None and len(hertz) < 2):
        raise ModelError(f"{what}: correlation has shape {matrix.shape}, it needs {wanted}, two frequencies at least.")
    stack = np.moveaxis(matrix.reshape(n, n, -1), -1, 0)
    if not np.isfinite(stack).all() or np.abs(stack - stack.conj().swapaxes(1, 2)).max() > INDEFINITE:
        raise ModelError(f"{what}: correlation must be finite and Hermitian, S_ij the conjugate of S_ji.")
    if np.abs(np.einsum("fii->fi", stack) - 1).max() > INDEFINITE:
        raise ModelError(f"{what}: correlation must have ones on its diagonal; the powers are in the PSDs.")
    lowest = float(np.linalg.eigvalsh(stack).min())
    if lowest < -INDEFINITE:
        raise ModelError(
            f"{what}: no signals can have this correlation: its lowest eigenvalue is {lowest:.3g}, below 0. Signals "
            "that agree with a third one must agree with each other."
        )
    return matrix


def _checked_name(name: object, kind: str) -> str:
    if not isinstance(name, str) or not name.strip():
        raise ModelError(f"{kind}: the name must be a non-empty text, got {name!r}.")
    return f"{kind} {name!r}"


def _set(target: object, **fields: object) -> None:
    for field, value in fields.items():
        object.__setattr__(target, field, value)  # frozen: this is its constructor
