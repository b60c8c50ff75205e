"""Comparisons: known deviations, known modes, the figure's content."""

import numpy as np
import pytest
from periodic_records import names_of, periodic_run

import ibsdyn as ibs
from ibsdyn.resonances import find_resonances, fitted

FS = 1000.0
MODES = ((40.0, 0.02), (48.0, 0.006), (110.0, 0.01))
SHAPES = np.array([[1.0, 0.6], [0.8, -1.0], [0.5, 0.7]])  # mode, sensor
FORCES = np.array([[1.0, 0.3], [0.4, 0.9], [1.0, -0.8]])  # mode, input


def response(frequencies, stiffer=1.0):
    """Accelerances of three modes; ``stiffer`` scales the second natural frequency."""
    w = 2 * np.pi * np.asarray(frequencies)
    total = np.zeros((2, 2, len(w)), dtype=complex)
    for (f, zeta), shape, force, factor in zip(MODES, SHAPES, FORCES, (1.0, stiffer, 1.0), strict=True):
        wn = 2 * np.pi * f * factor
        total += np.outer(shape, force)[:, :, None] * -(w**2) / (wn**2 - w**2 + 2j * zeta * wn * w)
    return total


def as_frf(frequencies, values, outputs=("y1", "y2"), inputs=("u1", "u2"), unit="m/s²"):
    return ibs.FrequencyResponse(
        np.asarray(frequencies), values, outputs, inputs, (unit,) * len(outputs), ("N",) * len(inputs)
    )


@pytest.fixture(scope="module")
def estimate():
    rng = np.random.default_rng(1)
    harmonics = np.arange(100, 1600)  # every 0.1 Hz
    truth = response(harmonics * 0.1)
    runs = [periodic_run(rng, truth, harmonics, 10_000, 2, output_noise=0.1) for _ in range(8)]
    return ibs.estimate_frf(runs, *names_of(2, 2))


def test_the_true_model_is_inside_as_often_as_the_region_claims(estimate):
    for level in (0.9, 0.99):
        comparison = ibs.compare(as_frf(estimate.frequencies, response(estimate.frequencies)), estimate, level)
        assert comparison.share_inside.shape == (2, 2)
        np.testing.assert_allclose(comparison.share_inside, level, atol=3 * np.sqrt(level * (1 - level) / 1500))
        assert comparison.total_share_inside == pytest.approx(comparison.inside.mean())
    assert comparison.frac.min() > 0.999
    assert comparison.deviation.max() < 0.05


def test_a_model_whose_mode_is_one_percent_off_falls_outside_there(estimate):
    comparison = ibs.compare(as_frf(estimate.frequencies, response(estimate.frequencies, 1.01)), estimate)
    near = abs(estimate.frequencies - 48) < 1
    assert comparison.inside[:, :, near].mean() < 0.1
    assert comparison.inside[:, :, estimate.frequencies > 100].mean() > 0.97
    second = min(comparison.resonances, key=lambda r: abs(r.test.frequency - 48))
    assert second.frequency_error == pytest.approx(0.01, abs=2e-4)
    assert second.test.damping_ratio == pytest.approx(0.006, rel=0.03)
    assert second.model.damping_ratio == pytest.approx(0.006, rel=0.01)
    assert second.damping_error == pytest.approx(0, abs=0.03)


def test_resonances_are_those_of_the_modes(estimate):
    comparison = ibs.compare(as_frf(estimate.frequencies, response(estimate.frequencies)), estimate)
    assert len(comparison.resonances) == 3
    for resonance, (frequency, zeta) in zip(comparison.resonances, MODES, strict=True):
        for side, of_zeta in ((resonance.model, 0.01), (resonance.test, 0.05)):
            assert side.fitted
            assert side.frequency == pytest.approx(frequency, rel=1e-3)
            assert side.damping_ratio == pytest.approx(zeta, rel=of_zeta)


def test_the_local_fit_of_one_mode_is_exact_and_half_power_does_where_lines_are_few():
    for spacing, exact in ((0.05, True), (0.6, False)):
        f = np.arange(20, 80, spacing)
        w = 2 * np.pi * f
        one = as_frf(
            f, (3e4 / ((2 * np.pi * 50) ** 2 - w**2 + 2j * 0.01 * w * 2 * np.pi * 50))[None, None], ("y",), ("u",)
        )
        (peak,) = find_resonances(one)
        assert peak.damping_ratio == pytest.approx(0.01, rel=0.01 if exact else 0.3)
        result = fitted(one, peak)
        assert result.fitted is exact
        if exact:
            assert result.frequency == pytest.approx(50, rel=1e-9)
            assert result.damping_ratio == pytest.approx(0.01, rel=1e-7)


def test_a_resonance_that_only_one_side_has_stays_unmatched():
    f = np.arange(10, 160, 0.1)
    w = 2 * np.pi * f
    full = response(f)[:1, :1]
    third = SHAPES[2, 0] * FORCES[2, 0] * -(w**2) / ((220 * np.pi) ** 2 - w**2 + 2j * 0.01 * w * 220 * np.pi)
    lacking = full - third
    for model, test, side in ((lacking, full, "test"), (full, lacking, "model")):
        comparison = ibs.compare(as_frf(f, model, ("y1",), ("u1",)), as_frf(f, test, ("y1",), ("u1",)))
        (alone,) = [r for r in comparison.resonances if r.model is None or r.test is None]
        assert getattr(alone, side).frequency == pytest.approx(110, rel=1e-3)
        assert np.isnan(alone.frequency_error)
        assert "-" in str(comparison).splitlines()[-1]


def test_two_responses_without_region_linear_against_nonlinear():
    f = np.linspace(10, 150, 800)
    linear = as_frf(f, response(f))
    other = as_frf(f, response(f) * (1 + 2e-4))
    comparison = ibs.compare(linear, other)
    assert comparison.inside is None
    assert comparison.confidence is None
    np.testing.assert_allclose(comparison.deviation, 2e-4, rtol=1e-3)
    np.testing.assert_allclose(comparison.frac, 1.0)
    with pytest.raises(ibs.AnalysisError, match="without region"):
        _ = comparison.share_inside
    assert "inside" not in str(comparison)
    assert comparison.plot().shape == (4, 2)


def test_noise_without_statistics_is_compared_all_the_same():
    rng = np.random.default_rng(2)
    f = np.linspace(1, 500, 5000)
    noise = rng.standard_normal((4, 4, 5000)) + 1j * rng.standard_normal((4, 4, 5000))
    four = [f"y{k}" for k in range(4)], [f"u{k}" for k in range(4)]
    comparison = ibs.compare(as_frf(f, noise, *map(tuple, four)), as_frf(f, noise[::-1], *map(tuple, four)))
    assert comparison.frac.max() < 0.02


def test_frac_is_what_a_phase_or_a_shape_error_makes_of_it():
    f = np.linspace(10, 150, 400)
    a = response(f)
    np.testing.assert_allclose(ibs.compare(as_frf(f, a), as_frf(f, 3j * a)).frac, 1.0)  # a factor is no shape
    b = response(f, 1.05)
    expected = abs(np.vdot(a[0, 1], b[0, 1])) ** 2 / (np.vdot(a[0, 1], a[0, 1]) * np.vdot(b[0, 1], b[0, 1])).real
    assert ibs.compare(as_frf(f, a), as_frf(f, b)).frac[0, 1] == pytest.approx(expected)
    assert expected < 0.9


class _Modes:
    def __init__(self, shapes):
        self.shapes = shapes
        self.frequencies = np.arange(1.0, shapes.shape[1] + 1)


def test_mac_of_given_shapes():
    f = np.linspace(10, 150, 400)
    pair = as_frf(f, response(f))
    shapes = np.array([[1.0, 1.0], [0.0, 1.0]])
    comparison = ibs.compare(pair, pair, modes=(_Modes(shapes), _Modes(1j * shapes[:, ::-1])))
    np.testing.assert_allclose(comparison.mac, [[0.5, 1.0], [1.0, 0.5]])
    assert "MAC" in str(comparison)
    with pytest.raises(ibs.AnalysisError, match="3 rows, the test's 2"):
        ibs.compare(pair, pair, modes=(_Modes(np.eye(3)), _Modes(shapes)))


def test_names_may_differ_if_said_and_the_smaller_side_decides(estimate):
    f = estimate.frequencies
    model = as_frf(f, response(f)[:1], outputs=("mirror.z",))
    comparison = ibs.compare(model, estimate, names={"y1": "mirror.z"})
    assert comparison.model.outputs == comparison.test.outputs == ("mirror.z",)
    assert comparison.total_share_inside > 0.97
    part = ibs.compare(as_frf(f, response(f)), estimate.select("y2", "u1"))
    assert part.frac.shape == (1, 1)
    assert part.total_share_inside > 0.97
    with pytest.raises(ibs.UnknownNameError, match=r"called 'mirror.z'.*names="):
        ibs.compare(model, estimate)
    with pytest.raises(ibs.UnknownNameError, match=r"renames 'Y1'.*Did you mean 'y1'"):
        ibs.compare(model, estimate, names={"Y1": "mirror.z"})


def test_what_cannot_be_compared_is_refused(estimate):
    f = estimate.frequencies
    with pytest.raises(ibs.AnalysisError, match=r"system.frf\(inputs, outputs, estimate.frequencies\)"):
        ibs.compare(as_frf(f[::2], response(f[::2])), estimate)
    with pytest.raises(ibs.AnalysisError, match=r"system.frf\(inputs, outputs, estimate.frequencies\)"):
        ibs.compare(as_frf(f * 1.001, response(f)), estimate)
    with pytest.raises(ibs.AnalysisError, match=r"test must be an ibs\.FrequencyResponse or an estimate, got None"):
        ibs.compare(as_frf(f, response(f)), None)
    with pytest.raises(ibs.AnalysisError, match="'y1' is in g in the model"):
        ibs.compare(as_frf(f, response(f), unit="g"), estimate)
    ibs.compare(as_frf(f, response(f), unit="m/s^2"), estimate)  # spelled otherwise
    with pytest.raises(ibs.AnalysisError, match=r"as 0\.99 for"):
        ibs.compare(as_frf(f, response(f)), estimate, confidence=99)


def test_the_table_and_the_figure(estimate):
    comparison = ibs.compare(as_frf(estimate.frequencies, response(estimate.frequencies)), estimate)
    text = str(comparison)
    assert "% of 6000 values inside the 99 % region of the test" in text
    assert "y2 / u1" in text
    assert len(text.splitlines()) == 1 + 1 + 4 + 2 + 3
    axes = comparison.plot()
    assert axes.shape == (6, 2)
    test, model = axes[0, 0].lines
    assert (model.get_color(), model.get_linestyle()) == ("black", "--")
    assert (test.get_color(), test.get_linestyle()) == ("tab:red", "-")
    np.testing.assert_allclose(model.get_ydata(), abs(response(estimate.frequencies))[0, 0])
    words = [entry.get_text() for entry in axes[0, 0].get_legend().get_texts()]
    assert words[:2] == ["test", "model"]
    assert "99 % region" in words[2]
    np.testing.assert_allclose(axes[5, 1].lines[0].get_ydata(), estimate.coherence[1])
    assert "coherence" in axes[2, 0].get_ylabel()
    one = comparison.select("y2", "u1")
    assert one.plot().shape == (3, 1)
    assert one.share_inside[0, 0] == comparison.share_inside[1, 0]
    with pytest.raises(AttributeError):
        comparison.frac = None
