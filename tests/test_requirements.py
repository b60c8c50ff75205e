"""Quantities and requirements against closed forms."""

import math

import numpy as np
import pytest

import ibsdyn as ibs


@pytest.fixture
def system():
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    model.connection("k", "wall", "m", stiffness=2 * (2 * np.pi * 50) ** 2, zeta=0.01)
    return model.linearize()


FLOOR = ibs.BaseMotion("wall", "x")
FORCE = ibs.Force("m", "x")
MOTION = ibs.Sensor("m", "x", quantity="displacement")


def test_modes(system):
    assert ibs.ModeFrequency(1).evaluate(system) == pytest.approx(50)
    assert ibs.ModeDamping(1).evaluate(system) == pytest.approx(0.01)
    with pytest.raises(ibs.AnalysisError, match="has 1 elastic"):
        ibs.ModeFrequency(2).evaluate(system)
    for bad in (0, 1.0, True, "1"):
        with pytest.raises(ibs.ModelError, match="whole number from 1"):
            ibs.ModeFrequency(bad)


def test_rigid_body_modes_are_not_counted():
    model = ibs.Model("dumbbell", axis="x")
    model.rigid_body("a", mass=1.0)
    model.rigid_body("b", mass=3.0)
    model.connection("s", "a", "b", stiffness=1e4, zeta=0.01)
    expected = math.sqrt(1e4 * (1 + 1 / 3)) / (2 * math.pi)
    assert ibs.ModeFrequency().evaluate(model.linearize()) == pytest.approx(expected)


@pytest.mark.filterwarnings("ignore:connection 'k'. zeta:ibsdyn.ModelWarning")
@pytest.mark.parametrize("zeta", [1e-7, 1e-3, 0.05, 0.4])
def test_peak_of_a_compliance(zeta):
    """1 / (2 zeta k sqrt(1 - zeta²)) at f sqrt(1 - 2 zeta²)."""
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    k = 2 * (2 * np.pi * 50) ** 2
    model.connection("k", "wall", "m", stiffness=k, zeta=zeta)
    peak = ibs.PeakResponse(FORCE, MOTION, band=(0.1, 1e4))
    frequency, value = peak.locate(model.linearize())
    assert value == pytest.approx(1 / (2 * zeta * k * math.sqrt(1 - zeta**2)), rel=1e-9)
    assert frequency == pytest.approx(50 * math.sqrt(1 - 2 * zeta**2), rel=1e-6)
    assert peak.unit == "m/N"


def test_peak_is_the_higher_of_two_near_ones_or_an_end_of_the_band():
    """Two modes 2e-4 apart, closer than any plotting grid, the second one higher."""
    model = ibs.Model("pair", axis="x")
    model.fixation("wall")
    for name, f, zeta in (("a", 50.0, 3e-5), ("b", 50.01, 1e-5)):
        model.rigid_body(name, mass=1.0)
        model.connection(f"k{name}", "wall", name, stiffness=(2 * np.pi * f) ** 2, zeta=zeta)
    system = model.linearize()
    stretch = ibs.Sensor("b", "x", quantity="displacement", relative_to="a")
    frequency, value = ibs.PeakResponse(FLOOR, stretch, band=(1, 500)).locate(system)
    assert frequency == pytest.approx(50.01, abs=1e-4)
    fine = np.linspace(50.009, 50.011, 200_001)
    assert value == pytest.approx(system.frf(FLOOR, stretch, fine).magnitude.max(), rel=1e-7)
    below = ibs.PeakResponse(ibs.Force("a", "x"), ibs.Sensor("a", "x"), band=(10, 40))
    assert below.locate(system)[0] == 40.0


def test_response_at_zero_where_there_is_a_limit(system):
    k = 2 * (2 * np.pi * 50) ** 2
    assert ibs.ResponseAt(FORCE, MOTION, 0).evaluate(system) == pytest.approx(1 / k)
    assert ibs.ResponseAt(FLOOR, ibs.Sensor("m", "x"), 0).evaluate(system) == pytest.approx(1)
    assert ibs.ResponseAt(FORCE, ibs.Sensor("m", "x"), 0).evaluate(system) == pytest.approx(0)
    stretch = ibs.Sensor("m", "x", quantity="displacement", relative_to="wall")
    assert ibs.ResponseAt(FLOOR, stretch, 0).evaluate(system) == pytest.approx(1 / (2 * np.pi * 50) ** 2)
    with pytest.raises(ibs.AnalysisError, match="0 Hz"):
        ibs.ResponseAt(FLOOR, MOTION, 0).evaluate(system)
    free = ibs.Model("free", axis="x")
    free.rigid_body("m", mass=4.0)
    assert ibs.ResponseAt(FORCE, ibs.Sensor("m", "x"), 0).evaluate(free.linearize()) == pytest.approx(0.25)
    with pytest.raises(ibs.AnalysisError, match="rigid-body"):
        ibs.ResponseAt(FORCE, MOTION, 0).evaluate(free.linearize())


def test_requirement(system):
    stiff = ibs.Requirement("first resonance", ibs.ModeFrequency(), 40.0, ">=")
    result = stiff.check(system)
    assert (result.met, result.unit, result.limit) == (True, "Hz", 40.0)
    assert result.margin == pytest.approx(0.25)
    assert str(result) == "first resonance: 50 Hz >= 40 Hz met, margin +25 %"
    assert str(stiff) == "first resonance: frequency of mode 1 >= 40 Hz"
    soft = ibs.Requirement("compliance", ibs.ResponseAt(FORCE, MOTION, 0), 1e-6).check(system)
    assert not soft.met
    assert soft.margin == pytest.approx(1 - soft.value / 1e-6)
    assert "NOT MET" in str(soft)
    with pytest.raises(AttributeError):
        stiff.limit = 3.0


def test_a_limit_that_is_just_reached_is_met(system):
    value = ibs.ModeFrequency().evaluate(system)
    for sense in ("<=", ">="):
        assert ibs.Requirement("f", ibs.ModeFrequency(), value, sense).check(system).met


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("", ibs.ModeFrequency(), 1.0), "name"),
        (("f", "mode 1", 1.0), "quantity"),
        (("f", ibs.ModeFrequency, 1.0), "quantity"),
        (("f", ibs.ModeFrequency(), -1.0), "limit"),
        (("f", ibs.ModeFrequency(), 1.0, "<"), "Did you mean '<='"),
    ],
)
def test_what_is_no_requirement(arguments, words):
    with pytest.raises(ibs.ModelError, match=words):
        ibs.Requirement(*arguments)
