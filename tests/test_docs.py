"""The documentation: the site is built without a warning, pages run, the validation page shows what tests find."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS))

from docstrings import restructured  # noqa: E402  modules of the folder docs
from executed_pages import executed  # noqa: E402
from validation_page import validation_tables  # noqa: E402

import fem_import as fi  # noqa: E402
import ibsdyn as ibs  # noqa: E402


def printed(page, folder):
    """Everything that a page prints, and the page."""
    text = executed(DOCS / page, folder)
    return "".join(re.findall(r":class: output\n\n(.*?)\n````", text, re.DOTALL)), text


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The draft of the site: all of it but what takes long."""
    pytest.importorskip("sphinx", reason='the site needs pip install ".[docs]"')
    pytest.importorskip("myst_parser", reason='the site needs pip install ".[docs]"')
    pytest.importorskip("furo", reason='the site needs pip install ".[docs]"')
    folder = tmp_path_factory.mktemp("docs") / "site"
    command = [sys.executable, str(DOCS / "build.py"), str(folder), "--draft"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return folder


def test_the_site_has_every_page_and_public_name(site):
    for page in DOCS.glob("*.md"):
        assert (site / f"{page.stem}.html").is_file(), page.name
    reference = "".join(page.read_text(encoding="utf-8") for page in (site / "api").glob("*.html"))
    for module in (ibs, fi):
        for name in module.__all__:
            assert f'id="{module.__name__}.{name}"' in reference, name
    assert "ibsdyn check mirror.toml" in reference


def test_the_site_takes_nothing_from_the_net(site):
    for page in site.rglob("*.html"):
        assert not re.search(
            r'(?:src|href)="(?:https?:)?//[^"]*\.(?:js|css|woff2?)', page.read_text(encoding="utf-8")
        ), page


def test_a_folder_with_something_else_is_not_replaced(tmp_path):
    pytest.importorskip("sphinx", reason='the site needs pip install ".[docs]"')
    (tmp_path / "thesis.tex").write_text("years of work")
    run = subprocess.run([sys.executable, str(DOCS / "build.py"), str(tmp_path)], capture_output=True, text=True)
    assert run.returncode == 1
    assert "is not replaced" in run.stderr
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_the_tutorial_runs_as_printed(tmp_path):
    output, page = printed("tutorial.md", tmp_path)
    assert "286.0 N·m/rad" in output  # I phidd / (beam / 2)
    assert "225.079" in output  # sqrt(phidd / (beam / 2)) / 2 pi
    assert "by source: sideways" in output
    assert re.search(r"jitter: \S+ rad <= 1e-06 rad met", output)  # once the CoG lies on the axis
    assert "nothing to remark" in output
    assert "Warning" not in output
    assert output.rstrip().endswith("True")
    assert (tmp_path / "review.html").stat().st_size > 100_000
    figures = re.findall(r"^!\[.*\]\(.*/(.*)\.png\)$", page, re.MULTILINE)
    assert figures == ["fidelities", "first_mode", "budget", "sensitivities", "sweep", "tolerances", "test", "history"]


def test_the_pages_on_conventions_and_import_run_as_printed(tmp_path):
    output, _ = printed("conventions.md", tmp_path)
    assert "[0.01 0.01 0.01 0.01 0.01 0.01]" in output
    assert "Did you mean" in output
    output, _ = printed("import.md", tmp_path)
    assert "13614" in output


def test_a_block_that_fails_is_named(tmp_path):
    page = tmp_path / "broken.md"
    page.write_text("```python\na = 1\n```\n\n```python\nprint(a / 0)\n```\n")
    with pytest.raises(RuntimeError, match=r"broken.md: block 2 fails: division by zero"):
        executed(page, tmp_path)


def test_the_validation_page_shows_what_tests_find(tmp_path):
    test = tmp_path / "test_numbers.py"
    test.write_text(
        "def test_both(validated):\n"
        "    validated('a | b', 'book', [1.0, 2.0], [1.0, 2.1], rtol=0.1, against='closed forms', unit='Hz')\n"
        "    validated('same', 'hand', 3, 3, atol=0.0, against='published cases')\n"
        "def test_else():\n    raise AssertionError('not chosen')\n"
    )
    (tmp_path / "conftest.py").write_text(f"import sys; sys.path.insert(0, {str(ROOT / 'tests')!r})\n")
    found = tmp_path / "found.json"
    command = [sys.executable, "-m", "pytest", "-p", "validation", "-p", "no:cacheprovider", f"--validation={found}"]
    environment = {"PYTHONPATH": f"{ROOT / 'tests'}"}
    run = subprocess.run([*command, str(test)], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout
    assert [check["deviation"] for check in json.loads(found.read_text())] == [0.0, pytest.approx(0.05)]
    tables = validation_tables(found)
    assert tables.index("## Published cases") < tables.index("## Closed forms")
    assert "| a \\| b [Hz] | 1, 2 | 1, 2.1 | 5.0e-02 | 1e-01 | book | `test_numbers.py test_both` |" in tables
    assert "| same | 3 | 3 | 0.0e+00 | exact | hand |" in tables
    test.write_text("def test_far(validated):\n    validated('far', 'book', 1, 2, rtol=0.1, against='closed forms')\n")
    run = subprocess.run([*command, str(test)], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run.returncode == 1


def test_docstrings_become_lists_and_nothing_in_them_is_markup():
    text = restructured(
        "Return |G| of ``model.x``.\n\nParameters\n----------\ninput, output : names, or\n    *numbers*.\n\n"
        "Returns\n-------\nn_ of `them`.\n"
    )
    assert text.startswith("Return \\|G\\| of ``model.x``.")
    assert ":Parameters:\n    * **input**, **output**: names, or\n      \\*numbers\\*." in text
    assert ":Returns:\n    n\\_ of ``them``." in text
