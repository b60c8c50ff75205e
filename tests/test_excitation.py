"""Excitations: lines, amplitudes, crest factors, power spectra, and what is refused."""

import matplotlib
import numpy as np
import pytest
import scipy.integrate
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

import ibsdyn as ibs
from ibsdyn.generalized_alpha import longest_step
from ibsdyn.multisine import common_period
from ibsdyn.prescribed_motion import displacement_table

matplotlib.use("Agg")
RATE = 1000.0


def by_definition(sine, time):
    """sum A_k cos(2 pi f_k t + phi_k), line by line."""
    return sum(
        a * np.cos(2 * np.pi * f * time + p) for a, f, p in zip(sine.amplitudes, sine.lines, sine.phases, strict=True)
    )


@settings(max_examples=20, deadline=None)
@given(
    st.sampled_from([0.5, 1.0, 2.5, 4.0, 8.0]),
    st.sets(st.integers(1, 50), min_size=1, max_size=12),
    st.sampled_from(["random", "low-crest"]),
    st.integers(0, 1000),
)
def test_the_samples_are_the_sum_of_the_lines(base, numbers, phases, seed):
    lines = base * np.array(sorted(numbers))
    sine = ibs.multisine(lines, lambda f: 1 / (1 + f), sample_rate=RATE, phases=phases, seed=seed)
    assert sine.base_frequency * round(lines[0] / sine.base_frequency) == pytest.approx(lines[0], rel=1e-12)
    assert sine.n_samples * sine.base_frequency == pytest.approx(RATE)
    np.testing.assert_allclose(sine.samples, by_definition(sine, np.arange(sine.n_samples) / RATE), atol=1e-12)
    np.testing.assert_allclose(np.abs(sine.spectrum[sine.line_numbers]), 1 / (1 + lines), rtol=1e-9)
    assert sine.rms == pytest.approx(np.sqrt(np.sum(sine.amplitudes**2) / 2))
    np.testing.assert_allclose(
        sine.refined(3), by_definition(sine, np.arange(3 * sine.n_samples) / (3 * RATE)), atol=1e-12
    )


def test_a_period_is_the_shortest_that_holds_all_lines():
    assert ibs.multisine([10, 20, 30], 1.0, sample_rate=RATE).n_samples == 100
    assert ibs.multisine([10, 20, 30.5], 1.0, sample_rate=RATE).n_samples == 2000
    assert ibs.multisine([0.1 * 3, 0.7], 1.0, sample_rate=RATE).n_samples == 10_000
    assert ibs.multisine([10, 20], 1.0, sample_rate=RATE, base_frequency=0.5).n_samples == 2000


def test_bands_odd_lines_and_detection_lines():
    np.testing.assert_allclose(ibs.band_lines(10, 12, 0.5), [10, 10.5, 11, 11.5, 12])
    odd = ibs.band_lines(1, 40, 0.5, odd=True)
    assert np.all(np.round(odd / 0.5) % 2 == 1)
    thinned = ibs.band_lines(1, 40, 0.5, odd=True, detection=4, seed=3)
    assert set(thinned) < set(odd)
    groups = [odd[i : i + 4] for i in range(0, len(odd) - 3, 4)]
    assert all(len(set(group) - set(thinned)) == 1 for group in groups)
    sine = ibs.multisine(thinned, 1.0, sample_rate=RATE)
    assert sine.base_frequency == pytest.approx(0.5)
    assert set(odd) - set(thinned) - {odd[-1]} <= set(np.round(sine.detection_lines, 9))
    assert not np.isin(np.round(thinned, 9), np.round(sine.detection_lines, 9)).any()


def test_crest_factors():
    lines = ibs.band_lines(1, 100, 1)
    random = ibs.multisine(lines, 1.0, sample_rate=RATE)
    schroeder = ibs.multisine(lines, 1.0, sample_rate=RATE, phases="schroeder")
    optimised = ibs.multisine(lines, 1.0, sample_rate=RATE, phases="low-crest")
    assert random.crest_factor == pytest.approx(np.abs(random.samples).max() / np.std(random.samples))
    assert 2.5 < random.crest_factor < 4.5
    assert schroeder.crest_factor < 1.8  # 1.7 is what the literature has for flat, equidistant lines
    assert optimised.crest_factor < 1.6
    assert optimised.initial_crest_factor == pytest.approx(random.crest_factor)
    shaped = ibs.multisine(
        ibs.band_lines(1, 100, 0.5, odd=True, detection=4), lambda f: 1 / f, sample_rate=RATE, phases="low-crest"
    )
    assert shaped.crest_factor < 0.7 * shaped.initial_crest_factor
    with pytest.raises(ibs.ExcitationError, match="equidistant"):
        ibs.multisine([1, 2, 4, 8, 16], 1.0, sample_rate=RATE, phases="schroeder")
    with pytest.raises(ibs.ExcitationError, match="one amplitude"):
        ibs.multisine(lines, lambda f: 1 / f, sample_rate=RATE, phases="schroeder")


def test_realisations_differ_in_phase_only():
    sine = ibs.multisine(ibs.band_lines(1, 50, 1), 0.3, sample_rate=RATE, rms=2.0, seed=5)
    assert sine.rms == pytest.approx(2.0)
    several = sine.realisations(4)
    assert several[0] is sine
    assert len({tuple(one.phases) for one in several}) == 4
    for one in several:
        np.testing.assert_allclose(np.abs(one.spectrum), np.abs(sine.spectrum), atol=1e-12)
        np.testing.assert_allclose(one.samples, by_definition(one, np.arange(1000) / RATE), atol=1e-11)
    again = sine.realisations(7)
    np.testing.assert_array_equal(again[3].samples, several[3].samples)
    with pytest.raises(ibs.ExcitationError, match="random"):
        ibs.multisine([1.0, 2.0], 1.0, sample_rate=RATE, phases="low-crest").realisations(2)


@pytest.mark.parametrize(("matrix", "count"), [("dft", 3), ("dft", 6), ("hadamard", 4)])
def test_orthogonal_sets_have_a_unitary_matrix_at_every_line(matrix, count):
    sine = ibs.multisine(ibs.band_lines(1, 40, 1), lambda f: 1 + f, sample_rate=RATE)
    experiments = ibs.orthogonal_multisines(sine, count, matrix=matrix)
    spectra = np.array([[one.spectrum[one.line_numbers] for one in inputs] for inputs in experiments])
    for k in range(len(sine.lines)):
        U = spectra[:, :, k]
        np.testing.assert_allclose(U.conj().T @ U, count * sine.amplitudes[k] ** 2 * np.eye(count), atol=1e-9 * 41**2)
    with pytest.raises(ibs.ExcitationError, match="dft"):
        ibs.orthogonal_multisines(sine, 3, matrix="hadamard")


def test_noise_has_its_one_sided_psd():
    frequencies, psd = np.array([20.0, 100.0, 200.0]), np.array([1.0, 4.0, 2.0])
    noise = ibs.random_noise(frequencies, psd, sample_rate=RATE, duration=200.0, seed=1)
    area = scipy.integrate.trapezoid(psd, frequencies)
    assert noise.rms**2 == pytest.approx(area, rel=0.03)
    f, estimate = scipy.signal.welch(noise.samples, RATE, nperseg=1000)
    inside = (f > 25) & (f < 195)
    expected = np.interp(f, frequencies, psd)
    assert np.std(estimate[inside] / expected[inside] - 1) < 0.1  # 400 averages: 5 to 7 %
    assert np.mean(estimate[inside] / expected[inside]) == pytest.approx(1.0, abs=0.02)
    assert estimate[((f > 3) & (f < 15)) | (f > 210)].max() < 1e-3
    other = ibs.random_noise(frequencies, psd, sample_rate=RATE, duration=200.0, seed=2)
    assert abs(np.corrcoef(noise.samples, other.samples)[0, 1]) < 0.02
    flat = ibs.random_noise((20, 200), 3.0, sample_rate=RATE, duration=50.0)
    assert flat.rms == pytest.approx(np.sqrt(3.0 * 180), rel=0.05)


def test_sweeps_pass_through_their_frequencies():
    for scale, half_way in (("linear", 52.5), ("logarithmic", np.sqrt(5 * 100))):
        sweep = ibs.swept_sine(5.0, 100.0, 2.0, sample_rate=5000.0, duration=10.0, scale=scale)
        assert sweep.peak == pytest.approx(2.0, rel=1e-3)
        phase = np.unwrap(np.angle(scipy.signal.hilbert(sweep.samples)))
        frequency = np.gradient(phase) * 5000.0 / (2 * np.pi)
        for share, expected in ((0.05, None), (0.5, half_way), (0.95, None)):
            at = int(share * sweep.n_samples)
            if expected is None:
                expected = 5 + 95 * share if scale == "linear" else 5 * 20**share
            assert np.mean(frequency[at - 500 : at + 500]) == pytest.approx(expected, rel=0.02)
    low, high = ibs.swept_sine(20.0, 80.0, 1.0, sample_rate=RATE, duration=10.0).band(0.99)
    assert 15 < low < 22
    assert 78 < high < 90


def test_bursts_are_silent_between():
    burst = ibs.burst_random(10, 100, 0.5, sample_rate=RATE, frame=2.0, burst=0.4, frames=3, seed=2)
    frames = burst.samples.reshape(3, 2000)
    assert not frames[:, 800:].any()
    assert not np.array_equal(frames[0], frames[1])
    assert np.std(frames[:, 50:750]) == pytest.approx(0.5, rel=0.15)


@pytest.mark.parametrize("order", [1, 2])
def test_base_displacements_come_from_velocity_and_acceleration(order):
    """Against the analytic integrals of each line; a signal without period against SciPy's quadrature."""
    steps = 40
    sine = ibs.multisine([3.0, 10.0, 41.0], 1.0, sample_rate=RATE, seed=4)
    time = np.arange(steps * sine.n_samples) / (steps * RATE)
    s = 2j * np.pi * sine.lines
    exact = np.real((sine.amplitudes * np.exp(1j * sine.phases) / s**order) @ np.exp(np.outer(s, time)))
    np.testing.assert_allclose(displacement_table(sine, order, steps, "base"), exact, atol=1e-4 * np.abs(exact).max())
    sweep = ibs.swept_sine(5.0, 40.0, 1.0, sample_rate=RATE, duration=1.0)
    fine = np.arange(100_000) / 100_000
    expected = np.sin(2 * np.pi * (5 * fine + 35 * fine**2 / 2))
    for _ in range(order):
        expected = scipy.integrate.cumulative_trapezoid(expected, fine, initial=0)
    got = displacement_table(sweep, order, 10, "base")
    kept = slice(0, 9900)  # beyond the last sample nothing is known
    np.testing.assert_allclose(got[kept], expected[::10][kept], atol=1e-4 * np.abs(expected).max())


def test_other_rates_are_exact_for_what_is_periodic():
    sine = ibs.multisine([10.0, 30.0], [1.0, 2.0], sample_rate=RATE)
    for rate in (100.0, 1500.0, 4000.0):
        other = sine.at_rate(rate)
        np.testing.assert_allclose(other.samples, by_definition(sine, np.arange(other.n_samples) / rate), atol=1e-12)
    with pytest.raises(ibs.ExcitationError, match="above 60 Hz"):
        sine.at_rate(50.0)
    with pytest.raises(ibs.ExcitationError, match="whole number"):
        sine.at_rate(1234.5)
    with pytest.raises(ibs.ExcitationError, match="same sample_rate"):
        ibs.swept_sine(5, 40, 1.0, sample_rate=RATE, duration=1.0).at_rate(2000.0)
    assert common_period([sine, ibs.multisine([4.0], 1.0, sample_rate=RATE)]) == 500
    assert longest_step([10.0, 20.0], [1e-3, 1e-3]) == pytest.approx(np.sqrt(12e-3) / (2 * np.pi * 20))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ibs.multisine([10.0, 20.0]), "sample_rate="),
        (lambda: ibs.multisine(np.geomspace(1, 100, 9), 1.0, sample_rate=RATE), r"What would fit: base_frequency=0.77"),
        (lambda: ibs.multisine([1, 2], 1.0, sample_rate=RATE, base_frequency=0.3), "base_frequency=0.30003"),
        (lambda: ibs.multisine([1, 2.3], 1.0, sample_rate=RATE, base_frequency=0.5), "2.3 Hz is no multiple.*2.5 Hz"),
        (lambda: ibs.multisine([10, 600], 1.0, sample_rate=RATE), "above 1200 Hz"),
        (lambda: ibs.multisine([10, 10], 1.0, sample_rate=RATE), "twice"),
        (lambda: ibs.multisine([-1], 1.0, sample_rate=RATE), "above zero"),
        (lambda: ibs.multisine([1, 2], [1, 2, 3], sample_rate=RATE), r"shape \(3,\), but there are 2 lines"),
        (lambda: ibs.multisine([1, 2], [1, 0], sample_rate=RATE), "leave out the lines"),
        (lambda: ibs.multisine([1, 2], 1.0, sample_rate=RATE, phases="schroder"), "Did you mean 'schroeder'"),
        (lambda: ibs.multisine([1, 2], 1.0, sample_rate=RATE, phases=[1.0]), "2 finite numbers"),
        (lambda: ibs.multisine([1, 2], 1.0, sample_rate=RATE, periods=1.5), "whole number"),
        (lambda: ibs.band_lines(10.1, 10.2, 1.0), "no multiple"),
        (lambda: ibs.random_noise((10, 5), 1.0, sample_rate=RATE, duration=1.0), "rise"),
        (lambda: ibs.random_noise((10, 50), -1.0, sample_rate=RATE, duration=1.0), "not negative"),
        (lambda: ibs.random_noise((10.1, 10.2), 1.0, sample_rate=RATE, duration=1.0), "longer"),
        (lambda: ibs.random_noise((10, 50), [1.0], sample_rate=RATE, duration=1.0), r"shape \(1,\) for 2 frequencies"),
        (lambda: ibs.random_noise((10, 50), [1, 2, 3], sample_rate=RATE, duration=1.0), r"shape \(3,\)"),
        (lambda: ibs.random_noise(["low", "high"], 1.0, sample_rate=RATE, duration=1.0), "real numbers, got"),
        (lambda: ibs.swept_sine(5, 40, 1.0, sample_rate=RATE, duration=1.0, scale="log"), "not known"),
        (lambda: ibs.swept_sine(5, 40, 1.0, sample_rate=RATE, duration=1.00037), "whole number"),
        (lambda: ibs.burst_random(5, 40, 1.0, sample_rate=RATE, frame=1.0, burst=1.5), "between 0 and 1"),
    ],
)
def test_what_cannot_be_is_refused_in_words(call, words):
    with pytest.raises(ibs.ExcitationError, match=words):
        call()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda seed: ibs.random_noise((10, 50), 1.0, sample_rate=RATE, duration=1.0, seed=seed), "seed"),
        (lambda seed: ibs.burst_random(10, 50, 1.0, sample_rate=RATE, frame=1.0, seed=seed), "seed"),
        (lambda seed: ibs.multisine([1.0, 2.0], 1.0, sample_rate=RATE, seed=seed), "seed"),
        (lambda seed: ibs.burst_random(seed, 50, 1.0, sample_rate=RATE, frame=1.0), "minimum must"),
        (lambda seed: ibs.burst_random(5, 50, 1.0, sample_rate=RATE, frame=1.0, burst=seed), "burst must"),
    ],
)
@pytest.mark.parametrize("value", ["one", -1, None])
def test_values_that_are_no_numbers_are_refused_in_words(call, words, value):
    with pytest.raises(ibs.ModelError, match=words):
        call(value)


def test_excitations_are_frozen_and_drawn():
    sine = ibs.multisine(ibs.band_lines(1, 40, 1), 1.0, sample_rate=RATE)
    with pytest.raises(ValueError, match="read-only"):
        sine.samples[0] = 1.0
    over_time, over_frequency = sine.plot(unit="m/s²")
    assert over_time.get_ylabel() == "signal [m/s²]"
    assert "crest factor" in over_time.get_title(loc="right")
    assert len(over_frequency.lines[0].get_xdata()) == 40
    again = ibs.swept_sine(5, 40, 1.0, sample_rate=RATE, duration=1.0).plot()
    assert again[1].get_ylabel() == "PSD"
