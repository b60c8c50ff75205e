"""The command line, as a newcomer meets it: from `ibsdyn new` to `ibsdyn report`, mistakes included."""

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

import ibsdyn as ibs
from ibsdyn.cli import main
from ibsdyn.cli.main import COMMANDS

FLEXURE = Path(__file__).parents[1] / "examples" / "mirror_flexure"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def told(capsys):
    """Run a command; return its exit code, what it printed, and what it said to standard error."""

    def run(*words):
        code = main([str(word) for word in words])
        out, err = capsys.readouterr()
        return code, out, err

    return run


def test_the_whole_workflow_from_new_to_report(folder, told):
    assert told("new", "mirror.toml")[0] == 0
    code, out, err = told("check", "mirror.toml")
    assert (code, err) == (0, "")
    assert "nothing to remark" in out
    assert "first mode" in out
    assert " met" in out

    # a mistake in the file: the line names file, table and key, and the nearest known key
    text = Path("mirror.toml").read_text(encoding="utf-8")
    Path("wrong.toml").write_text(text.replace("mass = 0.25", "mas = 0.25"), encoding="utf-8")
    code, out, err = told("modes", "wrong.toml")
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    for words in ("wrong.toml", "rigid_body.mirror", "mas: unknown key", "Did you mean 'mass'"):
        assert words in err, err

    # heavier than allowed: the requirement is missed, and the shell knows
    Path("heavy.toml").write_text(text.replace("mass = 0.25", "mass = 0.6"), encoding="utf-8")
    code, out, _ = told("check", "heavy.toml")
    assert code == 1
    assert "NOT MET" in out

    code, out, _ = told("modes", "mirror.toml", "--plot", "energy.png")
    first = ibs.Model.from_toml("mirror.toml").linearize().modes().frequencies[0]
    assert code == 0
    assert f"{first:.4g}" in out
    code, out, _ = told("frf", "mirror.toml", "--from", 10, "--to", 500, "--save", "frf.csv", "--plot", "frf.png")
    assert code == 0
    assert len(Path("frf.csv").read_text(encoding="utf-8").splitlines()) > 1000
    code, out, _ = told("budget", "mirror.toml", "--plot", "budget.png")
    assert code == 0
    assert "one sigma" in out
    for picture in ("energy.png", "frf.png", "budget.png"):
        assert matplotlib.image.imread(picture).shape[0] > 300

    code, out, _ = told("history", "mirror.history", "--record", "heavy.toml", "--note", "first idea")
    assert code == 1
    assert told("history", "mirror.history", "--record", "mirror.toml", "--note", "lighter")[0] == 0
    code, out, _ = told("history", "mirror.history", "--diff", 1, 2)
    assert code == 0
    assert "mirror.mass: 0.6 -> 0.25" in out
    assert "now met" in out

    variants = ("--normal", "mirror.mass=2%", "--count", 30, "--workers", 1, "--results", "study.jsonl")
    code, out, _ = told("study", "mirror.toml", *variants)
    assert code == 0
    kept = Path("study.jsonl").read_bytes()

    code, out, _ = told("report", "mirror.toml", "--history", "mirror.history", *variants)
    assert code == 0
    assert Path("study.jsonl").read_bytes() == kept
    page = Path("mirror.html").read_text(encoding="utf-8")
    assert "mirror module" in page
    assert "30 of 30" in page
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_a_run_in_time_is_compared_with_the_model(folder, told):
    told("new", "mirror.toml")
    code, out, _ = told(
        "simulate", "mirror.toml", "--band", 20, 300, "--resolution", 0.5, "--amplitude", 1e-3, "--save", "run.npz"
    )
    assert code == 0
    assert "wrote run.npz" in out
    code, out, err = told("compare", "mirror.toml", "run.npz", "--band", 25, 250, "--plot", "fig7.png")
    assert code == 0, out
    assert "FRAC" in out
    assert "they agree: no value is further off than 1 % of the peak" in out
    assert "1 run for 1 input" in err  # and says what a single run cannot show
    assert matplotlib.image.imread("fig7.png").shape[0] > 300
    # against a model whose mount is 5 % softer the same record is no longer matched
    text = Path("mirror.toml").read_text(encoding="utf-8").replace("E = 113e9", "E = 107e9")
    Path("soft.toml").write_text(text, encoding="utf-8")
    code, out, _ = told("compare", "soft.toml", "run.npz", "--band", 25, 250)
    assert code == 1
    assert "they do not agree" in out


def test_a_study_goes_on_where_it_was_stopped(folder, told):
    told("new", "mirror.toml")
    words = ["study", "mirror.toml", "--normal", "mirror.mass=20%", "--count", 40, "--workers", 1, "--json"]
    code, out, _ = told(*words, "--results", "study.results")
    first = json.loads(out)
    stamp = Path("study.results").read_bytes()
    assert told(*words, "--results", "study.results")[1] == out
    assert Path("study.results").read_bytes() == stamp
    assert json.loads(told(*words)[1]) == first
    masses = ibs.monte_carlo(
        ibs.Model.from_toml("mirror.toml"), ibs.Tolerance("mirror.mass", sigma=0.2, relative=True), 40
    )
    assert first["variants"] == len(masses)
    assert code in (0, 1)
    code, out, _ = told("study", "mirror.toml", "--sweep", "mirror.mass=0.2:0.3:3", "--modes", 1, "--plot", "sweep.png")
    assert code == 0
    assert "frequency of mode 1" in out
    assert "mirror.mass" in told("study", "mirror.toml", "--list")[1]


def test_a_part_is_imported_reduced_and_named_in_a_model(folder, told):
    for export in FLEXURE.iterdir():
        shutil.copy(export, folder)
    code, out, _ = told("import", "flexure.inp")
    assert code == 0
    assert "flexure" in out
    code, out, _ = told(
        "reduce", "flexure.inp", "--interface", "base=BASE", "tip=TIP", "--max-frequency", 8000, "--check",
        "--save", "flexure.npz",
    )  # fmt: skip
    assert code == 0
    assert "Sturm count: no mode is missing" in out
    Path("hybrid.toml").write_text(
        '[model]\nname = "hybrid"\n[fixation.frame]\nposition = [0, 0, 0]\n'
        '[flexible_body.flexure]\nreduced = "flexure.npz"\nzeta = 0.002\n'
        '[connection.clamp]\nbetween = ["frame", "flexure.base"]\nstiffness = [inf, inf, inf, inf, inf, inf]\n',
        encoding="utf-8",
    )
    code, out, _ = told("modes", "hybrid.toml", "--json")
    frequencies = json.loads(out)["frequencies [Hz]"]
    assert frequencies[0] == pytest.approx(ibs.Model.from_toml("hybrid.toml").linearize().modes().frequencies[0])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["mods", "mirror.toml"], "Did you mean 'modes'"),
        ([], "command"),
        (["modes"], "model"),
        (["modes", "absent.toml"], "absent.toml"),
        (["new", "mirror.txt"], "ends in .toml"),
        (["new", "mirror.toml"], "is there already"),
        (["frf", "mirror.toml", "--inputs", "shaek"], "Did you mean 'shake'"),
        (["frf", "mirror.toml", "--from", "100", "--to", "10"], "ascends"),
        (["frf", "mirror.toml", "--plot", "out.xyz"], "it is written as one of"),
        (["study", "mirror.toml"], "give tolerances"),
        (["study", "mirror.toml", "--normal", "mirror.mas=2%"], "Did you mean 'mirror.mass'"),
        (["study", "mirror.toml", "--normal", "mirror.mass"], "ADDRESS=VALUE"),
        (["study", "mirror.toml", "--sweep", "mirror.mass=1:2"], "FROM:TO:COUNT"),
        (["history", "absent.history"], "does not exist; --record MODEL makes it"),
        (["history", "mirror.toml", "--diff", "1", "2"], "mirror.toml"),
        (["import", "mirror.toml"], "mirror.toml"),
        (["reduce", "x.inp", "--interface", "base", "--max-frequency", "1"], "x.inp"),
        (["import", "x.inp", "--with", "nodes"], "NAME=FILE"),
        (["compare", "mirror.toml", "absent.npz"], "absent.npz"),
        (["simulate", "mirror.toml", "--band", "10", "100", "--amplitude", "nan"], "amplitude"),
        (["report", "mirror.toml", "--save", "absent/review.html"], "absent"),
        (["modes", "mirror.toml", "--jsn"], "ibsdyn modes: error: there is no --jsn. Did you mean '--json'?"),
        (["modes", "mirror.toml", "twice.toml"], "'twice.toml' is one argument too many"),
        (["modes", "mirror.tml"], "Beside it: mirror.toml"),
        (["frf", "mirror.toml", "--save", "absent/frf.csv"], "the folder absent does not exist; make it first"),
        (["simulate", "mirror.toml", "--band", "1", "9", "--amplitude", "1", "--save", "run.xls"], "one of .npz, .csv"),
        (["study", "mirror.toml", "--normal", "mirror.mass=2%", "--results", "."], "is a folder"),
    ],
)
def test_mistakes_are_one_line_and_exit_with_2(folder, told, words, said):
    told("new", "mirror.toml")
    code, out, err = told(*words)
    assert code == 2
    assert out == ""
    assert said in err
    assert err.strip().count("\n") == 0
    assert "Traceback" not in err
    assert ".." not in err
    assert [entry.name for entry in folder.iterdir()] == ["mirror.toml"]


@pytest.mark.parametrize("command", [command.NAME for command in COMMANDS])
def test_every_command_explains_itself_by_example(told, command):
    code, out, _ = told(command, "--help")
    assert code == 0
    assert f"  ibsdyn {command} " in out
    assert "--json" in out


def test_json_is_one_object_even_where_numbers_are_not_finite(folder, told):
    told("new", "mirror.toml")
    for words in (["check", "mirror.toml"], ["modes", "mirror.toml"], ["budget", "mirror.toml"]):
        _, out, _ = told(*words, "--json")
        assert isinstance(json.loads(out), dict)
    from ibsdyn.cli.outcome import Outcome

    odd = Outcome("", {"a": np.array([1.0, np.inf]), "b": 1j, "c": {"d": np.bool_(True)}, "e": np.int64(3)})
    assert json.loads(odd.to_json()) == {"a": [1.0, "inf"], "b": {"real": 0.0, "imag": 1.0}, "c": {"d": True}, "e": 3}


def test_the_program_itself(folder):
    def run(*words):
        return subprocess.run([sys.executable, "-m", "ibsdyn", *words], capture_output=True, text=True, timeout=120)

    assert run("new", "mirror.toml").returncode == 0
    assert "ibsdyn" in run("--version").stdout
    failed = run("modes", "absent.toml")
    assert failed.returncode == 2
    assert "Traceback" not in failed.stderr
    piped = subprocess.run(
        f"{sys.executable} -m ibsdyn modes mirror.toml | head -1", shell=True, capture_output=True, text=True
    )
    assert "Traceback" not in piped.stderr
    assert "BrokenPipe" not in piped.stderr


def test_every_line_of_the_page_runs_in_an_empty_folder(folder, told):
    page = (Path(__file__).parents[1] / "docs" / "command_line.md").read_text(encoding="utf-8")
    lines = [line for block in re.findall(r"```sh\n(.*?)```", page, re.DOTALL) for line in block.splitlines()]
    used = set()
    for line in lines:
        program, command, *words = shlex.split(line)
        assert program == "ibsdyn"
        code, _, err = told(command, *words)
        assert code == 0, f"{line}: {err}"
        used.add(command)
    assert {each.NAME for each in COMMANDS} - used == {"import", "reduce"}  # these need an export
    assert Path("review.html").stat().st_size > 50_000
