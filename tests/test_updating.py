"""Fits recover known parameters within the uncertainty that they state, and say what data leave open."""

import warnings

import numpy as np
import pytest
import scipy.stats

import ibsdyn as ibs
from ibsdyn.few_averages import equivalent_chi_squared

TRUE = {"mount 0.kz": 5e5, "mount 1.kz": 7e5, "plate.inertia.Ixx": 0.065, "mount 2.zeta": 0.05}


def plate(values=None):
    model = ibs.Model("plate")
    model.fixation("floor")
    model.rigid_body("plate", mass=8.0, cog=(0, 0, 0.1), inertia=(0.06, 0.08, 0.1, 0, 0, 0))
    for i, (x, y) in enumerate([(0.1, 0.02), (-0.1, 0.1), (-0.1, -0.1)]):
        model.connection(
            f"mount {i}", "floor", "plate", position1=(x, y, 0), stiffness=(2e5, 2e5, 6e5, 0, 0, 0), zeta=0.03
        )
    return model.with_parameters(values or {})


def modes_of(model):
    modes = model.linearize().modes()
    return modes.frequencies, modes.damping_ratios


def test_exact_frequencies_give_the_exact_parameters():
    frequencies, ratios = modes_of(plate(TRUE))
    measured = ibs.MeasuredFrequencies(frequencies, 0.01, damping_ratios=ratios, damping_sigma=1e-3)
    found = ibs.fit(plate(), list(TRUE), measured)
    np.testing.assert_allclose(found.values, list(TRUE.values()), rtol=1e-6)
    assert found.chi_squared < 1e-6
    assert found.model.parameters()["mount 0.kz"] == found.values[0]
    assert found.evaluations < 15
    # One degree of freedom by hand: f = sqrt(k/m) / 2 pi, so sigma_k / k = 2 sigma_f / f.
    single = ibs.Model("m", axis="x")
    single.fixation("wall")
    single.rigid_body("m", mass=2.0)
    single.connection("k", "wall", "m", stiffness=700.0, zeta=0.02)
    f = np.sqrt(800.0 / 2.0) / (2 * np.pi)
    k, sigma = ibs.fit(single, ["k.stiffness"], ibs.MeasuredFrequencies(f, 0.02)).value("k.stiffness")
    assert k == pytest.approx(800.0)
    assert sigma == pytest.approx(800.0 * 2 * 0.02 / f)


def test_stated_uncertainties_are_those_of_repeated_measurements():
    truth = plate(TRUE)
    frequencies, ratios = modes_of(truth)
    rng = np.random.default_rng(0)
    values, chi = [], []
    for _ in range(150):
        measured = ibs.MeasuredFrequencies(
            frequencies + rng.normal(0, 0.03, 6),
            0.03,
            damping_ratios=ratios + rng.normal(0, 1e-3, 6),
            damping_sigma=1e-3,
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ibs.ModelWarning)  # one fit in a thousand misfits by chance
            found = ibs.fit(truth, list(TRUE), measured)
        values.append(found.values)
        chi.append(found.chi_squared)
    assert found.degrees_of_freedom == 8
    spread = np.std(values, axis=0, ddof=1)
    np.testing.assert_allclose(spread, found.uncertainties, rtol=0.2)  # 150 draws: 6 % of one sigma each
    offset = (np.mean(values, axis=0) - list(TRUE.values())) / (spread / np.sqrt(150))
    assert np.all(np.abs(offset) < 3.5)
    np.testing.assert_allclose(np.corrcoef(np.transpose(values)), found.correlation, atol=0.25)
    assert scipy.stats.kstest(chi, scipy.stats.chi2(8).cdf).pvalue > 0.01


def test_responses_with_their_variance():
    truth = plate(TRUE)
    inputs = [ibs.Force("plate", "z", position=(0.1, 0.05, 0.1)), ibs.BaseMotion("floor", "x")]
    outputs = [ibs.Sensor("plate", "z"), ibs.Sensor("plate", "rx"), ibs.Sensor("plate", "x", position=(0, 0, 0.2))]
    exact = truth.linearize().frf(inputs, outputs, np.linspace(5, 120, 60))
    rng = np.random.default_rng(4)
    sigma = 0.02 * np.abs(exact.response).mean(axis=2, keepdims=True) * np.ones_like(exact.response, dtype=float)
    deviations = []
    for _ in range(25):
        noise = (rng.normal(size=sigma.shape) + 1j * rng.normal(size=sigma.shape)) * sigma / np.sqrt(2)
        noisy = ibs.FrequencyResponse(
            exact.frequencies,
            exact.response + noise,
            exact.outputs,
            exact.inputs,
            exact.output_units,
            exact.input_units,
        )
        found = ibs.fit(plate(), list(TRUE), ibs.MeasuredResponse(noisy, inputs, outputs, sigma, band=(10, 100)))
        deviations.append((found.values - list(TRUE.values())) / found.uncertainties)
    # The sum of squares of 25 x 4 independent standard deviations, up to the parameters' correlation.
    assert 0.6 < np.mean(np.square(deviations)) < 1.5
    assert np.abs(np.mean(deviations, axis=0)).max() < 3.5 / 5
    lines = np.sum((exact.frequencies >= 10) & (exact.frequencies <= 100))
    assert found.degrees_of_freedom == 2 * 6 * lines - 4


def oscillator(k=800.0, zeta=0.02):
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    model.connection("k", "wall", "m", stiffness=k, zeta=zeta)
    return model


FORCE, MOTION = ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="displacement")


def measured_over(periods, rng, rate=64.0, count=640):
    """A multisine's response of the oscillator with white noise, estimated over some periods."""
    lines = np.arange(5, 100)
    response = oscillator().linearize().frf(FORCE, MOTION, lines * rate / count).response[0, 0]
    force = np.zeros(count // 2 + 1, dtype=complex)
    force[lines] = np.exp(2j * np.pi * rng.random(len(lines)))
    motion = np.zeros_like(force)
    motion[lines] = response * force[lines]
    u, y = (np.tile(np.fft.irfft(each) * count / 2, periods) for each in (force, motion))
    y = y + rng.normal(size=len(y)) * 0.05 * np.std(y)
    record = ibs.TimeRecord([u, y], ["force", "motion"], ["N", "m"], sample_rate=rate, period=count)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ibs.RecordWarning)  # one run, and few lines in the resonance
        return ibs.MeasuredResponse(ibs.estimate_frf(record, inputs=["force"], outputs=["motion"]), FORCE, MOTION)


def test_uncertainties_from_few_periods_are_uncertain_themselves():
    """Four periods know each variance from three degrees of freedom: neither a misfit nor an overconfident fit."""
    rng = np.random.default_rng(1)
    deviations, probabilities, ratios = [], [], []
    for _ in range(40):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ibs.ModelWarning)
            found = ibs.fit(oscillator(790.0, 0.022), ["k.stiffness", "k.zeta"], measured_over(4, rng))
        deviations.append((found.values - [800.0, 0.02]) / found.uncertainties)
        probabilities.append(found.probability)
        ratios.append(found.chi_squared / found.degrees_of_freedom)
    assert scipy.stats.kstest(probabilities, scipy.stats.uniform.cdf).pvalue > 0.01
    assert np.mean(ratios) == pytest.approx(1.5, rel=0.1)  # nu / (nu - 1)
    assert "few averages" in str(found)
    # nu / (nu - 2) holds for many lines; the few in a resonance spread a little less.
    assert np.all(np.sqrt(np.mean(np.square(deviations), axis=0)) < 1.1)
    assert np.all(np.sqrt(np.mean(np.square(deviations), axis=0)) > 0.5)


def test_three_periods_tell_no_uncertainty():
    with pytest.warns(ibs.ModelWarning, match="two degrees of freedom or fewer"):
        found = ibs.fit(oscillator(790.0), ["k.stiffness"], measured_over(3, np.random.default_rng(2)))
    assert found.values[0] == pytest.approx(800.0, rel=1e-3)
    assert np.isinf(found.uncertainties).all()
    exact = measured_over(3, np.random.default_rng(2))
    given = ibs.MeasuredResponse(exact.response, FORCE, MOTION, sigma=exact.sigma)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ibs.ModelWarning)  # a misfit, as the sigma is taken at its word
        assert np.isfinite(ibs.fit(oscillator(790.0), ["k.stiffness"], given).uncertainties).all()


def test_several_inputs_share_an_estimated_variance():
    """Draws of two inputs' errors over one estimated deviation sum to chi² of four a line."""
    rng = np.random.default_rng(5)
    system = oscillator().linearize()
    lines, nu, sums = np.linspace(1, 9, 30), 3.0, []
    exact = system.frf([FORCE, ibs.Stroke("k", "x")], MOTION, lines)
    for _ in range(300):
        deviation = np.sqrt(rng.gamma(nu, 1 / nu, size=30))
        errors = rng.normal(size=(2, 1, 2, 30)) / deviation  # real and imaginary, outputs, inputs, lines
        measured = ibs.MeasuredResponse(exact, [FORCE, ibs.Stroke("k", "x")], MOTION, sigma=1.0)
        object.__setattr__(measured, "degrees_of_freedom", np.full(30, nu))
        sums.append(equivalent_chi_squared(errors.ravel(), [measured]))
    assert scipy.stats.kstest(sums, scipy.stats.chi2(4 * 30).cdf).pvalue > 0.01


def test_modes_are_followed_when_they_change_places():
    """Two oscillators side by side: fitted stiffnesses let their frequencies cross."""

    def pair(first, second):
        model = ibs.Model("pair", axis="x")
        model.fixation("wall")
        for name, k in (("a", first), ("b", second)):
            model.rigid_body(name, mass=1.0)
            model.connection(f"k {name}", "wall", name, stiffness=k, zeta=0.01)
        model.connection("weak", "a", "b", stiffness=1.0)
        return model

    frequencies, _ = modes_of(pair(900.0, 400.0))
    sensors = [ibs.Sensor("a", "x"), ibs.Sensor("b", "x")]
    shapes = [[0.0, 1.0], [1.0, 0.0]]  # the lower one is b now, in the first guess it was a
    measured = ibs.MeasuredFrequencies(frequencies, 0.01, shapes=shapes, sensors=sensors)
    found = ibs.fit(pair(500.0, 800.0), ["k a.stiffness", "k b.stiffness"], measured)
    np.testing.assert_allclose(found.values, [900.0, 400.0], rtol=1e-6)
    # By number the same frequencies are taken for those of the first guess's modes.
    by_number = ibs.fit(
        pair(500.0, 800.0), ["k a.stiffness", "k b.stiffness"], ibs.MeasuredFrequencies(frequencies, 0.01)
    )
    np.testing.assert_allclose(by_number.values, [400.0, 900.0], rtol=1e-6)
    with pytest.raises(ibs.AnalysisError, match="resembles no mode"):
        ibs.fit(
            pair(500.0, 800.0),
            ["k a.stiffness"],
            ibs.MeasuredFrequencies(
                frequencies, 0.01, shapes=[[0, 1], [0, 1], [1, 0]], sensors=[*sensors, ibs.Sensor("wall", "x")]
            ),
        )


def test_what_data_leave_open_is_named():
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    model.rigid_body("n", mass=1.0)
    model.connection("k", "wall", "m", stiffness=800.0, zeta=0.02)
    model.connection("l", "m", "n", stiffness=500.0, zeta=0.02)
    frequencies, _ = modes_of(model)
    measured = ibs.MeasuredFrequencies(1.01 * frequencies, 0.01, damping_ratios=[0.02] * 2, damping_sigma=1e-3)
    # Masses and stiffnesses together leave every frequency as it is.
    with pytest.warns(ibs.ModelWarning, match=r"do not notice when .* together change"):
        found = ibs.fit(model, ["m.mass", "n.mass", "k.stiffness", "l.stiffness"], measured)
    assert np.isinf(found.uncertainties).all()
    assert np.isnan(found.correlation).all()
    assert "Undetermined" in str(found)
    # Frequencies do not see zeta at all.
    only = ibs.MeasuredFrequencies(frequencies, 0.01)
    with pytest.warns(ibs.ModelWarning, match=r"do not determine l.zeta"):
        found = ibs.fit(model, ["k.stiffness", "l.zeta"], only)
    assert np.isfinite(found.uncertainties[0])
    assert np.isinf(found.uncertainties[1])


def test_a_misfit_beyond_scatter_is_told():
    frequencies, _ = modes_of(plate(TRUE))
    with pytest.warns(ibs.ModelWarning, match="the model cannot be right, or sigma is too small"):
        found = ibs.fit(plate(), ["mount 0.kx"], ibs.MeasuredFrequencies(frequencies, 0.001))
    assert found.probability < 1e-3
    with pytest.warns(ibs.ModelWarning, match="ended at a bound"):
        ibs.fit(plate(), ["mount 1.kz"], ibs.MeasuredFrequencies(frequencies, 1.0), {"mount 1.kz": (5.99e5, 6.01e5)})


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m, f: ibs.fit(m, ["mount 0.kq"], f), "Did you mean 'mount 0"),
        (lambda m, f: ibs.fit(m, ["mount 0.kxx"], f), "first guess"),
        (lambda m, f: ibs.fit(m, ["mount 0.kz"], [1.0]), "MeasuredFrequencies"),
        (lambda m, f: ibs.fit(m, ["mount 0.kz"], f, {"mount 1.kz": (0, 1)}), "not fitted"),
        (lambda m, f: ibs.fit(m, ["mount 0.kz"], f, {"mount 0.kz": (0, 1)}), "leave out"),
        (lambda m, f: ibs.fit(m, [f"mount {i}.k{d}" for i in range(3) for d in "xyz"], f), "data cannot determine"),
        (lambda m, f: ibs.fit(m, ["mount 0.kz"], ibs.MeasuredFrequencies([1.0] * 9, 1.0)), "9 frequencies"),
        (lambda m, f: ibs.MeasuredFrequencies([1.0, -2.0], 0.1), "above 0"),
        (lambda m, f: ibs.MeasuredFrequencies([1.0, 2.0], [0.1] * 3), "2 numbers"),
        (lambda m, f: ibs.MeasuredFrequencies([1.0, 2.0], 0.1, modes=[1, 1]), "different whole numbers"),
        (lambda m, f: ibs.MeasuredFrequencies([1.0], 0.1, shapes=[[1.0]]), "go together"),
        (lambda m, f: ibs.MeasuredFrequencies([1.0], 0.1, damping_ratios=[0.1]), "go together"),
    ],
)
def test_refusals(call, words):
    with pytest.raises((ibs.ModelError, ibs.AnalysisError), match=words):
        call(plate(), ibs.MeasuredFrequencies(modes_of(plate())[0], 0.1))


def test_responses_that_do_not_fit_the_signals_are_refused():
    force, sensor = ibs.Force("plate", "z"), ibs.Sensor("plate", "z")
    exact = plate().linearize().frf(force, sensor, [10.0, 20.0])
    for arguments, words in (
        ((exact, [force, force], sensor, 1.0), "2 inputs for a response of 1"),
        ((exact, force, ibs.Sensor("plate", "z", quantity="velocity"), 1.0), "is in m/s"),
        ((exact, force, sensor), "give sigma="),
        ((exact, force, sensor, 0.0), "above 0"),
        ((exact, force, sensor, 1.0, (30.0, 40.0)), "no line"),
    ):
        with pytest.raises(ibs.ModelError, match=words):
            ibs.MeasuredResponse(*arguments)


def test_figure():
    frequencies, _ = modes_of(plate(TRUE))
    found = ibs.fit(plate(), ["mount 0.kz", "mount 1.kz"], ibs.MeasuredFrequencies(frequencies, 2.0))
    axes = found.plot()
    assert [label.get_text() for label in axes.get_yticklabels()] == ["mount 0.kz [%]", "mount 1.kz [%]"]
    x, _ = axes.containers[0].lines[0].get_data()
    np.testing.assert_allclose(x, 100 * (found.values / 6e5 - 1))
