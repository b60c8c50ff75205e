"""Time records: what they hold, what they refuse, how they look."""

import matplotlib
import numpy as np
import pytest

import ibsdyn as ibs

matplotlib.use("Agg")


def _record(**changes):
    given = {
        "signals": np.arange(12.0).reshape(2, 6),
        "names": ["force", "Y1"],
        "units": ["N", "m/s²"],
        "sample_rate": 3.0,
        "start": 1.0,
        "title": "run 1",
    }
    return ibs.TimeRecord(**(given | changes))


def test_time_names_and_selection():
    record = _record()
    np.testing.assert_allclose(record.time, 1.0 + np.arange(6) / 3.0)
    assert record.duration == 2.0
    np.testing.assert_array_equal(record["Y1"], np.arange(6.0, 12.0))
    swapped = record.select(["Y1", "force"])
    assert swapped.names == ("Y1", "force")
    assert swapped.units == ("m/s²", "N")
    np.testing.assert_array_equal(swapped.signals, record.signals[::-1])
    assert "2 channels x 6 samples" in repr(record)


def test_it_is_frozen_and_keeps_a_copy():
    values = np.zeros((2, 6))
    record = _record(signals=values)
    values[:] = 1.0
    assert not record.signals.any()
    with pytest.raises(ValueError, match="read-only"):
        record.signals[0, 0] = 1.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"signals": np.zeros((6, 2))}, r"Turn it over"),
        ({"signals": [[1.0, 2.0], [1.0]]}, r"unequal lengths \[2, 1\]"),
        ({"signals": [[1.0, np.nan], [0.0, 1.0]]}, r"'force' is nan at sample 1"),
        ({"names": ["a", "a"]}, "2 channels are called 'a'"),
        ({"units": ["N"]}, "1 units for 2 channels"),
        ({"sample_rate": 0.0}, "sample_rate .* positive"),
        ({"start": np.inf}, "start .* finite"),
        ({"period": 2.5}, "whole number of samples, got 2.5"),
        ({"period": 7}, "7 samples, the record only 6"),
    ],
)
def test_what_cannot_be_right_is_refused(changes, words):
    with pytest.raises(ibs.RecordError, match=words):
        _record(**changes)


def test_a_mapped_file_is_not_read_into_memory(tmp_path):
    values = np.arange(12.0).reshape(2, 6)
    np.save(tmp_path / "run.npy", values)
    mapped = np.load(tmp_path / "run.npy", mmap_mode="r")
    record = _record(signals=mapped)
    assert np.shares_memory(record.signals, mapped)
    assert not np.shares_memory(_record(signals=values).signals, values)
    np.testing.assert_array_equal(record["Y1"], values[1])


def test_an_unknown_channel_answers_with_the_nearest():
    with pytest.raises(ibs.UnknownNameError, match="Did you mean 'force'"):
        _record()["forse"]


def test_plot_has_a_panel_a_unit_and_shows_the_peaks_of_a_long_record():
    values = np.zeros((2, 100_000))
    values[1, 54_321] = 7.0
    panels = _record(signals=values).plot()
    assert [panel.get_ylabel() for panel in panels] == ["[N]", "[m/s²]"]
    assert panels[1].lines[0].get_ydata().max() == 7.0
    assert len(panels[1].lines[0].get_xdata()) < 10_000
