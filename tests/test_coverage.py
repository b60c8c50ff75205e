"""Monte Carlo coverage of every confidence region: it holds the true response as often as it claims.

Shares are compared within their own sampling error: lines are independent draws, the responses of one line are not, so
the error is that of the lines' mean shares. Regions by lag windows and overlapping segments rest on an effective number
of averages; case 14 of the published cases allows them 0.006.
"""

import warnings

import numpy as np
import pytest
from periodic_records import complex_normal, names_of, periodic_run

import ibsdyn as ibs

LEVELS = (0.90, 0.95, 0.99)


def assert_coverage(inside, level, allowance=0.0, noted=None):
    """``inside`` (..., n_lines); lines are independent. ``noted(level, share, allowed difference)`` sees the result."""
    of_lines = inside.reshape(-1, inside.shape[-1]).mean(axis=0)
    error = max(of_lines.std() / np.sqrt(len(of_lines)), 0.5 / len(of_lines))
    if noted:
        noted(level, of_lines.mean(), 3.3 * error + allowance)
    assert abs(of_lines.mean() - level) < 3.3 * error + allowance, (of_lines.mean(), error)


@pytest.fixture
def coverage_of(validated):
    """Return what notes the coverage of one kind of estimate for the validation page."""

    def of(what):
        def noted(level, share, allowed):
            if level == 0.99:
                source = "Monte Carlo; allowed: its scatter, and 0.004 to 0.01 for effective averages"
                validated(
                    f"share of 99 % regions that hold the truth: {what}",
                    source,
                    level,
                    share,
                    atol=allowed,
                    against="statistics",
                )

        return noted

    return of


def noisy_record(rng, n, n_in, n_out):
    """Static gains from white inputs: no bias by resolution; noise as strong as what the inputs explain."""
    gain = rng.standard_normal((n_out, n_in))
    u = rng.standard_normal((n_in, n_in)) @ rng.standard_normal((n_in, n)) + rng.standard_normal((n_in, n))
    y = gain @ u
    y += y.std() * rng.standard_normal((n_out, n))
    inputs, outputs = names_of(n_in, n_out)
    return ibs.TimeRecord([*u, *y], inputs + outputs, ["N"] * n_in + ["m"] * n_out, 1000.0), gain[:, :, None]


def coverage_from_noise(method, averages, n_in, n_out, lines, seed, **options):
    """Return, for each level, whether each line holds the truth; every fourth line, as near ones see the same data."""
    rng = np.random.default_rng(seed)
    inside = {level: [] for level in LEVELS}
    length = 4096
    for _ in range(-(-lines // (length // 8 - 2))):
        if method == "welch":
            record, gain = noisy_record(rng, (averages + 1) * length // 2, n_in, n_out)
            estimate = ibs.estimate_frf(record, *names_of(n_in, n_out), "welch", window_length=length, **options)
        else:
            record, gain = noisy_record(rng, int(averages * 0.75 * length / 2), n_in, n_out)
            estimate = ibs.estimate_frf(record, *names_of(n_in, n_out), "spectral", window_length=length // 2)
        error = abs(estimate.response - gain)[:, :, 2:-2:4]  # next to 0 Hz and the Nyquist frequency spectra are real
        for level in LEVELS:
            inside[level].append(error < estimate.radius(level)[:, :, 2:-2:4])
    return {level: np.concatenate(found, axis=2) for level, found in inside.items()}


@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
@pytest.mark.parametrize(
    ("n_in", "n_out", "segments", "lines"),
    [(1, 1, 9, 6000), (1, 1, 15, 5000), (1, 1, 63, 2500), (6, 6, 12, 1000), (6, 6, 60, 500)],
)
def test_welch(n_in, n_out, segments, lines, coverage_of):
    noted = coverage_of(f"Welch, {n_in} x {n_out}, {segments} segments")
    for level, inside in coverage_from_noise("welch", segments, n_in, n_out, lines, seed=segments).items():
        assert_coverage(inside, level, allowance=0.004, noted=noted)


@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
@pytest.mark.parametrize(
    ("n_in", "n_out", "averages", "lines"),
    [(1, 1, 10, 6000), (1, 1, 21, 5000), (1, 1, 85, 2000), (6, 6, 21, 500), (6, 6, 60, 500)],
)
def test_spectral(n_in, n_out, averages, lines, coverage_of):
    noted = coverage_of(f"spectral analysis, {n_in} x {n_out}, {averages} averages")
    for level, inside in coverage_from_noise("spectral", averages, n_in, n_out, lines, seed=averages).items():
        assert_coverage(inside, level, allowance=0.006 if averages / n_in > 5 else 0.010, noted=noted)


@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
@pytest.mark.parametrize("estimator", ["H2", "Hv"])
def test_the_other_estimators_of_welch_where_their_noise_is_as_they_say(estimator):
    rng = np.random.default_rng(7)
    for level in LEVELS:
        inside = []
        for _ in range(6):
            x = rng.standard_normal(30 * 2048)
            noise = 0.4 * rng.standard_normal((2, len(x)))
            y = 2 * (x + (noise[1] if estimator == "Hv" else 0))
            record = ibs.TimeRecord([x + noise[0], y], ["u1", "y1"], ["N", "m"], 1000.0)
            estimate = ibs.estimate_frf(record, "u1", "y1", "welch", window_length=4096, estimator=estimator)
            inside.append((abs(estimate.response - 2.0) < estimate.radius(level))[:, :, 2:-2:4])
        # both are ratios of noisy numbers: circles to first order of 1 / averages
        assert_coverage(np.concatenate(inside, axis=2), level, allowance=0.01)


def periodic_estimate(rng, n_in, n_out, runs, periods, lines, distortion=0.0, orthogonal=False):
    harmonics = np.arange(1, lines + 1)
    response = complex_normal(rng, (n_out, n_in, 1)) * np.ones(lines)
    fourier = np.exp(2j * np.pi * np.outer(range(n_in), range(n_in)) / n_in)
    records = []
    for run in range(runs):
        if run % n_in == 0:
            phase = np.exp(2j * np.pi * rng.random((n_in, lines)))
        phases = phase * fourier[:, [run % n_in]] if orthogonal else None
        records.append(periodic_run(rng, response, harmonics, 2 * lines + 2, periods, 0.05, distortion, phases))
    return ibs.estimate_frf(records, *names_of(n_in, n_out)), response


@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
@pytest.mark.parametrize(
    ("n_in", "n_out", "runs", "periods", "lines", "options"),
    [
        (1, 1, 3, 1, 20_000, {}),
        (1, 1, 6, 2, 20_000, {"distortion": 0.1}),
        (1, 1, 12, 1, 20_000, {}),
        (1, 1, 30, 1, 20_000, {}),
        (1, 1, 1, 4, 20_000, {}),  # noise between periods alone
        (6, 6, 9, 1, 3000, {}),
        (6, 6, 9, 2, 3000, {"distortion": 0.1}),
        (6, 6, 6, 5, 3000, {"orthogonal": True}),  # no spare run: noise between periods alone
        (6, 6, 12, 2, 3000, {"orthogonal": True, "distortion": 0.1}),
        (6, 6, 60, 1, 1000, {}),
        (3, 1, 4, 1, 20_000, {}),  # one degree of freedom
    ],
)
def test_periodic(n_in, n_out, runs, periods, lines, options, coverage_of):
    rng = np.random.default_rng(runs)
    said = "".join(f", {word}" for word in options)
    noted = coverage_of(f"periodic, {n_in} x {n_out}, {runs} runs of {periods} periods{said}")
    estimate, response = periodic_estimate(rng, n_in, n_out, runs, periods, lines, **options)
    for level in LEVELS:
        assert_coverage(abs(estimate.response - response) < estimate.radius(level), level, noted=noted)


@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
def test_bounds_of_the_magnitude_alone_and_of_the_circle():
    rng = np.random.default_rng(5)
    estimate, response = periodic_estimate(rng, 1, 1, 6, 1, 20_000)
    for level in LEVELS:
        low, high = estimate.magnitude_bounds(level, circle=False)
        assert_coverage((low < abs(response)) & (abs(response) < high), level)
        low, high = estimate.phase_bounds(level, circle=False)
        phase = np.degrees(np.angle(response))
        assert_coverage((low < phase) & (phase < high), level, allowance=0.002)
        low, high = estimate.magnitude_bounds(level)
        assert np.mean((low < abs(response)) & (abs(response) < high)) > level


def test_a_known_variance_would_claim_too_much():
    # the published share of three realisations with the chi-squared quantile: 0.9097 instead of 0.99
    rng = np.random.default_rng(6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ibs.RecordWarning)
        estimate, response = periodic_estimate(rng, 1, 1, 3, 1, 20_000)
    inside = abs(estimate.response - response) ** 2 < -np.log(0.01) * estimate.variance
    assert np.mean(inside) == pytest.approx(0.9097, abs=0.006)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ibsdyn.RecordWarning")
def test_long():
    """Ten times as many lines, so that the sampling error is below the published tolerance of 0.006 everywhere."""
    for n_in, segments, lines in ((1, 9, 60_000), (1, 15, 40_000), (1, 63, 25_000), (6, 12, 10_000), (6, 60, 5000)):
        for level, inside in coverage_from_noise("welch", segments, n_in, n_in, lines, seed=2).items():
            assert_coverage(inside, level, allowance=0.004)
    for n_in, averages, lines in ((1, 10, 60_000), (1, 21, 40_000), (1, 85, 20_000), (6, 21, 5000), (6, 60, 5000)):
        for level, inside in coverage_from_noise("spectral", averages, n_in, n_in, lines, seed=3).items():
            assert_coverage(inside, level, allowance=0.006 if averages / n_in > 5 else 0.010)
    rng = np.random.default_rng(4)
    for n_in, runs, periods in ((1, 3, 2), (1, 12, 1), (6, 6, 4), (6, 7, 1), (6, 9, 2), (6, 30, 1)):
        estimate, response = periodic_estimate(rng, n_in, n_in, runs, periods, 60_000 // n_in)
        for level in LEVELS:
            assert_coverage(abs(estimate.response - response) < estimate.radius(level), level)
