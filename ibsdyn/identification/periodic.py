"""Responses to periodic excitation: periods averaged first, then least squares over the runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError, RecordWarning, warn_user
from ibsdyn.identification.channels import Channels
from ibsdyn.identification.cross_spectra import ComplexArray
from ibsdyn.identification.estimators import ROUNDING, Regression, inverse_power, partial_coherence
from ibsdyn.identification.excited_lines import excited_lines, harmonics_of
from ibsdyn.identification.frf_estimate import DetectionLines

# Share of the inputs' power that may differ from period to period: above the first a warning, above the second none
# of it is what the period says.
SUSPICIOUS, NOT_PERIODIC = 0.1, 0.5
# The first period differs from the others by so many times what they differ by from each other.
TRANSIENT = 10.0


@dataclass(frozen=True, eq=False)
class PeriodicEstimate:
    """What periodic records say.

    Attributes
    ----------
    frequencies : (n_freq,) of the excited lines [Hz].
    regression : over runs, or over periods where there are no more runs than inputs.
    noise_variance : (n_freq, n_out, n_in) of the response, by scatter between periods; None with one period.
    detection_lines : harmonics that were not excited.
    spacing : typical distance of excited lines [Hz].
    n_averages : runs times periods.
    """

    frequencies: Array
    regression: Regression
    noise_variance: Array | None
    detection_lines: DetectionLines | None
    spacing: float
    n_averages: float


@dataclass(frozen=True, eq=False)
class _Periods:
    """Whole periods of one record after those dropped."""

    record: int
    begin: int
    length: int
    count: int


def periodic_estimate(
    channels: Channels, period: int | None, drop_periods: int, frequencies: Array | None
) -> PeriodicEstimate:
    """Return the response at the excited lines.

    Parameters
    ----------
    channels : inputs and outputs.
    period : samples; as the records say if None.
    drop_periods : whole periods left out at the beginning of each record, while transients die out.
    frequencies : excited lines [Hz]; found in the inputs' spectra if None.

    Raises
    ------
    RecordError : records without period, or of different periods; too few periods or runs; inputs that depend on
        each other; inputs that are not periodic.

    Warns
    -----
    RecordWarning : scatter between periods that noise does not explain; a region that holds noise only, or none.

    Notes
    -----
    G = Y U^H (U U^H)^-1 over all runs' mean periods; the covariance of what is left over has runs less inputs degrees
    of freedom and holds noise and stochastic nonlinear distortions alike. The scatter of Y - G U between the periods
    of a run holds the noise alone, of inputs and outputs. Pintelon and Schoukens, System Identification, chapters 2 to
    4.
    """
    runs = _runs(channels, period, drop_periods)
    length = runs[0].length
    means = np.stack([_mean_period(channels, run) for run in runs])  # (runs, count, length)
    spectra = np.asarray(scipy.fft.rfft(means, axis=2)) * (2.0 / length)  # amplitudes
    harmonics = np.arange(length // 2 + 1)
    base = channels.sample_rate / length
    usable = (harmonics > 0) & (2 * harmonics < length)
    q = channels.n_inputs
    scatter_of_inputs = _input_scatter(channels, runs, means)
    if frequencies is None:
        shrink = float(np.mean([1 / run.count for run in runs]))
        excited = harmonics[usable & excited_lines(np.abs(spectra[:, :q]), scatter_of_inputs, shrink)]
        if len(excited) == 0:
            raise RecordError(
                f"{channels.records[0].title}: the inputs show no line that repeats itself every {length} samples. "
                'Check period and clocks, take method="welch" or "spectral", or name the lines (frequencies=[...]).'
            )
    else:
        excited = harmonics_of(frequencies, base, length)
    if scatter_of_inputs is not None:
        _check_strongest(
            channels, len(excited), np.mean(np.abs(spectra[:, :q]) ** 2, axis=0), scatter_of_inputs, length
        )
    quiet = harmonics[usable & (harmonics < excited.max())]
    quiet = quiet[~np.isin(quiet, excited)]

    hertz = np.multiply(excited, base, dtype=np.float64)
    lines = spectra[:, :, excited].transpose(2, 1, 0)  # (n_freq, count, runs)
    U, Y = lines[:, :q], lines[:, q:]
    if len(runs) < q:
        raise RecordError(
            f"{q} inputs need at least {q} runs with different excitation, {len(runs)} were given; add runs, or leave "
            "inputs out."
        )
    gain = inverse_power(U @ U.conj().transpose(0, 2, 1), hertz, channels.inputs)
    response = Y @ U.conj().transpose(0, 2, 1) @ gain
    left = Y - response @ U

    scatter, quiet_scatter, share = _scatter(channels, runs, means, excited, quiet, response)
    _check_periodic(channels, runs, share, np.mean(np.abs(U) ** 2, axis=(0, 2)))

    periods = sum(run.count for run in runs)
    spare = periods - len(runs)
    between = len(runs) - q
    noise = scatter / spare * np.mean([1 / run.count for run in runs]) if spare > 0 else None
    power = np.einsum("fir,fir->fi", Y, Y.conj()).real / len(runs)
    if between > 0:
        residual, nu = left @ left.conj().transpose(0, 2, 1) / between, between
    elif noise is not None:
        residual, nu = noise, spare
        warn_user(
            f"{len(runs)} run{'s' if len(runs) > 1 else ''} for {q} input{'s' if q > 1 else ''}: the confidence region "
            "holds the noise between periods only. Nonlinear distortions repeat with every period; more runs with "
            "other random phases show them.",
            RecordWarning,
        )
    else:
        residual, nu = np.full_like(left @ left.conj().transpose(0, 2, 1), np.nan), 0
        warn_user(
            f"one period in each of {len(runs)} runs for {q} inputs leaves nothing to estimate a variance with: the "
            "response has no confidence region. Record two periods or more, or more runs.",
            RecordWarning,
        )
    residual = _floored(residual, ROUNDING * power)
    coherence, partial = _coherences(runs, Y, left, scatter, gain, response, spare + between > 0)
    regression = Regression(response, residual, gain, coherence, partial, nu)
    noise_variance = None
    if noise is not None:
        noise_variance = np.einsum("fii->fi", noise).real[:, :, None] * np.einsum("fjj->fj", gain).real[:, None, :]
    gaps = np.diff(excited)
    return PeriodicEstimate(
        hertz,
        regression,
        noise_variance,
        _detection_lines(channels, runs, spectra, excited, quiet, quiet_scatter, response, base),
        float(np.median(gaps) if len(gaps) else 1) * base,
        float(periods),
    )


def _runs(channels: Channels, period: int | None, drop_periods: int) -> list[_Periods]:
    runs: list[_Periods] = []
    for number, record in enumerate(channels.records):
        where = f"record {number + 1} ({record.title})"
        length = record.period if period is None else period
        if length is None:
            raise RecordError(
                f'{where} has no period; give the samples of one (period=) or take method="welch" or "spectral".'
            )
        if record.period is not None and record.period != length:
            raise RecordError(f"{where} has a period of {record.period} samples, not the {length} asked for.")
        if runs and runs[0].length != length:
            raise RecordError(
                f"{where} has a period of {length} samples, record 1 of {runs[0].length}: their lines differ; estimate "
                "them apart."
            )
        count = record.n_samples // length - drop_periods
        if count < 1:
            raise RecordError(
                f"{where} has {record.n_samples // length} whole periods of {length} samples, {drop_periods} of them "
                "dropped (drop_periods=); nothing is left."
            )
        # The last whole periods: what is left over goes with the transient at the beginning.
        runs.append(_Periods(number, record.n_samples - count * length, length, count))
    return runs


def _period(channels: Channels, run: _Periods, number: int) -> Array:
    begin = run.begin + number * run.length
    return channels.read(run.record, begin, begin + run.length)


def _mean_period(channels: Channels, run: _Periods) -> Array:
    total = np.zeros((channels.count, run.length))
    for number in range(run.count):
        total += _period(channels, run, number)
    return total / run.count


def _input_scatter(channels: Channels, runs: list[_Periods], means: Array) -> Array | None:
    """Return the variance of the inputs' lines from period to period, (n_in, n_harmonics); None with one period."""
    q, spare = channels.n_inputs, sum(run.count - 1 for run in runs)
    if spare == 0:
        return None
    squares = np.zeros((q, runs[0].length // 2 + 1))
    for run, mean in zip(runs, means, strict=True):
        for number in range(run.count if run.count > 1 else 0):
            deviation = _period(channels, run, number)[:q] - mean[:q]
            squares += np.abs(np.asarray(scipy.fft.rfft(deviation, axis=1)) * (2.0 / run.length)) ** 2
    squares[:, 0] = 0.0
    return squares / spare


def _scatter(
    channels: Channels,
    runs: list[_Periods],
    means: Array,
    excited: NDArray[np.int64],
    quiet: NDArray[np.int64],
    response: ComplexArray,
) -> tuple[ComplexArray, Array, list[list[Array]]]:
    """Return how periods differ from the mean of their run.

    Returns
    -------
    (n_freq, n_out, n_out) summed products of Y - G U at excited lines, (n_out, n_quiet) summed squares of the outputs
    at others, and for each run and period (n_in,) mean squares of the inputs at excited lines.
    """
    q, n_out = channels.n_inputs, channels.count - channels.n_inputs
    products = np.zeros((len(excited), n_out, n_out), dtype=np.complex128)
    quiet_squares = np.zeros((n_out, len(quiet)))
    shares: list[list[Array]] = []
    for run, mean in zip(runs, means, strict=True):
        shares.append([])
        if run.count < 2:
            continue
        for number in range(run.count):
            # Subtracted over time, where it costs no digits: noise may be far below the signal.
            deviation = np.asarray(scipy.fft.rfft(_period(channels, run, number) - mean, axis=1)) * (2.0 / run.length)
            at_lines = deviation[:, excited]
            unexplained = at_lines[q:].T - np.einsum("fij,jf->fi", response, at_lines[:q])
            products += unexplained[:, :, None] * unexplained[:, None, :].conj()
            quiet_squares += np.abs(deviation[q:, quiet]) ** 2
            shares[-1].append(np.mean(np.abs(at_lines[:q]) ** 2, axis=1))
    return products, quiet_squares, shares


def _check_strongest(channels: Channels, count: int, power: Array, scatter: Array, length: int) -> None:
    """Refuse inputs whose strongest lines do not repeat: with a wrong period only the weakest seem to.

    Parameters
    ----------
    count : how many lines are excited.
    power, scatter : (n_in, n_harmonics) mean square of mean periods and variance of single ones.
    """
    single = power + scatter
    single[:, 0] = 0.0
    strongest = np.argpartition(single, -count, axis=1)[:, -count:]
    noise = np.take_along_axis(scatter, strongest, axis=1).sum(axis=1)
    share = float((noise / np.take_along_axis(single, strongest, axis=1).sum(axis=1)).min())
    if share > NOT_PERIODIC:
        raise RecordError(
            f"the inputs do not repeat themselves every {length} samples: {100 * share:.0f} % of the power of their "
            f"{count} strongest lines differs from period to period, in record 1 ({channels.records[0].title}) or "
            'another. Check the period and the clocks, or take method="welch" or "spectral".'
        )


def _check_periodic(channels: Channels, runs: list[_Periods], shares: list[list[Array]], power: Array) -> None:
    for run, deviations in zip(runs, shares, strict=True):
        if run.count < 2:
            continue
        record = channels.records[run.record]
        where = f"record {run.record + 1} ({record.title})"
        squares = np.array(deviations)  # (periods, n_in)
        noise = squares.sum(axis=0) / (run.count - 1)
        # An input that rests in this run scatters as much as it moves; the one with most power must repeat itself.
        share = float((noise / (noise + power)).min())
        if share > NOT_PERIODIC:
            raise RecordError(
                f"{where} does not repeat itself every {run.length} samples: {100 * share:.0f} % of the inputs' power "
                'differs from period to period. Check the period and the clocks, or take method="welch" or "spectral".'
            )
        if share > SUSPICIOUS:
            warn_user(
                f"{where}: {100 * share:.0f} % of the inputs' power differs from one period of {run.length} samples to "
                "the next: much noise, a period that is not exact, or clocks that drift.",
                RecordWarning,
            )
        if run.count > 2:
            first, others = squares[0].sum(), squares[1:].sum(axis=1)
            if first > TRANSIENT * others.max():
                warn_user(
                    f"{where}: the first period differs from the others {np.sqrt(first / others.max()):.0f} times more "
                    "than they do from each other: a transient. Leave it out (drop_periods=).",
                    RecordWarning,
                )


def _coherences(
    runs: list[_Periods],
    Y: ComplexArray,
    left: ComplexArray,
    scatter: ComplexArray,
    gain: ComplexArray,
    response: ComplexArray,
    known: bool,
) -> tuple[Array, Array]:
    """Return multiple and partial coherence of single periods, (n_freq, n_out) and (n_freq, n_out, n_in)."""
    if not known:
        return np.full(Y.shape[:2], np.nan), np.full(response.shape, np.nan)
    counts = np.array([run.count for run in runs])
    differs = np.einsum("fii->fi", scatter).real
    total = np.abs(Y) ** 2 @ counts + differs
    unexplained = np.abs(left) ** 2 @ counts + differs
    share = np.divide(unexplained, total, out=np.zeros_like(total), where=total > 0)
    return 1.0 - share, partial_coherence(response, unexplained / counts.mean(), gain)


def _detection_lines(
    channels: Channels,
    runs: list[_Periods],
    spectra: ComplexArray,
    excited: NDArray[np.int64],
    quiet: NDArray[np.int64],
    squares: Array,
    response: ComplexArray,
    base: float,
) -> DetectionLines | None:
    inside = quiet > excited.min()  # only between excited lines is the linear response known
    if not inside.any():
        return None
    q = channels.n_inputs
    lines = quiet[inside]
    linear = np.empty((response.shape[1], q, len(lines)), dtype=np.complex128)
    for o in range(response.shape[1]):
        for i in range(q):
            linear[o, i] = np.interp(lines, excited, response[:, o, i])
    own = spectra[:, q:, lines] - np.einsum("oif,rif->rof", linear, spectra[:, :q, lines])
    spare = sum(run.count - 1 for run in runs)
    noise = np.full((response.shape[1], len(lines)), np.nan)
    if spare > 0:
        noise = np.sqrt(squares[:, inside] / spare * np.mean([1 / run.count for run in runs]))
    return DetectionLines(
        lines * base,
        lines,
        np.sqrt(np.mean(np.abs(own) ** 2, axis=0)),
        noise,
        channels.outputs,
        channels.output_units,
    )


def _floored(residual: ComplexArray, floor: Array) -> ComplexArray:
    """Keep rounding from making a variance zero: exactly periodic simulations have none."""
    floored: ComplexArray = residual.copy()
    diagonal = np.einsum("fii->fi", floored)
    diagonal[:] = np.maximum(diagonal.real, floor)  # NaN stays NaN
    return floored
