"""Linear against nonlinear over amplitude."""

import matplotlib
import numpy as np
import pytest
from test_simulation import chain

import ibsdyn as ibs

matplotlib.use("Agg")
SOURCE = ibs.BaseMotion("base", "ry")
SENSORS = [ibs.Sensor("b2", "x", position=(0.1, 0.2, 0.3)), ibs.Sensor("b2", "ry")]
SINE = ibs.multisine(ibs.band_lines(2, 100, 2), 1.0, sample_rate=500)


def test_the_linear_model_holds_up_to_an_amplitude():
    check = ibs.cross_check(chain(), [1e-2, 300.0, 10.0, 1e5], SOURCE, SENSORS, SINE, tolerance=0.02)
    np.testing.assert_array_equal(check.amplitudes, [1e-2, 10.0, 300.0, 1e5])
    assert check.nonlinear.shape == (4, 2, 50)
    assert np.all(np.diff(check.deviation[:3], axis=0) > 0)
    assert check.deviation[0].max() < 1e-3
    assert list(check.failures) == [1e5]
    assert np.isinf(check.deviation[3]).all()
    assert np.isnan(check.nonlinear[3]).all()
    held = check.holds_up_to["b2.x at (0.1, 0.2, 0.3) acceleration"]
    assert held in (1e-2, 10.0)
    assert f"up to {held:g} rad/s²" in str(check)
    assert "1e+05 rad/s²: the run" in str(check)
    panels = check.plot()
    assert panels.shape == (2, 2)
    assert len(panels[0, 0].lines) == 4
    assert panels[0, 1].get_legend().get_texts()[0].get_text() == "no result"
    assert "linear up to" in panels[0, 1].get_title()


def test_tolerances_at_both_ends():
    strict = ibs.cross_check(chain(), [1.0, 10.0], SOURCE, SENSORS[0], SINE, tolerance=1e-9)
    assert list(strict.holds_up_to.values()) == [0.0]
    assert "at none of the amplitudes" in str(strict)
    assert "linear at none" in strict.plot()[0, 1].get_title()
    loose = ibs.cross_check(chain(), 1e-2, SOURCE, SENSORS[0], SINE, tolerance=0.5)
    assert "the largest that was run" in str(loose)


def test_what_cannot_be_checked_is_refused():
    with pytest.raises(ibs.ModelError, match="above zero"):
        ibs.cross_check(chain(), [0.0, 1.0], SOURCE, SENSORS, SINE)
    with pytest.raises(ibs.ModelError, match="RMS values, got 'big'"):
        ibs.cross_check(chain(), "big", SOURCE, SENSORS, SINE)
    with pytest.raises(ibs.ModelError, match=r"tolerance .* must be above 0"):
        ibs.cross_check(chain(), 1.0, SOURCE, SENSORS, SINE, tolerance=-0.1)
    with pytest.raises(ibs.ExcitationError, match="multisine"):
        ibs.cross_check(chain(), 1.0, SOURCE, SENSORS, np.zeros(9))
    with pytest.raises(ibs.SimulationError):
        ibs.cross_check(chain(), 1e6, SOURCE, SENSORS, SINE)
