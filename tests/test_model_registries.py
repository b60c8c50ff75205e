"""Inputs, sensors, disturbances and requirements that a model keeps by name."""

import numpy as np
import pytest

import fem_import as fi
import ibsdyn as ibs


@pytest.fixture
def model():
    made = ibs.Model("oscillator", axis="x")
    made.fixation("wall")
    made.rigid_body("block", mass=2.0)
    made.connection("spring", "wall", "block", stiffness=800.0, zeta=0.01)
    return made


def test_they_are_kept_by_name_and_in_order(model):
    push = model.add_input(ibs.Force("block", "x", name="push"))
    shake = model.add_input(ibs.BaseMotion("wall", "x"))
    seen = model.add_sensor(ibs.Sensor("block", "x", name="Y1"))
    assert dict(model.inputs) == {"push": push, "wall.x acceleration": shake}
    assert model.sensors["Y1"] is seen
    with pytest.raises(TypeError):
        model.sensors["Y2"] = seen
    assert model.check() == []


def test_a_copy_keeps_them_and_goes_its_own_way(model):
    model.add_input(ibs.Force("block", "x", name="push"))
    twin = model.copy()
    assert twin == model
    twin.remove("push")
    assert twin != model
    assert "push" in model.inputs


def test_names_are_unique_over_the_whole_model(model):
    model.add_input(ibs.Force("block", "x", name="push"))
    with pytest.raises(ibs.ModelError, match="'push' is taken; inputs, sensors"):
        model.add_sensor(ibs.Sensor("block", "x", name="push"))
    with pytest.raises(ibs.ModelError, match="'spring' is taken; every component"):
        model.add_sensor(ibs.Sensor("block", "x", name="spring"))
    with pytest.raises(ibs.ModelError, match="'push' is taken"):
        model.rigid_body("push", mass=1.0)


def test_the_wrong_kind_is_refused(model):
    with pytest.raises(ibs.ModelError, match="inputs must be Force"):
        model.add_input(ibs.Sensor("block", "x"))
    with pytest.raises(ibs.ModelError, match="outputs must be Sensor"):
        model.add_sensor(ibs.Force("block", "x"))
    with pytest.raises(ibs.ModelError, match=r"must be Disturbance, Corr.* got 3"):
        model.add_disturbance(3)
    with pytest.raises(ibs.ModelError, match=r"takes an ibs\.Requirement, got 'stiff'"):
        model.add_requirement("stiff")


def test_remove_finds_them_and_answers_with_the_nearest(model):
    model.add_sensor(ibs.Sensor("block", "x", name="Y1"))
    with pytest.raises(ibs.UnknownNameError, match="Did you mean 'Y1'"):
        model.remove("Y11")
    model.remove("Y1")
    assert not model.sensors


def test_check_names_signals_that_the_model_cannot_use(model):
    model.add_sensor(ibs.Sensor("blok", "x", name="Y1"))
    model.add_input(ibs.BaseMotion("block", "x", name="shake"))
    push = ibs.Force("blokc", "x")
    model.add_disturbance(ibs.Disturbance("noise", push, ibs.PSD.white(1.0, (1.0, 10.0), "N")))
    found = model.check()
    assert sum("Did you mean 'block'" in words for words in found) == 2
    assert any("'block' is not a fixation" in words for words in found)


def test_requirements_are_checked_on_the_linear_system(model):
    assert model.check_requirements() == ()
    first = ibs.ModeFrequency(1)  # sqrt(800 / 2) / 2 pi = 3.183 Hz
    model.add_requirement(ibs.Requirement("fast enough", first, limit=3.18, sense=">="))
    model.add_requirement(ibs.Requirement("faster", first, limit=3.19, sense=">="))
    assert [result.met for result in model.check_requirements()] == [True, False]


def test_equality_sees_every_digit_and_the_order(model):
    other = ibs.Model("oscillator", axis="x")
    other.rigid_body("block", mass=2.0)
    other.fixation("wall")
    other.connection("spring", "wall", "block", stiffness=800.0, zeta=0.01)
    assert model != other
    twin = model.copy()
    twin.remove("spring")
    twin.connection("spring", "wall", "block", stiffness=800.0000000000001, zeta=0.01)
    assert model != twin
    assert model != "oscillator"
    with pytest.raises(TypeError, match="unhashable"):
        hash(model)


def test_flexible_bodies_are_equal_by_what_is_in_them(model):
    def with_bar(k):
        M, K = np.eye(6), np.zeros((6, 6))
        K[0, 0] = k
        made = ibs.Model("bar")
        made.flexible_body("bar", fi.ReducedBody.from_arrays(M, K, {"end": (0, 0, 0)}, max_frequency=10.0))
        return made

    assert with_bar(3.0) == with_bar(3.0)
    assert with_bar(3.0) != with_bar(np.nextafter(3.0, 4.0))
    assert hash(with_bar(3.0).items["bar"]) == hash(with_bar(3.0).items["bar"])
