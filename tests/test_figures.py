"""Figures: what they return, what is on their axes."""

import numpy as np
import pytest

import ibsdyn as ibs


@pytest.fixture
def system():
    model = ibs.Model("m")
    model.fixation("ground")
    model.rigid_body("box", mass=1.0, cog=(0, 0, 0.1), inertia=(0.01, 0.02, 0.025, 0, 0, 0))
    model.connection(
        "mount", "ground", "box", position1=(0.01, 0, 0), stiffness=(1e6, 2e6, 3e6, 1e3, 2e3, 3e3), zeta=0.01
    )
    return model.linearize()


def test_bode(system):
    frequencies = np.geomspace(1, 1000, 300)
    frf = system.frf(
        [ibs.Force("box", "x"), ibs.BaseMotion("ground", "x")],
        [ibs.Sensor("box", "x"), ibs.Sensor("box", "ry")],
        frequencies,
    )
    axes = frf.plot(label="first")
    assert axes.shape == (4, 2)
    assert axes[0, 0].get_ylabel() == "magnitude [(m/s²)/N]"
    assert axes[0, 1].get_ylabel() == "magnitude [-]"
    assert axes[1, 0].get_ylabel() == "phase [°]"
    assert axes[3, 1].get_xlabel() == "frequency [Hz]"
    assert "force box.x" in axes[0, 0].get_title()
    assert frf.plot(axes, label="second") is not None
    x, y = axes[0, 0].lines[1].get_data()
    np.testing.assert_allclose(x, frequencies)
    np.testing.assert_allclose(y, abs(frf.response[0, 0]))
    assert [t.get_text() for t in axes[0, 0].get_legend().get_texts()] == ["first", "second"]
    with pytest.raises(ValueError, match=r"\(4, 2\)"):
        frf.plot(axes[:2])


def test_modes(system):
    modes = system.modes()
    axes = modes.plot()
    heights = np.sum([[bar.get_height() for bar in container] for container in axes.containers], axis=0)
    np.testing.assert_allclose(heights, 100)
    assert axes.get_ylabel() == "share of strain energy [%]"
    shape = modes.plot_shape(2)
    assert shape.get_xlabel() == "x [mm]"
    assert f"{modes.frequencies[1]:.4g} Hz" in shape.get_title()
    with pytest.raises(ibs.AnalysisError, match="modes 1 to 6"):
        modes.plot_shape(7)


def test_a_one_dimensional_model_has_no_shape_in_space():
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=1.0)
    model.connection("k", "wall", "m", stiffness=4.0)
    with pytest.raises(ibs.AnalysisError, match="1-D"):
        model.linearize().modes().plot_shape(1)


def test_a_phase_near_half_a_turn_does_not_jump(system):
    # seen from the base, a resonance starts at +180° less next to nothing and falls to 0
    frf = system.frf(
        ibs.BaseMotion("ground", "x"),
        ibs.Sensor("box", "x", quantity="displacement", relative_to="ground"),
        np.geomspace(0.1, 50, 500),
    )
    assert frf.phase[0, 0, 0] > 179.99
    drawn = frf.plot()[1, 0].lines[0].get_ydata()
    np.testing.assert_array_equal(drawn, frf.phase[0, 0])


def test_a_phase_of_half_a_turn_that_flips_by_rounding_is_drawn_on_one_side(system):
    # one flip in two, then a true fall from -180° on
    degrees = np.array([180.0, -180.0, 179.999, -179.999, -179.0, -150.0])
    response = np.exp(1j * np.radians(degrees))[None, None]
    frf = ibs.FrequencyResponse(np.arange(1.0, 7.0), response, ("y",), ("u",), ("m",), ("N",))
    drawn = frf.plot()[1, 0].lines[0].get_ydata()
    np.testing.assert_allclose(drawn, [-180, -180, -179.999, -179.999, -179, -150], atol=1e-9)
