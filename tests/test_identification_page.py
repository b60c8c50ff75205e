"""The page on identification runs as it is printed."""

import matplotlib.image
import pytest
from pages import run_page


def test_it_runs_and_shows_what_it_says(tmp_path, monkeypatch, capsys):
    names = run_page("identification.md", tmp_path, monkeypatch)
    assert "inside the 99 % region of the test" in capsys.readouterr().out
    assert 0.98 < names["comparison"].total_share_inside <= 1
    (resonance,) = names["comparison"].resonances
    assert resonance.test.frequency == pytest.approx(50.33, abs=0.02)  # sqrt(2.5e4 / 0.25) / 2 pi
    assert resonance.test.damping_ratio == pytest.approx(0.01, rel=0.05)
    assert matplotlib.image.imread(tmp_path / "comparison.png").shape[0] > 300
