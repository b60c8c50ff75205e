"""Required stiffness and frequency, and chains of sub-modules, against case 13 and a model."""

import pytest

import ibsdyn as ibs


def test_case_13_stiffness_and_frequency(validated):
    """Corrected eq. (6): the mirror's deflection, the beam's twice as large, the frequency without inertia."""
    by = {"against": "closed forms", "rtol": 1e-5}
    stiffness = ibs.required_stiffness(2e-3, 5.0, deflection=5e-6)
    validated("required stiffness", "torque balance k = I φ̈ / δ", 2000.0, stiffness, unit="N·m/rad", **by)
    assert ibs.required_stiffness(2e-3, 5.0, beam_deflection=1e-5) == pytest.approx(2000.0)
    frequency = ibs.required_frequency(5.0, deflection=5e-6)
    validated("required frequency", "ω² = φ̈ / δ", 159.155, frequency, unit="Hz", **by)
    assert ibs.required_frequency(5.0, beam_deflection=1e-5) == pytest.approx(159.155, rel=1e-5)
    assert ibs.mirror_deflection(beam_angle=1e-5) == pytest.approx(5e-6)
    assert ibs.mirror_deflection(beam_displacement=3e-5, distance=3.0) == pytest.approx(5e-6)


def test_shares_of_a_chain_keep_the_deflection_in_a_model():
    """The distributed stiffnesses in a 1-D model: slow acceleration gives the deflection."""
    inertias = {"frame": 3e-2, "holder": 4e-3, "mirror": 2e-4}
    shares = {"frame": 0.5, "holder": 0.3, "mirror": 0.1}
    result = ibs.distribute_stiffness(inertias, acceleration=2.0, beam_deflection=2e-6, shares=shares)
    model = ibs.Model("chain", axis="rz")
    model.fixation("base")
    below = "base"
    for name, inertia in inertias.items():
        model.rigid_body(name, inertia=inertia)
        model.connection(f"k {name}", below, name, stiffness=result.stiffness[name], zeta=0.01)
        below = name
    system = model.linearize()
    slow = ibs.ResponseAt(
        ibs.BaseMotion("base", "rz"),
        ibs.Sensor("mirror", "rz", quantity="displacement", relative_to="base"),
        0,
    )
    assert 2.0 * slow.evaluate(system) == pytest.approx(0.9 * 1e-6, rel=1e-9)
    assert result.deflection == pytest.approx(0.9e-6)
    assert result.frequency == pytest.approx(ibs.ModeFrequency().evaluate(system), rel=1e-9)
    for name in inertias:
        relative_to = {"frame": "base", "holder": "frame", "mirror": "holder"}[name]
        own = ibs.Sensor(name, "rz", quantity="displacement", relative_to=relative_to)
        part = ibs.ResponseAt(ibs.BaseMotion("base", "rz"), own, 0).evaluate(system)
        assert 2.0 * part == pytest.approx(shares[name] * 1e-6, rel=1e-9)
    assert "holder" in str(result)


def test_equal_shares_by_default_and_one_module_is_the_plain_formula():
    one = ibs.distribute_stiffness({"mirror": 2e-3}, 5.0, deflection=5e-6)
    assert one.stiffness["mirror"] == pytest.approx(2000.0)
    assert one.frequency == pytest.approx(ibs.required_frequency(5.0, deflection=5e-6))
    two = ibs.distribute_stiffness({"a": 1.0, "b": 1.0}, 1.0, deflection=1e-3)
    assert dict(two.stiffness) == pytest.approx({"a": 4000.0, "b": 2000.0})


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ibs.required_frequency(5.0), "either"),
        (lambda: ibs.required_frequency(5.0, 1e-6, 2e-6), "either"),
        (lambda: ibs.required_frequency(-5.0, 1e-6), "acceleration"),
        (lambda: ibs.mirror_deflection(beam_displacement=1e-6), "distance"),
        (lambda: ibs.mirror_deflection(beam_angle=1e-6, distance=1.0), "no distance"),
        (lambda: ibs.distribute_stiffness({}, 1.0, 1e-6), "dict"),
        (lambda: ibs.distribute_stiffness({"a": 1.0}, 1.0, 1e-6, shares={"b": 1.0}), "'b'"),
        (lambda: ibs.distribute_stiffness({1: 1.0, 2: 2.0}, 1.0, 1e-6), "text, got 1"),
        (lambda: ibs.distribute_stiffness({"a": 1.0}, 1.0, 1e-6, shares=[1.0]), "dict"),
        (lambda: ibs.distribute_stiffness({"a": 1.0, "b": 1.0}, 1.0, 1e-6, shares={"a": 1.0}), "miss 'b'"),
        (lambda: ibs.distribute_stiffness({"a": 1, "b": 1}, 1, 1e-6, shares={"a": 0.9, "b": 0.2}), "add up to 1.1"),
    ],
)
def test_what_gives_no_requirement(call, words):
    with pytest.raises(ibs.ModelError, match=words):
        call()
