"""PSDs: exact power-law integrals, units, files, records, published spectra."""

import math

import numpy as np
import pytest
import scipy.integrate
from hypothesis import given, settings
from hypothesis import strategies as st

import ibsdyn as ibs

G = 9.80665


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_mean_square_is_the_integral_of_power_laws(seed):
    rng = np.random.default_rng(seed)
    f = np.sort(rng.uniform(1, 500, 6))
    s = 10 ** rng.uniform(-6, 1, 6)
    s[rng.integers(6)] = rng.choice([0.0, 1.0])
    psd = ibs.PSD(f, s)
    band = tuple(np.sort(rng.uniform(f[0], f[-1], 2)))
    fine = np.unique(np.concatenate([np.geomspace(*band, 20001), f[(f > band[0]) & (f < band[1])]]))
    expected = scipy.integrate.trapezoid(psd.at(fine), fine)
    assert psd.mean_square(band) == pytest.approx(expected, rel=1e-5, abs=1e-12)
    np.testing.assert_allclose(psd.at(f), s, rtol=1e-12)
    assert psd.at(f[0] * 0.99) == psd.at(f[-1] * 1.01) == 0.0


def test_straight_lines_on_log_axes_and_steps():
    psd = ibs.PSD([10, 100, 100, 1000], [1.0, 0.01, 4.0, 4.0], "N")
    assert psd.at(math.sqrt(1000)) == pytest.approx(0.1)
    assert psd.at(100.0) == pytest.approx(4.0)
    assert psd.mean_square() == pytest.approx((1 - 0.1) * 10 + 4 * 900)
    assert ibs.PSD([1, math.e], [3.0, 3.0 / math.e]).mean_square() == pytest.approx(3.0)  # 1/f has a logarithm
    assert psd.mean_square((2000, 3000)) == 0.0


def test_derivatives_of_a_signal():
    velocity = ibs.PSD([1, 10], [4.0, 0.04], "m/s")
    acceleration = velocity.to("m/s^2")
    f = np.linspace(1, 10, 50)
    np.testing.assert_allclose(acceleration.at(f), (2 * np.pi * f) ** 2 * velocity.at(f), rtol=1e-12)
    np.testing.assert_allclose(acceleration.to("m").at(f), velocity.at(f) / (2 * np.pi * f) ** 2, rtol=1e-12)
    assert velocity.to("m/s") is velocity
    with pytest.raises(ibs.ModelError, match="'N'"):
        velocity.to("N")
    base = ibs.Disturbance("d", ibs.BaseMotion("wall", "x", quantity="displacement"), acceleration)
    assert base.psd.unit == "m"


def test_g_is_turned_into_si():
    assert ibs.PSD([20, 2000], [0.04, 0.04], "g").rms() == pytest.approx(math.sqrt(0.04 * 1980) * G)


@pytest.mark.parametrize(
    ("spectrum", "rms"), [("GEVS qualification", 14.1), ("GEVS acceptance", 10.0), ("NASA workmanship", 6.8)]
)
def test_launch_spectra_have_the_overall_level_published_with_them(spectrum, rms):
    assert round(ibs.launch_vibration(spectrum).rms() / G, 1) == rms
    assert ibs.launch_vibration(spectrum).band == (20, 2000)


def test_heavy_components_are_not_tested_by_the_table():
    assert ibs.launch_vibration("GEVS acceptance", mass=22.0).unit == "m/s²"
    with pytest.raises(ibs.ModelError, match="at most, got 30 kg"):
        ibs.launch_vibration("GEVS acceptance", mass=30.0)
    with pytest.raises(ibs.ModelError, match="GEVS"):
        ibs.launch_vibration("GEVS")


@pytest.mark.parametrize(
    ("criterion", "level"),
    [("VC-A", 50), ("VC-B", 25), ("VC-C", 12.5), ("VC-D", 6.25), ("VC-E", 3.12), ("VC-F", 1.56), ("VC-G", 0.78)],
)
def test_criteria_in_third_octaves(criterion, level):
    """The RMS velocity of the PSD in any one-third-octave band is the criterion, by integration over the band."""
    psd = ibs.floor_vibration(criterion, "m/s")
    for centre in (10.0, 31.5, 63.0):
        band = (centre * 2 ** (-1 / 6), centre * 2 ** (1 / 6))
        # a constant PSD density over the band against v²/(0.232 f): equal within the curvature of 1/f
        assert psd.rms(band) == pytest.approx(level * 1e-6, rel=3e-3)
    assert psd.band == ((4.0, 80.0) if level >= 25 else (1.0, 80.0))


@pytest.mark.parametrize(
    ("criterion", "factor"),
    [("ISO workshop", 8), ("ISO office", 4), ("ISO residential day", 2), ("ISO operating theatre", 1)],
)
def test_iso_curves_are_multiples_of_the_base_curve(criterion, factor):
    """ISO 2631-2:1989: 5 mm/s² from 4 to 8 Hz, 0.1 mm/s up to 80 Hz, both printed rounded (0.5 % apart at 8 Hz)."""
    psd = ibs.floor_vibration(criterion)
    for f in (4.0, 6.3, 8.0, 16.0, 63.0):
        width = f * (2 ** (1 / 6) - 2 ** (-1 / 6))
        base = 5e-3 if f <= 8 else 1e-4 * 2 * np.pi * f
        assert math.sqrt(psd.at(f) * width) == pytest.approx(factor * base, rel=0.01)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ibs.floor_vibration(["VC-A"]), "Did you mean 'VC-A'"),
        (lambda: ibs.floor_vibration("VC-A", "mm/s"), "'mm/s', only of m, m/s and m/s²"),
        (lambda: ibs.floor_vibration("VC-A", ["m/s"]), "only of"),
        (lambda: ibs.launch_vibration({}), "not known"),
        (lambda: ibs.launch_vibration("GEVS acceptance", mass="5 kg"), "mass must be one number"),
        (lambda: ibs.launch_vibration("GEVS acceptance", mass=math.nan), "mass must be finite"),
        (lambda: ibs.launch_vibration("GEVS acceptance", mass=-1.0), "mass must be above 0"),
    ],
)
def test_what_is_no_environment(call, words):
    with pytest.raises(ibs.ModelError, match=words):
        call()


def test_coarse_criteria_are_constant_in_acceleration_below_8_hz():
    for criterion, micro_g in (("VC-A", 260), ("VC-B", 130)):
        psd = ibs.floor_vibration(criterion)
        for f in (4.0, 5.0, 6.3, 8.0):
            width = f * (2 ** (1 / 6) - 2 ** (-1 / 6))
            assert math.sqrt(psd.at(f) * width) / G * 1e6 == pytest.approx(micro_g, rel=0.02)


@pytest.mark.parametrize(
    "text",
    [
        "1,2e-3\n10,4e-3\n",
        "frequency [Hz], PSD\n# analyser\n1, 2e-3\n10, 4e-3\n",
        "f;S\n1,0;0,002\n10,0;0,004\n",
        "1\t2e-3\r\n10\t4e-3\r\n",
        "0 9\n1 2e-3\n10 4e-3\n",
        "\ufeff1 2e-3\n\n10 4e-3",
    ],
)
def test_files(tmp_path, text):
    file = tmp_path / "floor.csv"
    file.write_text(text, encoding="utf-8")
    psd = ibs.PSD.from_csv(file, unit="m/s^2")
    np.testing.assert_array_equal(psd.frequencies, [1, 10])
    np.testing.assert_allclose(psd.values, [2e-3, 4e-3])
    assert (psd.title, psd.unit) == ("floor", "m/s²")


@pytest.mark.parametrize(
    ("text", "words"),
    [("1 2\n3 oops\n", "line 2"), ("1 2 3\n4 5 6\n", "line 1"), ("nothing\n", "0 lines"), ("1 2\n1 -2\n", "negative")],
)
def test_bad_files_are_refused_by_line(tmp_path, text, words):
    file = tmp_path / "bad.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ibs.ModelError, match=words):
        ibs.PSD.from_csv(file)


@pytest.mark.parametrize(
    ("frequencies", "values", "words"),
    [
        ([1, 2], [1], "as many"),
        ([1], [1], "two at least"),
        ([2, 1], [1, 1], "rise"),
        ([1, 1, 1], [1, 2, 3], "rise"),
        ([0, 1], [1, 1], "0 Hz line"),
        ([1, 2], [1, -1], "negative"),
        ([1, math.nan], [1, 1], "finite"),
        ([[1, 2]], [[1, 1]], "list"),
        ("ab", [1, 1], "real numbers"),
    ],
)
def test_what_is_no_psd(frequencies, values, words):
    with pytest.raises(ibs.ModelError, match=words):
        ibs.PSD(frequencies, values)


def test_units_are_of_the_signal():
    with pytest.raises(ibs.ModelError, match="not of the PSD"):
        ibs.PSD([1, 2], [1, 1], "g²/Hz")


def test_a_record_gives_its_power_back():
    rng = np.random.default_rng(3)
    noise = rng.normal(size=100_000)
    record = ibs.TimeRecord([noise], ["floor"], ["m/s²"], sample_rate=1000.0)
    psd = ibs.PSD.from_record(record, segment=1.0)
    assert psd.rms() == pytest.approx(1.0, rel=0.02)
    assert psd.frequencies[0] == 1.0
    with pytest.raises(ibs.ModelError, match="segment"):
        ibs.PSD.from_record(record, segment=200.0)


def test_measured_spectra_with_many_rough_lines_integrate_exactly():
    """A budget over 2000 lines that jump by decades has the RMS of the exact power-law integrals."""
    rng = np.random.default_rng(8)
    f = np.linspace(0.1, 200, 2000)
    psd = ibs.PSD(f, 10 ** rng.uniform(-3, 3, 2000), "N")
    model = ibs.Model("free", axis="x")
    model.rigid_body("m", mass=1.0)
    noise = ibs.Disturbance("noise", ibs.Force("m", "x"), psd)
    rms = ibs.RmsResponse(ibs.Sensor("m", "x"), noise).evaluate(model.linearize())
    assert rms == pytest.approx(psd.rms(), rel=1e-8)


def test_figure():
    axes = ibs.launch_vibration("GEVS acceptance").plot()
    assert axes.get_ylabel() == "PSD, one-sided [(m/s²)²/Hz]"
    assert axes.get_xlabel() == "frequency [Hz]"
    assert axes.get_legend().get_texts()[0].get_text() == "GEVS acceptance"


def test_scaled():
    psd = ibs.launch_vibration("GEVS qualification")
    assert psd.scaled(0.5, title="half").rms() == pytest.approx(psd.rms() / 2)
