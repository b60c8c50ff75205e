"""From records to a frequency response with its region, by the method asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from numbers import Integral, Real

import numpy as np
import scipy.signal

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError, RecordWarning, known_keywords, nearest, warn_user
from ibsdyn.identification import blackman_tukey, welch
from ibsdyn.identification.channels import Channels, checked_channels
from ibsdyn.identification.cross_spectra import CrossSpectra
from ibsdyn.identification.estimators import ESTIMATORS, Regression, h1, h2, hv
from ibsdyn.identification.frf_estimate import FrfEstimate
from ibsdyn.identification.periodic import periodic_estimate
from ibsdyn.resonances import find_resonances
from ibsdyn.time_record import TimeRecord

# Which options mean something to which method.
_OPTIONS = {
    "multisine": ("period", "drop_periods", "frequencies"),
    "spectral": ("window", "window_length", "resolution", "frequencies"),
    "welch": ("window", "window_length", "resolution", "overlap", "estimator"),
}
# Where no window length is given: so many of them in the records, about 27 averages, ...
_WINDOWS = 20
# ... and not longer than this, so that hours of data stay within bounded memory.
_LONGEST = 1 << 15
# Width of a resonance over the resolution that keeps its peak within about 6 %; lines need two in the width.
_WIDTH_OVER_RESOLUTION = {"multisine": 2.0, "spectral": 3.0, "welch": 3.0}


@known_keywords
def estimate_frf(
    records: TimeRecord | Sequence[TimeRecord],
    inputs: str | Sequence[str],
    outputs: str | Sequence[str],
    method: str = "multisine",
    *,
    period: int | None = None,
    drop_periods: int | None = None,
    frequencies: Sequence[float] | Array | None = None,
    window: str | None = None,
    window_length: int | None = None,
    resolution: float | None = None,
    overlap: float | None = None,
    estimator: str | None = None,
) -> FrfEstimate:
    """Return the frequency response between channels of records, with its confidence region.

    Parameters
    ----------
    records : one or several runs; several inputs of periodic excitation need at least as many runs.
    inputs, outputs : names of channels.
    method : "multisine" for periodic excitation; "spectral" (Blackman-Tukey, MATLAB's ``spa``) or "welch" for any.
    period : samples in a period; as the records say if None. [multisine]
    drop_periods : whole periods left out at the beginning of each record, default 0. [multisine]
    frequencies : excited lines [Hz], found in the inputs if None [multisine]; where to evaluate, (n_freq,) [Hz], all
        lines of the window if None [spectral].
    window : lag window "hann" (default), "bartlett" or "parzen" [spectral]; any of ``scipy.signal.get_window``,
        default "hann" [welch].
    window_length : lags on either side [spectral] or samples of a segment [welch]; default a twentieth of all samples,
        up to 32768 and a quarter of the shortest record.
    resolution : width of the spectral window at half height [Hz], in place of ``window_length``. [spectral, welch]
    overlap : share of a segment that the next one repeats, default 0.5. [welch]
    estimator : "H1" (noise on the outputs, default), "H2" (on the inputs) or "Hv" (on all). [welch]

    Returns
    -------
    FrfEstimate, a FrequencyResponse with ``variance``, ``radius(confidence)``, ``coherence`` and more.

    Raises
    ------
    UnknownNameError : a channel that a record does not have.
    RecordError : records that do not belong together or do not suit the method; too short or too few for what is
        asked; inputs that depend on each other; records said to be periodic that are not.
    AnalysisError : an unknown method or option, or an option of another method.

    Warns
    -----
    RecordWarning : resonances narrower than the resolution can show; a region that cannot hold all it should; a
        transient; scatter between periods that noise hardly explains.

    Notes
    -----
    Inputs are regressed on together: with six inputs a response is one column of G = S_yu S_uu^-1, never the ratio of
    two channels. Each channel's mean is removed. 0 Hz and the Nyquist frequency are left out.
    """
    if method not in _OPTIONS:
        raise AnalysisError(f"method {method!r} is not known. {nearest(str(method), _OPTIONS)}")
    given = {
        "period": period,
        "drop_periods": drop_periods,
        "frequencies": frequencies,
        "window": window,
        "window_length": window_length,
        "resolution": resolution,
        "overlap": overlap,
        "estimator": estimator,
    }
    for option, value in given.items():
        if value is not None and option not in _OPTIONS[method]:
            others = [name for name, options in _OPTIONS.items() if option in options]
            raise AnalysisError(
                f"{option}= belongs to method {' and '.join(map(repr, others))}; {method!r} takes "
                f"{', '.join(_OPTIONS[method])}."
            )
    channels = checked_channels(records, inputs, outputs)
    lines = None if frequencies is None else _checked_frequencies(frequencies, channels.sample_rate)
    if method == "multisine":
        estimate = _multisine(
            channels,
            None if period is None else _whole(period, "period", 2),
            0 if drop_periods is None else _whole(drop_periods, "drop_periods", 0),
            lines,
        )
    elif method == "spectral":
        chosen = _choice(window or "hann", "window", blackman_tukey.LAG_WINDOWS)
        lags = _length(channels, window_length, resolution, blackman_tukey.relative_width(chosen))
        spectra = blackman_tukey.blackman_tukey_spectra(channels, lags, chosen, lines)
        words = f"spectral analysis, {chosen.capitalize()} lag window of {lags} samples"
        estimate = _from_spectra(channels, spectra, h1(spectra, channels.n_inputs, _names(channels)), words)
    else:
        taper = _known_window(window or "hann")
        kind = _choice(estimator or "H1", "estimator", ESTIMATORS)
        length = _length(channels, window_length, resolution, welch.relative_width(taper))
        share = 0.5 if overlap is None else _share(overlap)
        spectra = welch.welch_spectra(channels, length, taper, share)
        regression = {"H1": h1, "H2": h2, "Hv": hv}[kind](spectra, channels.n_inputs, _names(channels))
        words = f"Welch {kind}, {taper.capitalize()} segments of {length} samples, {100 * share:.0f} % overlap"
        estimate = _from_spectra(channels, spectra, regression, words)
    _warn_of_narrow_peaks(estimate, method)
    return estimate


def _names(channels: Channels) -> tuple[str, ...]:
    return (*channels.inputs, *channels.outputs)


def _multisine(channels: Channels, period: int | None, drop_periods: int, lines: Array | None) -> FrfEstimate:
    found = periodic_estimate(channels, period, drop_periods, lines)
    regression = found.regression
    noise_level = distortion_level = None
    if found.noise_variance is not None:
        noise_level = np.sqrt(found.noise_variance).transpose(1, 2, 0)
    runs = len(channels.records)
    words = f"periodic excitation, {found.n_averages:g} periods in {runs} run{'s' if runs > 1 else ''}"
    estimate = replace(
        _estimate(channels, regression, found.frequencies, words, found.n_averages, found.spacing),
        noise_level=noise_level,
        detection_lines=found.detection_lines,
    )
    if noise_level is not None and runs > channels.n_inputs:
        # What scatters between runs beyond the noise; where noise alone scatters more by chance, none is seen.
        distortion_level = np.sqrt(np.maximum(estimate.variance - noise_level**2, 0.0))
    return replace(estimate, distortion_level=distortion_level)


def _from_spectra(channels: Channels, spectra: CrossSpectra, regression: Regression, words: str) -> FrfEstimate:
    if regression.degrees_of_freedom <= 0:
        warn_user(
            f"{spectra.averages.effective:.3g} averages for {channels.n_inputs} inputs leave nothing to estimate a "
            "variance with: the response has no confidence region. Take a shorter window (window_length=) or measure "
            "longer.",
            RecordWarning,
        )
    return _estimate(channels, regression, spectra.frequencies, words, spectra.averages.effective, spectra.resolution)


def _estimate(
    channels: Channels, regression: Regression, frequencies: Array, words: str, n_averages: float, resolution: float
) -> FrfEstimate:
    """Name what a regression found; it has frequency first, an estimate last."""
    return FrfEstimate(
        frequencies=frequencies,
        response=regression.response.transpose(1, 2, 0),
        outputs=channels.outputs,
        inputs=channels.inputs,
        output_units=channels.output_units,
        input_units=channels.input_units,
        method=words,
        coherence=regression.coherence.T,
        partial_coherence=regression.partial_coherence.transpose(1, 2, 0),
        residual_covariance=regression.residual.transpose(1, 2, 0),
        input_gain=regression.gain.transpose(1, 2, 0),
        degrees_of_freedom=np.full(len(frequencies), float(regression.degrees_of_freedom)),
        n_averages=n_averages,
        resolution=resolution,
    )


def _warn_of_narrow_peaks(estimate: FrfEstimate, method: str) -> None:
    if not np.all(estimate.degrees_of_freedom > 0):
        return  # nothing tells a resonance from noise
    peaks = find_resonances(estimate, estimate.variance)
    needed = _WIDTH_OVER_RESOLUTION[method]
    narrow = [peak for peak in peaks if peak.width < needed * estimate.resolution]
    if not narrow:
        return
    worst = min(narrow, key=lambda peak: peak.width)
    places = len({round(peak.frequency / estimate.resolution) for peak in narrow})
    # The window widens a peak by about its own width: what is left is the resonance's.
    goal = max(worst.width - (estimate.resolution if method != "multisine" else 0.0), 0.25 * worst.width) / needed
    if method == "multisine":
        effect = f"lines stand {estimate.resolution:.3g} Hz apart: its top and its damping fall between them"
        cure = f"a period of at least {1 / goal:.3g} s with every line excited puts {needed:.0f} lines in that width"
    else:
        effect = f"the resolution is {estimate.resolution:.3g} Hz: the peak is drawn too low and too wide"
        factor = estimate.resolution / goal
        cure = (
            f"resolution={goal:.2g} or finer, a window {factor:.3g} times as long, is needed, and for the same "
            f"{estimate.n_averages:.3g} averages a record {factor:.3g} times as long"
        )
    more = f" ({places} resonances are as narrow)" if places > 1 else ""
    warn_user(
        f"{estimate.outputs[worst.output]!r} over {estimate.inputs[worst.input]!r} has a resonance at "
        f"{worst.frequency:.4g} Hz no wider than {worst.width:.2g} Hz (half power), but {effect}; {cure}{more}.",
        RecordWarning,
    )


def _length(channels: Channels, window_length: int | None, resolution: float | None, width: float) -> int:
    """Return the window's length [samples]; ``width`` is its resolution times length over sample rate."""
    if window_length is not None and resolution is not None:
        raise AnalysisError("give window_length= or resolution=, not both; one follows from the other.")
    if window_length is not None:
        return _whole(window_length, "window_length", 4)
    if resolution is None:
        longest = min(_LONGEST, min(channels.n_samples) // 4)  # of one record, several averages
        return max(min(sum(channels.n_samples) // _WINDOWS, longest), 4)
    if isinstance(resolution, bool) or not isinstance(resolution, Real) or not 0 < resolution < np.inf:
        raise AnalysisError(f"resolution must be a positive number of Hz, got {resolution!r}.")
    length = int(np.ceil(width * channels.sample_rate / float(resolution)))
    if length < 4:
        raise AnalysisError(f"resolution={resolution:g} Hz is too coarse for {channels.sample_rate:g} Hz of sampling.")
    return length


def _whole(value: object, what: str, minimum: int) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < minimum:
        raise AnalysisError(f"{what} must be a whole number, {minimum} at least, got {value!r}.")
    return int(value)


def _share(overlap: object) -> float:
    if isinstance(overlap, bool) or not isinstance(overlap, Real) or not 0 <= float(overlap) < 1:
        raise AnalysisError(f"overlap must be a share from 0 to below 1, as 0.5, got {overlap!r}.")
    return float(overlap)


def _choice(value: str, what: str, known: tuple[str, ...]) -> str:
    for name in known:
        if str(value).lower() == name.lower():
            return name
    raise AnalysisError(f"{what} {value!r} is not known. {nearest(str(value), known)}")


def _known_window(name: str) -> str:
    try:
        scipy.signal.get_window(name, 8)
    except (ValueError, TypeError) as error:
        raise AnalysisError(f"window {name!r} is not known to scipy.signal.get_window: {error}") from error
    return name


def _checked_frequencies(frequencies: Sequence[float] | Array, sample_rate: float) -> Array:
    try:
        lines = np.atleast_1d(np.asarray(frequencies, dtype=float))
    except (TypeError, ValueError):
        lines = np.empty(0)
    if lines.ndim != 1 or lines.size == 0 or not np.isfinite(lines).all():
        raise AnalysisError(f"frequencies must be finite numbers [Hz], got {frequencies!r}.")
    if lines.min() <= 0 or lines.max() >= sample_rate / 2 or np.any(np.diff(lines) <= 0):
        raise AnalysisError(
            f"frequencies must rise, from above 0 to below half the sample rate, {sample_rate / 2:g} Hz; they go from "
            f"{lines.min():g} to {lines.max():g} Hz."
        )
    return lines
