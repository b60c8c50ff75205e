"""Nothing is printed and no file is left beyond what the user asked for."""

import os
import subprocess
import sys

SCRIPT = """
import ibsdyn as ibs
m = ibs.Model("m")
m.fixation("ground")
m.rigid_body("box", mass=1.0, cog=(0, 0, 0.1), inertia=(0.01, 0.01, 0.01, 0, 0, 0))
m.connection("mount", "ground", "box", position1=(0, 0, 0), stiffness=(1e6, 1e6, 1e6, 1e3, 1e3, 1e3), zeta=0.01)
s = m.linearize()
s.modes()
s.frf(ibs.BaseMotion("ground", "z"), ibs.Sensor("box", "z"), [1.0, 10.0]).plot()
m.check()
"""


def run(script, folder):
    environment = {**os.environ, "HOME": str(folder), "PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "Agg"}
    environment["MPLCONFIGDIR"] = str(folder.parent / "matplotlib")  # matplotlib's own cache is not ours
    environment.pop("EXUDYN_NO_USER_SETTINGS", None)
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", script], cwd=folder, env=environment, capture_output=True, text=True
    )


def test_import_and_analysis_print_nothing_and_write_nothing(tmp_path):
    folder = tmp_path / "home"
    folder.mkdir()
    done = run(SCRIPT, folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert list(folder.rglob("*")) == []


def test_exudyn_is_given_back_as_it_was(tmp_path):
    folder = tmp_path / "home"
    folder.mkdir()
    script = "import exudyn\nbefore = exudyn.config.printToConsole\n" + SCRIPT
    done = run(script + "\nassert exudyn.config.printToConsole == before", folder)
    assert done.returncode == 0, done.stderr


def test_matplotlib_is_imported_only_when_something_is_drawn(tmp_path):
    done = run("import sys, ibsdyn, fem_import; assert 'matplotlib' not in sys.modules", tmp_path)
    assert done.returncode == 0, done.stderr


def test_only_the_engine_imports_exudyn():
    from pathlib import Path

    root = Path(__file__).parents[1]
    importers = [
        path.relative_to(root).as_posix()
        for package in ("ibsdyn", "fem_import")
        for path in (root / package).rglob("*.py")
        if any(line.strip().startswith(("import exudyn", "from exudyn")) for line in path.read_text().splitlines())
    ]
    assert importers
    assert all(path.startswith("ibsdyn/engine/") for path in importers)
    for path in (root / "fem_import").rglob("*.py"):
        assert "import ibsdyn" not in path.read_text(), path
        assert "from ibsdyn" not in path.read_text(), path
