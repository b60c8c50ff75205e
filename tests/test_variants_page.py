"""The page on variants runs as it is printed."""

from pathlib import Path

import numpy as np
from pages import run_page

ROOT = Path(__file__).parents[1]


def test_the_page_runs_as_printed(tmp_path, monkeypatch, capsys):
    names = run_page("variants.md", tmp_path, monkeypatch)
    printed = capsys.readouterr().out
    assert "frequency of mode 1" in printed
    assert "above the crane: met by" in printed
    assert (tmp_path / "tornado.png").stat().st_size > 5000
    assert (tmp_path / "tolerances.jsonl").exists()
    np.testing.assert_allclose(names["frequencies"], names["measured"].frequencies, atol=0.05)
