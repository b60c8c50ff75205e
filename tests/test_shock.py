"""Shocks against closed forms of the half sine and scipy's integrator."""

import math

import numpy as np
import pytest
import scipy.integrate

import ibsdyn as ibs


def pulse(width=0.011, peak=100.0, rate=50_000.0, duration=0.05):
    signal = ibs.half_sine(peak, width, rate, duration)
    return ibs.TimeRecord(signal.samples, ["base"], ["m/s²"], rate)


@pytest.mark.parametrize("cycles", [0.1, 0.2, 0.3, 0.45])
def test_half_sine_residual(cycles, validated):
    """Undamped, f T below 1/2: the peak comes after the pulse, A 4 fT cos(pi f T) / (1 - 4 f² T²)."""
    f = cycles / 0.011
    spectrum = ibs.shock_response_spectrum(pulse(), frequencies=[f], damping_ratio=0.0)
    expected = 100 * 4 * cycles * math.cos(math.pi * cycles) / (1 - 4 * cycles**2)
    what = f"half sine of 100 m/s², f T = {cycles:g}: shock response"
    source = "residual A 4 fT cos(π f T) / (1 - 4 f² T²)"
    validated(what, source, expected, spectrum.maximax[0], rtol=5e-3, against="closed forms", unit="m/s²")
    assert spectrum.negative[0] == pytest.approx(expected, rel=5e-3)


def test_stiff_systems_follow_the_pulse_and_the_worst_one_is_1_77(validated):
    spectrum = ibs.shock_response_spectrum(pulse(), frequencies=np.geomspace(10, 20_000, 200), damping_ratio=1e-4)
    assert spectrum.maximax[-1] == pytest.approx(100, rel=0.01)
    what, source = "half sine of 100 m/s²: largest response of any oscillator", "textbooks: 1.77 at f T = 0.8"
    validated(what, source, 177.0, spectrum.maximax.max(), rtol=0.01, against="published cases", unit="m/s²")
    assert spectrum.frequencies[spectrum.maximax.argmax()] * 0.011 == pytest.approx(0.81, rel=0.05)


@pytest.mark.parametrize("frequency", [30.0, 400.0, 3000.0])
def test_against_scipy_integration(frequency):
    rng = np.random.default_rng(int(frequency))
    rate = 4000.0
    a = np.r_[0.0, rng.normal(size=40), 0.0]
    record = ibs.TimeRecord(a, ["base"], ["m/s²"], rate)
    zeta, w = 0.05, 2 * np.pi * frequency
    time = np.arange(len(a)) / rate

    def rates(t, x):
        return [x[1], -np.interp(t, time, a, right=0.0) - 2 * zeta * w * x[1] - w**2 * x[0]]

    end = time[-1] + 1.2 / frequency
    run = scipy.integrate.solve_ivp(
        rates, (0, end), [0, 0], rtol=1e-8, atol=1e-14, max_step=min(1 / rate, 1 / frequency / 20), dense_output=True
    )
    fine = np.linspace(0, end, 20_001)
    z, v = run.sol(fine)
    absolute = -(2 * zeta * w * v + w**2 * z)
    spectrum = ibs.shock_response_spectrum(record, frequencies=[frequency], damping_ratio=zeta)
    assert spectrum.positive[0] == pytest.approx(absolute.max(), rel=6e-3)
    assert spectrum.negative[0] == pytest.approx(-absolute.min(), rel=6e-3)


def test_a_model_answers_as_the_spectrum_says():
    """The acceleration of one mass in a model under the pulse peaks at the spectrum's value at its frequency."""
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    model.connection("k", "wall", "m", stiffness=2 * (2 * np.pi * 60) ** 2, zeta=0.05)
    signal = ibs.half_sine(100.0, 0.011, 20_000.0, 0.1)
    floor = ibs.BaseMotion("wall", "x", name="floor")
    sensors = [
        ibs.Sensor("m", "x", name="y"),
        ibs.Sensor("m", "x", quantity="displacement", relative_to="wall", name="stretch"),
    ]
    record = ibs.transient_response(model.linearize(), {floor: signal}, sensors)
    assert record.names == ("floor", "y", "stretch")
    np.testing.assert_array_equal(record["floor"], signal.samples)
    spectrum = ibs.shock_response_spectrum(record, "floor", frequencies=[60.0])
    assert np.abs(record["y"]).max() == pytest.approx(spectrum.maximax[0], rel=2e-3)
    w = 2 * np.pi * 60
    run = scipy.integrate.solve_ivp(
        lambda t, x: [x[1], -np.interp(t, record.time, signal.samples) - 0.1 * w * x[1] - w**2 * x[0]],
        (0, record.time[-1]),
        [0, 0],
        t_eval=record.time[::100],
        rtol=1e-9,
        atol=1e-14,
        max_step=1e-3,
    )
    np.testing.assert_allclose(record["stretch"][::100], run.y[0], atol=1e-6 * np.abs(run.y[0]).max())


def test_what_is_no_shock():
    with pytest.raises(ibs.ModelError, match="eight samples"):
        ibs.half_sine(1.0, 0.001, 1000.0, 0.1)
    with pytest.raises(ibs.ModelError, match="percentage"):
        ibs.shock_response_spectrum(pulse(), damping_ratio=5)
    with pytest.raises(ibs.AnalysisError, match="above 0"):
        ibs.shock_response_spectrum(pulse(), frequencies=[0.0, 1.0])
    two = ibs.TimeRecord(np.zeros((2, 10)), ["a", "b"], ["m/s²"] * 2, 10.0)
    with pytest.raises(ibs.ModelError, match="'a', 'b'"):
        ibs.shock_response_spectrum(two)
    model = ibs.Model("m", axis="x")
    model.rigid_body("m", mass=2.0)
    system, force, sensor = model.linearize(), ibs.Force("m", "x"), ibs.Sensor("m", "x")
    with pytest.raises(ibs.ModelError, match="one sample rate"):
        ibs.transient_response(system, {force: np.ones(10)}, sensor)
    with pytest.raises(ibs.ModelError, match="dict"):
        ibs.transient_response(system, [force], sensor)
    other = ibs.Force("m", "x", name="other")
    with pytest.raises(ibs.ModelError, match=r"\[10, 11\]"):
        ibs.transient_response(system, {force: np.ones(10), other: np.ones(11)}, sensor, sample_rate=100.0)


def test_figure():
    spectrum = ibs.shock_response_spectrum(pulse())
    axes = spectrum.plot()
    assert axes.get_ylabel() == "maximax acceleration [m/s²]"
    assert axes.get_legend().get_texts()[0].get_text() == "base, Q = 10"
    assert spectrum.frequencies[-1] <= 10_000
