"""The page on requirements and budgets runs as it is printed."""

import matplotlib.image
import pytest
from pages import run_page


def test_it_runs_and_shows_what_it_says(tmp_path, monkeypatch, capsys):
    names = run_page("budget.md", tmp_path, monkeypatch)
    printed = capsys.readouterr().out
    for words in ("N·m/rad", "cross flexure", "-2 ry [rad/rad]", "RMS = one sigma", "mount.kyy", "spot jitter:"):
        assert words in printed, words
    assert sum(names["budget"].shares("part").values()) == pytest.approx(1)
    assert next(iter(names["budget"].shares("part"))) == "mount.kyy"
    for figure in ("vibration_budget.png", "shock.png"):
        assert matplotlib.image.imread(tmp_path / figure).shape[0] > 300
