"""FRF estimates: against scipy, direct formulas, exact periodic responses and closed forms of nonlinear systems."""

import warnings

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from periodic_records import complex_normal, names_of, periodic_run

import ibsdyn as ibs
from ibsdyn.identification import cross_spectra
from ibsdyn.identification.blackman_tukey import blackman_tukey_spectra, lag_window, relative_width
from ibsdyn.identification.channels import checked_channels
from ibsdyn.identification.confidence import circle_quantile, marginal_quantile
from ibsdyn.identification.effective_averages import Averages, after_regression
from ibsdyn.identification.welch import segment_averages, welch_spectra

FS = 1000.0


def noise_record(seed=0, n=30_000, inputs=1, output_noise=0.3, input_noise=0.0, fs=FS, title="record"):
    """White inputs through short filters, noise on both sides; the response is known in closed form."""
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((inputs, n))
    y = sum((k + 1.0) * scipy.signal.lfilter([1.0, 0.4 + 0.1 * k], [1.0], u[k]) for k in range(inputs))
    y = y + output_noise * rng.standard_normal(n)
    names, _ = names_of(inputs, 1)
    measured = u + input_noise * rng.standard_normal(u.shape)
    return ibs.TimeRecord([*measured, y], [*names, "y1"], ["N"] * inputs + ["m"], fs, title=title)


def true_response(frequencies, inputs=1, fs=FS):
    z = np.exp(-2j * np.pi * frequencies / fs)
    return np.array([[(k + 1.0) * (1 + (0.4 + 0.1 * k) * z) for k in range(inputs)]])


def resonant_record(fn=50.0, zeta=0.01, n=100_000, seed=0):
    w = 2 * np.pi * fn
    system = scipy.signal.bilinear([1], [1 / w**2, 2 * zeta / w, 1], FS)
    u = np.random.default_rng(seed).standard_normal(n)
    return ibs.TimeRecord([u, scipy.signal.lfilter(*system, u)], ["force", "Y1"], ["N", "m"], FS)


# --- spectra against scipy and against the direct formula


@pytest.mark.parametrize(("window", "overlap"), [("hann", 0.5), ("blackman", 0.75), ("boxcar", 0.0)])
def test_welch_is_scipys(window, overlap):
    record = noise_record()
    estimate = ibs.estimate_frf(record, "u1", "y1", "welch", window=window, window_length=512, overlap=overlap)
    settings_ = {"fs": FS, "window": window, "nperseg": 512, "noverlap": round(512 * overlap)}
    f, s_yu = scipy.signal.csd(record["u1"], record["y1"], **settings_)  # scipy conjugates the first
    _, s_uu = scipy.signal.welch(record["u1"], **settings_)
    _, coherence = scipy.signal.coherence(record["u1"], record["y1"], **settings_)
    np.testing.assert_allclose(estimate.frequencies, f[1:-1])
    np.testing.assert_allclose(estimate.response[0, 0], (s_yu / s_uu)[1:-1], rtol=1e-11)
    np.testing.assert_allclose(estimate.coherence[0], coherence[1:-1], rtol=1e-9)


@pytest.mark.parametrize("window", ["hann", "bartlett", "parzen"])
def test_blackman_tukey_is_the_direct_formula_over_the_whole_record(window):
    record, lags = noise_record(n=20_001), 100
    u, y = (record[name] - record[name].mean() for name in ("u1", "y1"))
    tau = np.arange(-lags, lags + 1)
    weight = lag_window(window, lags)[np.abs(tau)]

    def spectrum(a, b, f):
        n = len(a)
        covariance = [a[max(t, 0) : n + min(t, 0)] @ b[max(-t, 0) : n - max(t, 0)] / n for t in tau]
        return np.exp(-2j * np.pi * np.outer(f, tau) / FS) @ (weight * covariance)

    lines = np.array([3.7, 50.0, 210.5])
    for asked in (None, lines):
        estimate = ibs.estimate_frf(
            record, "u1", "y1", "spectral", window=window, window_length=lags, frequencies=asked
        )
        f = estimate.frequencies
        phi_u, phi_yu, phi_y = spectrum(u, u, f).real, spectrum(y, u, f), spectrum(y, y, f).real
        np.testing.assert_allclose(estimate.response[0, 0], phi_yu / phi_u, rtol=1e-10)
        # Var = W/N Phi_v / Phi_u, made unbiased by n_d / (n_d - 1) to the first order of 1 / n_d
        n_d = len(u) / np.sum(weight**2 * (1 - np.abs(tau) / len(u)))
        variance = (phi_y - abs(phi_yu) ** 2 / phi_u) / phi_u / (n_d - 1)
        np.testing.assert_allclose(estimate.variance[0, 0], variance, rtol=0.2 / n_d)
        assert estimate.n_averages == pytest.approx(n_d)
    assert list(f) == list(lines)


@pytest.mark.parametrize(
    "spectra", [lambda c: blackman_tukey_spectra(c, 60, "hann", None), lambda c: welch_spectra(c, 256, "hann", 0.5)]
)
def test_blocks_do_not_show(spectra, monkeypatch):
    records = [noise_record(seed=1, n=40_000, inputs=2), noise_record(seed=2, n=25_111, inputs=2)]
    channels = checked_channels(records, ["u1", "u2"], ["y1"])
    whole = spectra(channels)
    monkeypatch.setattr("ibsdyn.identification.welch.BLOCK_SAMPLES", 5000)
    monkeypatch.setattr("ibsdyn.identification.blackman_tukey.BLOCK_SAMPLES", 5000)
    np.testing.assert_allclose(spectra(channels).matrix, whole.matrix, rtol=1e-10, atol=1e-12 * abs(whole.matrix).max())
    monkeypatch.setattr(cross_spectra, "cpu_count", lambda: 1)
    np.testing.assert_allclose(spectra(channels).matrix, whole.matrix, rtol=1e-10, atol=1e-12 * abs(whole.matrix).max())


def test_windows_have_the_published_sums_and_widths():
    for window, total in (("hann", 0.75), ("bartlett", 2 / 3), ("parzen", 0.539)):
        half = lag_window(window, 2000)
        assert (2 * half @ half - half[0] ** 2) / 2000 == pytest.approx(total, rel=2e-3)
    # Hann of 2 M samples is 2 bins wide at half height; a triangle's transform is sinc^2, at half height at 0.443.
    assert relative_width("hann") == pytest.approx(1.0, rel=1e-3)
    assert relative_width("bartlett") == pytest.approx(0.886, rel=1e-3)


def test_overlapping_segments_are_worth_fewer_averages():
    hann = scipy.signal.get_window("hann", 4096)
    rho = (1 / 6) ** 2  # half overlapped Hann segments
    assert segment_averages(hann, 2048, [63]).effective == pytest.approx(63 / (1 + 2 * (62 / 63) * rho), rel=1e-3)
    assert segment_averages(hann, 2048, [40, 23]).effective == pytest.approx(63 / (1 + 2 * (61 / 63) * rho), rel=1e-3)
    assert segment_averages(hann, 4096, [20]).effective == pytest.approx(20)


def test_a_regression_leaves_what_equal_averages_say_and_what_random_projections_of_unequal_ones_say():
    equal = after_regression(Averages(np.ones(8), 2.5), 6)
    assert equal.residual_share == pytest.approx(14 / 20)
    assert equal.per_average == pytest.approx(1 / 20)
    assert equal.degrees_of_freedom == pytest.approx(14)
    assert after_regression(Averages(np.ones(6), 1.0), 6).degrees_of_freedom == 0
    # Monte Carlo of the regression itself: inputs and noise in 30 terms of unequal weight
    rng = np.random.default_rng(0)
    weights = np.linspace(0.05, 1.95, 30)
    u = np.sqrt(weights) * complex_normal(rng, (20_000, 5, 30))
    v = np.sqrt(weights) * complex_normal(rng, (20_000, 1, 30))
    inverse = np.linalg.inv(u @ u.conj().transpose(0, 2, 1))
    error = v @ u.conj().transpose(0, 2, 1) @ inverse
    power = np.mean(abs(v - error @ u) ** 2, axis=(1, 2))
    found = after_regression(Averages(weights, 1.0), 5)
    assert found.residual_share == pytest.approx(power.mean(), rel=0.01)
    assert found.degrees_of_freedom == pytest.approx(power.mean() ** 2 / power.var(), rel=0.05)
    scatter = np.mean(abs(error[:, 0]) ** 2 / np.einsum("fjj->fj", inverse).real) / 30
    assert found.per_average == pytest.approx(scatter, rel=0.04)


def test_quantiles_are_those_of_scipy_and_the_published_ones():
    nu = np.array([1.0, 2.0, 5.0, 11.0, 30.5])
    np.testing.assert_allclose(circle_quantile(0.99, nu), scipy.stats.f.ppf(0.99, 2, 2 * nu), rtol=1e-10)
    np.testing.assert_allclose(circle_quantile(0.99, np.array([2.0, 5.0, 11.0])), [18.0, 7.56, 5.72], rtol=1e-3)
    assert circle_quantile(0.99, np.array(1e9)) == pytest.approx(4.605, rel=1e-4)
    assert marginal_quantile(0.99, np.array(1e9)) == pytest.approx(1.82, rel=1e-3)


# --- estimators


@pytest.mark.parametrize(("method", "length"), [("welch", 1000), ("spectral", 300)])
def test_several_inputs_are_told_apart_and_the_region_holds_the_truth(method, length):
    estimate = ibs.estimate_frf(
        noise_record(n=200_000, inputs=3), ["u1", "u2", "u3"], "y1", method, window_length=length
    )
    error = abs(estimate.response - true_response(estimate.frequencies, 3))
    assert estimate.response.shape == (1, 3, len(estimate.frequencies))
    assert np.mean(error < estimate.radius(0.99)) > 0.975
    assert np.mean(error < estimate.radius(0.5)) < 0.6


def test_h1_h2_and_hv_differ_as_the_noise_says():
    clean, on_input = noise_record(n=400_000), noise_record(n=400_000, output_noise=0.0, input_noise=0.5)

    def gain(record, kind):
        estimate = ibs.estimate_frf(record, "u1", "y1", "welch", window_length=256, estimator=kind)
        return np.median(abs(estimate.response / true_response(estimate.frequencies)))

    assert gain(clean, "H1") == pytest.approx(1.0, abs=5e-3)
    assert gain(on_input, "H2") == pytest.approx(1.0, abs=5e-3)
    assert gain(on_input, "H1") == pytest.approx(1 / 1.25, abs=5e-3)  # 1 / (1 + 0.5^2)
    h1, h2, hv = (
        ibs.estimate_frf(on_input, "u1", "y1", "welch", window_length=256, estimator=kind).response[0, 0]
        for kind in ("H1", "H2", "Hv")
    )
    np.testing.assert_allclose(abs(hv), np.sqrt(abs(h1 * h2)), rtol=1e-9)
    np.testing.assert_allclose(np.angle(hv / h1), 0, atol=1e-9)
    np.testing.assert_allclose(np.angle(h2 / h1), 0, atol=1e-9)


def test_hv_of_several_inputs_takes_out_noise_that_is_on_all_channels():
    """Every channel has 10 % of its own power as noise: H1 is low by 1 / 1.1, Hv right, and so are its regions."""
    clean = noise_record(n=400_000, inputs=2, output_noise=0.0)
    # Noise with the spectrum of its channel, so that its share is the same at every frequency.
    others = [noise_record(seed=seed, n=400_000, inputs=2, output_noise=0.0) for seed in (11, 12, 13)]
    noise = [np.sqrt(0.1) * other.signals[channel] for channel, other in enumerate(others)]
    signals = clean.signals + np.array(noise)
    record = ibs.TimeRecord(signals, clean.names, clean.units, FS)
    estimates = {
        kind: ibs.estimate_frf(record, ["u1", "u2"], "y1", "welch", window_length=256, estimator=kind)
        for kind in ("H1", "Hv")
    }
    true = true_response(estimates["Hv"].frequencies, inputs=2)
    for kind, expected in (("H1", 1 / 1.1), ("Hv", 1.0)):
        ratios = abs(estimates[kind].response / true)
        np.testing.assert_allclose(np.median(ratios, axis=-1)[0], expected, atol=1e-2)
    inside = np.abs(estimates["Hv"].response - true) < estimates["Hv"].radius(0.99)
    assert inside.mean() > 0.97
    assert (np.abs(estimates["Hv"].response - true) < estimates["Hv"].radius(0.5)).mean() < 0.6


def test_h2_of_two_by_two_inverts_the_reverse_regression_and_covers():
    rng = np.random.default_rng(5)
    gain = np.array([[1.0, 0.3], [-0.2, 0.8]])
    u = rng.standard_normal((2, 300_000))
    measured = u + 0.4 * rng.standard_normal(u.shape)
    record = ibs.TimeRecord([*measured, *(gain @ u)], ["u1", "u2", "y1", "y2"], ["N"] * 2 + ["m"] * 2, FS)
    estimate = ibs.estimate_frf(record, ["u1", "u2"], ["y1", "y2"], "welch", window_length=2000, estimator="H2")
    inside = abs(estimate.response - gain[:, :, None]) < estimate.radius(0.99)
    assert np.mean(inside, axis=2).min() > 0.975
    assert np.mean(abs(estimate.response - gain[:, :, None]) < estimate.radius(0.5)) < 0.6
    with pytest.raises(ibs.RecordError, match="as many outputs as inputs"):
        ibs.estimate_frf(record, ["u1", "u2"], ["y1"], "welch", estimator="H2")


def test_default_windows_suit_the_shortest_of_several_records():
    records = [noise_record(seed=1, n=50_000), noise_record(seed=2, n=1000)]
    for method in ("welch", "spectral"):
        estimate = ibs.estimate_frf(records, "u1", "y1", method)
        assert np.mean(abs(estimate.response - true_response(estimate.frequencies)) < estimate.radius(0.99)) > 0.95


def test_coherences():
    record = noise_record(n=400_000, inputs=2)
    estimate = ibs.estimate_frf(record, ["u1", "u2"], "y1", "welch", window_length=256)
    g = true_response(estimate.frequencies, 2)[0]
    power = abs(g[0]) ** 2 + abs(g[1]) ** 2
    np.testing.assert_allclose(estimate.coherence[0], power / (power + 0.09), atol=0.01)
    np.testing.assert_allclose(estimate.partial_coherence[0, 0], abs(g[0]) ** 2 / (abs(g[0]) ** 2 + 0.09), atol=0.03)
    one = ibs.estimate_frf(record, "u1", "y1", "welch", window_length=256)
    np.testing.assert_allclose(one.partial_coherence[0, 0], one.coherence[0], rtol=1e-9)
    np.testing.assert_allclose(one.coherence[0], abs(g[0]) ** 2 / (power + 0.09), atol=0.06)


@settings(max_examples=10, deadline=None)
@given(a=st.floats(1e-6, 1e6), b=st.floats(1e-6, 1e6), method=st.sampled_from(["welch", "spectral"]))
def test_units_only_scale(a, b, method):
    record = noise_record(n=4000)
    scaled = ibs.TimeRecord([a * record["u1"], b * record["y1"]], ["u1", "y1"], ["N", "m"], FS)
    one, other = (ibs.estimate_frf(r, "u1", "y1", method, window_length=100) for r in (record, scaled))
    np.testing.assert_allclose(other.response, one.response * b / a, rtol=1e-9)
    np.testing.assert_allclose(other.radius(0.9), one.radius(0.9) * b / a, rtol=1e-7)
    np.testing.assert_allclose(other.coherence, one.coherence, rtol=1e-9)


# --- periodic excitation


def _responses(rng, n_out, n_in, n_lines):
    return complex_normal(rng, (n_out, n_in, 1)) + 0.3 * complex_normal(rng, (n_out, n_in, n_lines))


@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
def test_nine_runs_of_six_inputs_give_the_exact_response_without_noise():
    rng = np.random.default_rng(1)
    harmonics = np.arange(5, 80)
    response = _responses(rng, 6, 6, len(harmonics))
    runs = [periodic_run(rng, response, harmonics, 256, 2) for _ in range(9)]
    estimate = ibs.estimate_frf(runs, *names_of(6, 6))
    np.testing.assert_allclose(estimate.response, response, atol=1e-11)
    np.testing.assert_allclose(estimate.frequencies, harmonics * 1000.0 / 256)
    assert estimate.radius(0.99).max() < 1e-5
    np.testing.assert_allclose(estimate.coherence, 1.0)
    assert estimate.outputs == ("y1", "y2", "y3", "y4", "y5", "y6")
    assert estimate.unit(0, 0) == "(m/s²)/N"


def test_noise_and_distortion_levels_are_what_was_put_in():
    rng = np.random.default_rng(2)
    harmonics = np.arange(10, 3000)
    response = np.ones((1, 1, len(harmonics)))
    runs = [periodic_run(rng, response, harmonics, 8192, 4, output_noise=0.2, distortion=0.3) for _ in range(10)]
    estimate = ibs.estimate_frf(runs, "u1", "y1")
    # 10 runs of 4 periods, input amplitude 1
    assert np.mean(estimate.noise_level**2) == pytest.approx(0.2**2 / 40, rel=0.05)
    assert np.mean(estimate.distortion_level**2) == pytest.approx(0.3**2 / 10, rel=0.08)
    assert np.mean(estimate.variance) == pytest.approx(0.2**2 / 40 + 0.3**2 / 10, rel=0.05)
    # in one period the output holds 1 + 0.09 + 0.04
    assert np.mean(estimate.coherence) == pytest.approx(1 / 1.13, abs=0.02)
    assert estimate.n_averages == 40
    assert estimate.degrees_of_freedom[0] == 9


def test_covariance_between_responses_is_the_scatter_of_many_estimates():
    rng = np.random.default_rng(3)
    n_lines = 4000
    harmonics = np.arange(1, n_lines + 1)
    response = np.ones((2, 2, n_lines))
    phases = [complex_normal(rng, (2, 1)) * np.ones((2, n_lines)) for _ in range(4)]  # same at all lines: inputs depend
    runs = [periodic_run(rng, response, harmonics, 2 * n_lines + 4, 1, 0.1, phases=phase) for phase in phases]
    estimate = ibs.estimate_frf(runs, *names_of(2, 2))
    error = estimate.response - response
    for (i, j), (k, m) in [((0, 0), (0, 0)), ((0, 0), (0, 1)), ((1, 0), (1, 1)), ((0, 0), (1, 1))]:
        scatter = np.mean(error[i, j] * error[k, m].conj())
        told = np.mean(estimate.covariance(i, j, k, m))
        size = np.sqrt(np.mean(estimate.variance[i, j]) * np.mean(estimate.variance[k, m]))
        assert abs(scatter - told) < 5 * size / np.sqrt(n_lines)
    assert abs(np.mean(estimate.covariance("y1", "u1", "y1", "u2"))) > 0.1 * np.mean(estimate.variance[0])
    np.testing.assert_allclose(estimate.covariance("y2", "u1", "y2", "u1").real, estimate.variance[1, 0])


@pytest.mark.parametrize("orthogonal", [True, False])
def test_best_linear_approximation_of_a_cubic_with_several_inputs(orthogonal):
    # y = u1 + 0.1 v^3 + 0.2 u2^2, v = u1 + u2 + 0.5 u3: for Gaussian inputs of variance 1 the best linear gain of
    # input j is [j = 1] + 0.1 * 3 * var(v) * dv/du_j, var(v) = 2.25 (Bussgang).
    rng = np.random.default_rng(4)
    lines = np.arange(1, 601, 2)
    period = 4096
    fourier = np.exp(2j * np.pi * np.outer(range(3), range(3)) / 3)
    runs = []
    for _ in range(8):
        phase = np.exp(2j * np.pi * rng.random((3, len(lines))))
        for e in range(3):
            spectrum = np.zeros((3, period // 2 + 1), dtype=complex)
            other = np.exp(2j * np.pi * rng.random((3, len(lines))))
            spectrum[:, lines] = phase * fourier[:, [e]] if orthogonal else other
            u = np.fft.irfft(spectrum, period) * period / 2 / np.sqrt(len(lines) / 2)
            v = u[0] + u[1] + 0.5 * u[2]
            y = u[0] + 0.1 * v**3 + 0.2 * u[1] ** 2
            runs.append(ibs.TimeRecord([*u, y], ["a", "b", "c", "y"], ["N"] * 4, FS, period=period))
    estimate = ibs.estimate_frf(runs, ["a", "b", "c"], "y")
    expected = np.array([1.675, 0.675, 0.3375])[None, :, None]
    np.testing.assert_allclose(estimate.response.mean(axis=2), expected[:, :, 0], atol=0.02)
    inside = abs(estimate.response - expected) < estimate.radius(0.99)
    assert 0.98 < inside.mean() < 0.998  # 900 values; their mean over lines is off by 1/F of the cubic's
    assert estimate.detection_lines.amplitude[0, ~estimate.detection_lines.odd].mean() > 0.01


def test_detection_lines_tell_even_from_odd_distortions():
    t = 2 * np.pi * np.arange(64) / 64
    for power, harmonic, amplitude in ((2, 2, 1.5), (3, 5, 2.25)):
        # (cos t + cos 3t)^2 holds 1.5 cos 2t; (cos t + cos 3t + cos 7t)^3 is expanded below
        u = np.cos(t) + np.cos(3 * t) + (np.cos(7 * t) if power == 3 else 0)
        record = ibs.TimeRecord(np.tile([u, 2 * u + 0.01 * u**power], 3), ["u", "y"], ["N", "m"], 64.0, period=64)
        with pytest.warns(ibs.RecordWarning, match="noise between periods only"):
            lines = ibs.estimate_frf(record, "u", "y", frequencies=[1, 3] if power == 2 else [1, 3, 7]).detection_lines
        found = dict(zip(lines.harmonics, lines.amplitude[0], strict=True))
        if power == 3:  # the coefficient of cos 5t, by multiplying out: 3/4 (1+1+3) + 6/4 (-1+3+... ) in numbers:
            amplitude = 2 * np.mean(u**3 * np.cos(5 * t))
        assert found[harmonic] == pytest.approx(0.01 * amplitude, rel=1e-9)
        assert bool(lines.odd[list(lines.harmonics).index(harmonic)]) == (power == 3)
        assert lines.noise.max() < 1e-12


def test_excited_lines_are_found_where_the_amplitude_varies_over_frequency():
    rng = np.random.default_rng(6)
    harmonics = np.arange(1, 400, 2)
    harmonics = harmonics[rng.random(len(harmonics)) < 0.75]
    u = np.zeros(2001, dtype=complex)
    u[harmonics] = harmonics**2 * np.exp(2j * np.pi * rng.random(len(harmonics)))  # 104 dB from first to last
    x = np.tile(np.fft.irfft(u, 4000), 2)
    record = ibs.TimeRecord([x, 3 * x], ["u", "y"], ["N", "m"], 4000.0, period=4000)
    with pytest.warns(ibs.RecordWarning, match="noise between periods"):
        estimate = ibs.estimate_frf(record, "u", "y")
    np.testing.assert_array_equal(np.rint(estimate.frequencies), harmonics)


def _lines_found(amplitudes, noise=0.0, periods=2):
    """Return the harmonics taken for excited of an input with these amplitudes {harmonic: amplitude}."""
    rng = np.random.default_rng(15)
    spectrum = np.zeros(2001, dtype=complex)
    spectrum[list(amplitudes)] = list(amplitudes.values())
    spectrum *= np.exp(2j * np.pi * rng.random(2001)) * 2000
    x = np.tile(np.fft.irfft(spectrum, 4000), periods)
    measured = x + noise * rng.standard_normal(x.shape)
    record = ibs.TimeRecord([measured, 3 * x], ["u", "y"], ["N", "m"], 4000.0, period=4000)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ibs.RecordWarning)
        return set(np.rint(ibs.estimate_frf(record, "u", "y").frequencies).astype(int))


@pytest.mark.parametrize("periods", [1, 2])
def test_distortions_of_the_shaker_beyond_its_band_are_no_excitation(periods):
    band = dict.fromkeys(range(20, 400), 1.0)
    assert _lines_found(band | dict.fromkeys(range(400, 1500), 0.005), periods=periods) == set(band)


def test_noise_is_no_excitation():
    band = dict.fromkeys(range(20, 400), 1.0)
    assert _lines_found(band, noise=1.0, periods=4) == set(band)


def test_bands_apart_and_logarithmic_lines_are_found():
    two = dict.fromkeys([*range(20, 100), *range(900, 1000)], 1.0)
    assert _lines_found(two) == set(two)
    sparse = {int(k): 1.0 for k in np.geomspace(10, 1500, 12)}  # 37 % from one line to the next
    assert _lines_found(sparse) == set(sparse)
    dense = {int(k): float(k**2) for k in np.unique(np.geomspace(4, 1500, 120).astype(int))}
    assert _lines_found(dense) == set(dense)


@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
def test_only_the_last_whole_periods_count_and_transients_can_be_dropped():
    rng = np.random.default_rng(7)
    harmonics = np.arange(3, 60)
    response = _responses(rng, 1, 1, len(harmonics))
    clean = periodic_run(rng, response, harmonics, 200, 6)
    signals = clean.signals + 0.02 * rng.standard_normal(clean.signals.shape)
    signals[1] += 30 * np.exp(-np.arange(1200) / 40.0)
    signals = np.hstack([100 * rng.standard_normal((2, 77)), signals])  # left-over samples stand at the beginning
    record = ibs.TimeRecord(signals, ["u1", "y1"], ["N", "m/s²"], 1000.0, period=200)
    with pytest.warns(ibs.RecordWarning, match="noise between periods"):
        estimate = ibs.estimate_frf(record, "u1", "y1", drop_periods=2)
    assert np.mean(abs(estimate.response - response) < estimate.radius(0.99)) > 0.9
    assert estimate.n_averages == 4


# --- what the result is


def test_a_band_keeps_the_statistics():
    estimate = ibs.estimate_frf(noise_record(inputs=2), ["u1", "u2"], "y1", method="welch")
    band = estimate.within(100.0, 200.0)
    kept = (estimate.frequencies >= 100.0) & (estimate.frequencies <= 200.0)
    np.testing.assert_array_equal(band.frequencies, estimate.frequencies[kept])
    np.testing.assert_array_equal(band.radius(0.9), estimate.radius(0.9)[..., kept])
    np.testing.assert_array_equal(band.coherence, estimate.coherence[..., kept])
    with pytest.raises(ibs.AnalysisError, match="no line lies from 600 to 700 Hz"):
        estimate.within(600, 700)


def test_selection_keeps_the_statistics():
    rng = np.random.default_rng(8)
    harmonics = np.arange(3, 90, 2)
    runs = [periodic_run(rng, _responses(rng, 3, 2, len(harmonics)), harmonics, 200, 2, 0.1) for _ in range(4)]
    estimate = ibs.estimate_frf(runs, *names_of(2, 3))
    part = estimate.select(["y3", "y1"], "u2")
    assert isinstance(part, ibs.FrfEstimate)
    np.testing.assert_array_equal(part.response, estimate.response[[2, 0]][:, [1]])
    np.testing.assert_array_equal(part.radius(0.9), estimate.radius(0.9)[[2, 0]][:, [1]])
    np.testing.assert_array_equal(part.noise_level, estimate.noise_level[[2, 0]][:, [1]])
    np.testing.assert_array_equal(part.distortion_level, estimate.distortion_level[[2, 0]][:, [1]])
    np.testing.assert_array_equal(part.coherence, estimate.coherence[[2, 0]])
    np.testing.assert_array_equal(part.covariance("y3", "u2", "y1", "u2"), estimate.covariance("y3", "u2", "y1", "u2"))
    np.testing.assert_array_equal(part.detection_lines.amplitude, estimate.detection_lines.amplitude[[2, 0]])
    assert part.detection_lines.outputs == ("y3", "y1")
    with pytest.raises(ibs.UnknownNameError, match="Did you mean 'y1'"):
        estimate.select("Y1")
    with pytest.raises(AttributeError):
        estimate.response = None


def test_bounds_of_magnitude_and_phase():
    estimate = ibs.estimate_frf(noise_record(n=20_000), "u1", "y1", "welch", window_length=500)
    r, size = estimate.radius(0.99), estimate.magnitude
    low, high = estimate.magnitude_bounds(0.99)
    np.testing.assert_allclose(high - size, r)
    np.testing.assert_allclose(low, np.maximum(size - r, 0))
    narrow = estimate.magnitude_bounds(0.99, circle=False)
    assert np.all(narrow[1] < high)
    below, above = estimate.phase_bounds(0.99)
    np.testing.assert_allclose(np.sin(np.radians(above - estimate.phase)), r / size, rtol=1e-9)
    np.testing.assert_allclose(estimate.phase - below, above - estimate.phase)
    silent = ibs.estimate_frf(noise_record(output_noise=1e4), "u1", "y1", "welch", window_length=500)
    below, above = silent.phase_bounds(0.99)
    assert (above - below).max() == pytest.approx(360)
    assert silent.magnitude_bounds(0.99)[0].min() == 0


def test_the_figure_shows_the_band_and_says_what_it_is():
    estimate = ibs.estimate_frf(noise_record(n=20_000), "u1", "y1", "welch", window_length=500)
    axes = estimate.plot(label="test", confidence=0.95)
    assert axes.shape == (2, 1)
    words = [text.get_text() for text in axes[0, 0].get_legend().get_texts()]
    assert words == ["test", "95 % region: circle in the complex plane, F-statistics"]
    low, high = estimate.magnitude_bounds(0.95)
    band = axes[0, 0].collections[0].get_paths()[0].vertices[:, 1]
    assert band.max() == pytest.approx(high.max())
    assert band.min() == pytest.approx(np.maximum(low, 1e-3 * estimate.magnitude).min())


def test_the_band_of_a_phase_about_180_degrees_does_not_jump():
    rng = np.random.default_rng(0)
    u = rng.standard_normal(20_000)
    record = ibs.TimeRecord([u, -u + 0.3 * rng.standard_normal(u.size)], ["u", "y"], ["N", "m"], 1000.0)
    estimate = ibs.estimate_frf(record, "u", "y", "welch", window_length=1024)
    assert np.abs(np.diff(estimate.phase[0, 0])).max() > 300  # the line itself does
    bands = estimate.plot()[1, 0].collections
    heights = [path.vertices[:, 1] for band in bands for path in band.get_paths()]
    assert max(np.abs(np.diff(height[1:-1])).max() for height in heights) < 100
    # ... and it is there on both sides
    assert min(h.min() for h in heights) < -180 < 180 < max(h.max() for h in heights)


def test_it_says_what_it_is():
    text = repr(ibs.estimate_frf(noise_record(n=20_000), "u1", "y1", "spectral", window_length=500))
    assert "spectral analysis, Hann lag window of 500 samples" in text
    assert "53.64 averages, resolution 2 Hz" in text  # 20000 / (0.75 500) and the ends, 1000 / 500


# --- what is warned of


@pytest.mark.parametrize("method", ["welch", "spectral"])
def test_a_resonance_narrower_than_the_resolution_is_told_and_the_cure_works(method):
    record = resonant_record(zeta=0.01)  # 1 Hz wide at 50 Hz
    with pytest.warns(ibs.RecordWarning, match=r"'Y1' over 'force' has a resonance at (49|50)") as caught:
        coarse = ibs.estimate_frf(record, "force", "Y1", method, resolution=1.0)
    assert coarse.magnitude.max() < 0.9 * 50  # 1 / (2 zeta)
    words = str(caught[0].message)
    assert "a record" in words
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fine = ibs.estimate_frf(record, "force", "Y1", method, resolution=0.2)
    assert fine.magnitude.max() == pytest.approx(50, rel=0.05)
    assert fine.resolution == pytest.approx(0.2, rel=1e-2)


def test_lines_too_far_apart_for_a_resonance_are_told():
    harmonics = np.arange(1, 400)
    f = harmonics * 1.0
    response = (1 / (1 - (f / 50.3) ** 2 + 2j * 0.005 * f / 50.3))[None, None]
    rng = np.random.default_rng(9)
    runs = [periodic_run(rng, response, harmonics, 1000, 1, 1e-3) for _ in range(3)]
    with pytest.warns(ibs.RecordWarning, match=r"lines stand 1 Hz apart.*a period of at least \d"):
        ibs.estimate_frf(runs, "u1", "y1")


def test_too_little_data_has_no_region():
    rng = np.random.default_rng(10)
    run = periodic_run(rng, np.ones((1, 1, 50)), np.arange(1, 51), 200, 1)
    with pytest.warns(ibs.RecordWarning, match="one period in each of 1 runs"):
        estimate = ibs.estimate_frf(run, "u1", "y1")
    np.testing.assert_allclose(estimate.response, 1.0)
    assert np.isnan(estimate.coherence).all()
    with pytest.raises(ibs.AnalysisError, match="no degree of freedom"):
        estimate.radius(0.99)
    assert len(estimate.plot()[0, 0].collections) == 0
    with pytest.warns(ibs.RecordWarning, match="1 averages for 1 inputs"):
        estimate = ibs.estimate_frf(noise_record(n=1000), "u1", "y1", "welch", window_length=1000)
    with pytest.raises(ibs.AnalysisError, match="Measure longer"):
        estimate.magnitude_bounds()


@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
def test_noise_passed_as_periodic_is_refused_and_a_drifting_clock_told():
    noise = noise_record(n=10_000)
    with pytest.raises(ibs.RecordError, match="no line that repeats itself every 1000 samples"):
        ibs.estimate_frf(noise, "u1", "y1", period=1000)
    rng = np.random.default_rng(11)
    run = periodic_run(rng, np.ones((1, 1, 300)), np.arange(1, 301), 1000, 8)
    with pytest.raises(ibs.RecordError, match="Check the period"):
        ibs.estimate_frf(ibs.TimeRecord(run.signals, run.names, run.units, FS, period=998), "u1", "y1")
    drifted = [np.interp(np.arange(7990) * 1.0002, np.arange(8000), row) for row in run.signals]
    with pytest.warns(ibs.RecordWarning, match="clocks that drift"):
        ibs.estimate_frf(ibs.TimeRecord(drifted, run.names, run.units, FS, period=1000), "u1", "y1")


def test_a_transient_is_told():
    rng = np.random.default_rng(12)
    run = periodic_run(rng, np.ones((1, 1, 50)), np.arange(1, 51), 200, 5)
    signals = run.signals.copy()
    signals[0] += 0.02 * np.exp(-np.arange(1000) / 60.0) * np.sin(np.arange(1000) * 0.3)
    record = ibs.TimeRecord(signals, run.names, run.units, FS, period=200)
    with pytest.warns(ibs.RecordWarning) as caught:
        ibs.estimate_frf(record, "u1", "y1")
    assert any("a transient. Leave it out (drop_periods=)" in str(w.message) for w in caught)


def test_a_lag_window_that_makes_power_negative_is_told():
    rng = np.random.default_rng(13)
    line = np.sin(2 * np.pi * 100.3 * np.arange(20_000) / FS)
    noise = rng.standard_normal((2, 20_000))
    quiet = {"u1": noise[0], "y1": 1e-3 * noise[1] + line}
    for channels, warned in ((quiet, True), ({"u1": line + 1e-3 * noise[0], "y1": noise[1]}, False)):
        record = ibs.TimeRecord(list(channels.values()), list(channels), ["N", "m"], FS)
        if warned:
            with pytest.warns(ibs.RecordWarning, match="negative at .* frequencies.*parzen"):
                ibs.estimate_frf(record, "u1", "y1", "spectral", window_length=200)
        else:
            with pytest.raises(ibs.RecordError, match="'u1' has negative power"):
                ibs.estimate_frf(record, "u1", "y1", "spectral", window_length=200)
        ibs.estimate_frf(record, "u1", "y1", "spectral", window_length=200, window="parzen")


# --- what is refused


def _two_runs(**changes):
    first = noise_record(seed=1, n=2000, title="run 1")
    given_ = {
        "signals": first.signals,
        "names": first.names,
        "units": first.units,
        "sample_rate": FS,
        "title": "run 2",
    } | changes
    return [first, ibs.TimeRecord(**given_)]


@pytest.mark.parametrize(
    ("records", "options", "error", "words"),
    [
        (_two_runs(sample_rate=500.0), {}, ibs.RecordError, "record 2 .run 2. has 500 Hz.*resample"),
        (_two_runs(units=["kN", "m"]), {}, ibs.RecordError, "'u1' is in kN in record 2"),
        (_two_runs(names=["u1", "Y9"]), {}, ibs.UnknownNameError, "run 2: no channel 'y1'"),
        (_two_runs(), {"outputs": ["u1"]}, ibs.RecordError, "among inputs and outputs"),
        (_two_runs(), {"inputs": []}, ibs.RecordError, "inputs must be one or several"),
        (_two_runs(), {"inputs": ["u1", "u1"]}, ibs.RecordError, "'u1' 2 times"),
        ([], {}, ibs.RecordError, "TimeRecord or a list"),
        (None, {}, ibs.RecordError, "TimeRecord or a list"),
        (_two_runs(), {"method": "welsh"}, ibs.AnalysisError, "Did you mean 'welch'"),
        (_two_runs(), {"drop_periods": 1}, ibs.AnalysisError, "belongs to method 'multisine'"),
        (_two_runs(), {"window": "hanning?"}, ibs.AnalysisError, "not known to scipy"),
        (_two_runs(), {"window_length": 5000}, ibs.RecordError, "2000 samples, a segment 5000"),
        (_two_runs(), {"window_length": 100, "resolution": 1.0}, ibs.AnalysisError, "not both"),
        (_two_runs(), {"overlap": 1.0}, ibs.AnalysisError, "below 1, as 0.5"),
        (_two_runs(), {"overlap": 50}, ibs.AnalysisError, "below 1, as 0.5"),
        (_two_runs(), {"estimator": "H3"}, ibs.AnalysisError, "'H3' is not known"),
        (_two_runs(), {"resolution": -1.0}, ibs.AnalysisError, "positive number of Hz"),
        (_two_runs(), {"resolution": 900.0}, ibs.AnalysisError, "too coarse"),
        (_two_runs(), {"method": "spectral", "window_length": 1000}, ibs.RecordError, "more than twice as many"),
        (_two_runs(), {"method": "spectral", "window": "hamming"}, ibs.AnalysisError, "'hamming' is not known"),
        (_two_runs(), {"method": "spectral", "frequencies": [600.0]}, ibs.AnalysisError, "half the sample rate"),
        (_two_runs(), {"method": "spectral", "frequencies": [50.0, 50.0]}, ibs.AnalysisError, "must rise"),
        (_two_runs(), {"method": "multisine"}, ibs.RecordError, "has no period"),
        (_two_runs(period=500), {"method": "multisine", "period": 400}, ibs.RecordError, "500 samples, not the 400"),
        (
            _two_runs(period=500),
            {"method": "multisine", "period": 500, "drop_periods": 4},
            ibs.RecordError,
            "nothing is left",
        ),
        (
            _two_runs(),
            {"method": "multisine", "period": 500, "frequencies": [3.0]},
            ibs.RecordError,
            "multiples of 2 Hz",
        ),
        (_two_runs(), {"wndow": "hann"}, ibs.UnknownKeywordError, "Did you mean 'window'"),
    ],
)
def test_what_cannot_be_right_is_refused(records, options, error, words):
    given_ = {"inputs": ["u1"], "outputs": ["y1"], "method": "welch"} | options
    with pytest.raises(error, match=words):
        ibs.estimate_frf(records, **given_)


def test_dead_channels_and_dependent_inputs_are_named():
    record = noise_record(n=5000)
    dead = ibs.TimeRecord([record["u1"], np.ones(5000)], ["u1", "y1"], ["N", "m"], FS)
    with pytest.raises(ibs.RecordError, match=r"'y1' of record 1 .* constant at 1"):
        ibs.estimate_frf(dead, "u1", "y1", "welch")
    u = record["u1"]
    twice = ibs.TimeRecord([u, 3 * u, record["y1"]], ["u1", "u2", "y1"], ["N", "N", "m"], FS)
    with pytest.raises(ibs.RecordError, match=r"2 inputs moved in only 1 independent ways.*'u1', 'u2' depend"):
        ibs.estimate_frf(twice, ["u1", "u2"], "y1", "welch", window_length=100)


def test_periodic_runs_too_few_or_alike_are_refused():
    rng = np.random.default_rng(14)
    harmonics = np.arange(1, 40)
    response = np.ones((1, 2, len(harmonics)))
    runs = [periodic_run(rng, response, harmonics, 100, 3) for _ in range(2)]
    with pytest.raises(ibs.RecordError, match="2 inputs need at least 2 runs"):
        ibs.estimate_frf(runs[:1], ["u1", "u2"], "y1")
    with pytest.raises(ibs.RecordError, match=r"only 1 independent ways at .* Hz"):
        ibs.estimate_frf([runs[0], runs[0]], ["u1", "u2"], "y1")
    other = periodic_run(rng, response, harmonics, 150, 3)
    with pytest.raises(ibs.RecordError, match="their lines differ"):
        ibs.estimate_frf([runs[0], other], ["u1", "u2"], "y1")
