"""Every example runs from the repository, and one number of it is checked."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ibsdyn as ibs

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture(scope="module")
def mirror_module():
    sys.path.insert(0, str(EXAMPLES))
    try:
        import mirror_module
    finally:
        sys.path.remove(str(EXAMPLES))
    return mirror_module


def test_mirror_module_meets_its_requirement_in_all_three_fidelities(mirror_module):
    concept, rigid, hybrid = mirror_module.predictions()
    # the concept is one spring and one inertia: closed form
    f = np.sqrt(mirror_module.pivot_stiffness() / mirror_module.moving_inertia()) / (2 * np.pi)
    assert concept.modes.frequencies[0] == pytest.approx(f, rel=1e-9)
    assert concept.beam_deflection == pytest.approx(
        2 * mirror_module.moving_inertia() * mirror_module.ANGULAR_ACCELERATION / mirror_module.pivot_stiffness(),
        rel=1e-4,
    )
    # two leaning leaf springs are the pivot of the formula, but for the screws in series
    assert rigid.modes.frequencies[0] == pytest.approx(f, rel=0.02)
    # 267.5 Hz is the unreduced FE model with its base clamped; the screws take a little of it
    assert 0.97 * 267.5 < hybrid.modes.frequencies[0] < 267.5
    for prediction in (concept, rigid, hybrid):
        assert prediction.beam_deflection < mirror_module.BEAM_DEFLECTION
        assert prediction.rotation.magnitude[0, 0, 0] == pytest.approx(1.0, abs=0.02)
    assert set(rigid.model.connections) - set(hybrid.model.connections) == {"leaf +y", "leaf -y"}


def test_mirror_module_prints_one_table_and_writes_two_figures(tmp_path):
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / "mirror_module.py"), str(tmp_path)], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    for words in ("1-D concept", "3-D rigid bodies", "hybrid with FE flexure", "requirement met", "µrad"):
        assert words in done.stdout
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mirror_module_frf.png", "mirror_module_modes.png"]


@pytest.fixture(scope="module")
def mirror_experiment():
    sys.path.insert(0, str(EXAMPLES))
    try:
        import mirror_experiment
    finally:
        sys.path.remove(str(EXAMPLES))
    return mirror_experiment


@pytest.mark.filterwarnings("ignore:.*no wider than:ibsdyn.errors.RecordWarning")  # of so few lines
def test_mirror_experiment_holds_the_model_and_shows_the_nonlinearity(mirror_experiment, monkeypatch, capsys, tmp_path):
    # a third of the lines and of the time
    monkeypatch.setattr(mirror_experiment, "LINES", ibs.band_lines(20.8, 800.0, 1.6))
    mirror_experiment.main(tmp_path)
    printed = capsys.readouterr().out
    assert "9 runs 'A z' ... 'C ry'" in printed
    assert float(re.search(r"([\d.]+) % of \d+ values inside the 99 % region", printed)[1]) > 97.0
    away = [float(share) for share in re.findall(r"per line: +([\d.]+) % of the peak", printed)]
    assert away[0] == 0.0
    assert away[1] < 1.0
    assert away[-1] > 3 * away[1]
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "mirror_experiment_amplitude.png",
        "mirror_experiment_regions.png",
    ]
