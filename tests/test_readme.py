"""The README's code runs as it is printed."""

import re
import shlex
import shutil
from pathlib import Path

import matplotlib.image
import pytest
from pages import run_page

import ibsdyn as ibs
from ibsdyn.cli import main

ROOT = Path(__file__).parents[1]


def test_first_model_and_fe_part_run_as_printed(tmp_path, monkeypatch, capsys):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 4
    for export in (ROOT / "examples" / "mirror_flexure").iterdir():
        shutil.copy(export, tmp_path)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(compile(blocks[0], "README.md", "exec"), names)
    assert matplotlib.image.imread("transmissibility.png").shape[0] > 300
    printed = capsys.readouterr().out
    assert "nothing to remark" in printed
    assert names["system"].modes().frequencies[0] > 30
    exec(compile(blocks[1], "README.md", "exec"), names)
    assert names["record"].names == ("floor.x acceleration", "box.x at (0, 0, 0.3) acceleration")
    assert "the largest that was run" in capsys.readouterr().out
    # the third block shows two ways to add one part; each goes into a model of its own
    reading, first, second = re.split(r"\n(?=model\.)", blocks[2])
    exec(compile(reading, "README.md", "exec"), names)
    assert names["body"].mass > 0.08
    names["model"].copy().flexible_body("flexure", names["body"])
    exec(compile(first, "README.md", "exec"), names)
    names["model"].remove("flexure")
    names["model"].rigid_body("flexure", mass=0.08, cog=(0.016, 0, 0), inertia=(2e-5, 3e-5, 3.6e-5, 0, 0, 0))
    exec(compile(second, "README.md", "exec"), names)
    assert "flexure" in names["model"].items
    for block in blocks[3:]:
        exec(compile(block, "README.md", "exec"), names)
    assert names["again"] == names["model"]


def test_the_commands_run_as_printed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    commands = re.findall(
        r"^    ibsdyn (.*?)(?: +#.*)?$", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert len(commands) == 8
    for command in commands:
        assert main(shlex.split(command)) == 0, command
    assert {"mirror.html", "frf.csv", "budget.png"} <= {path.name for path in tmp_path.iterdir()}
    assert capsys.readouterr().err == ""


def test_the_page_on_reduction_runs_as_printed(tmp_path, monkeypatch, capsys):
    for export in (ROOT / "examples" / "mirror_flexure").iterdir():
        shutil.copy(export, tmp_path)
    run_page("reduction.md", tmp_path, monkeypatch)
    printed = capsys.readouterr().out
    for words in ("stiffness at tip", "no mode is missing", "above cut-off", "sensor point     probe"):
        assert words in printed, words
    assert list((tmp_path / "reduced").iterdir())


def test_the_page_on_the_experiment_runs_as_printed(tmp_path, monkeypatch, capsys):
    names = run_page("experiment.md", tmp_path, monkeypatch)
    printed = capsys.readouterr().out
    for words in ("condition number 1)", "inside the 99 % region", "platform.rz acceleration", "'A z': 7 channels"):
        assert words in printed, words
    assert names["comparison"].total_share_inside > 0.97
    assert (tmp_path / "y1_u6.png").stat().st_size > 10_000


def test_the_page_on_reviews_runs_as_printed(tmp_path, monkeypatch, capsys):
    names = run_page("review.md", tmp_path, monkeypatch)
    printed = capsys.readouterr().out
    for words in ("heavier base plate", "box.cog.z: 0.15 -> 0.1", "box.mass: 12 -> 13", "NOT MET"):
        assert words in printed, words
    assert names["history"].model("B") == names["model"]
    assert 1e5 < (tmp_path / "review.html").stat().st_size < 2e6


def test_the_page_on_model_files_runs_as_printed(tmp_path, monkeypatch, capsys):
    run_page("model_file.md", tmp_path, monkeypatch)
    printed = capsys.readouterr().out
    for words in ("first mode: ", "jitter: ", "counterweight: mass 0.1205 kg"):
        assert words in printed, words
    assert printed.count("met, margin") == 2
    text = (ROOT / "docs" / "model_file.md").read_text(encoding="utf-8")
    (parts,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    (tmp_path / "parts.toml").write_text(parts, encoding="utf-8")
    with pytest.raises(ibs.ModelFileError, match=r"flexure\.inp"):  # understood up to the export that is not there
        ibs.Model.from_toml("parts.toml")


def test_links_and_pictures_exist():
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        for target in re.findall(r"\]\((?!http)([^)#]*)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).is_file(), f"{page.name}: {target}"
