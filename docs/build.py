"""Build the site of the documentation: python docs/build.py [folder] [--draft].

Every page's Python runs, and what it prints and draws is put under it; the tables of the validation page come from a
run of the tests; the reference comes from the docstrings. A warning of Sphinx, a block that fails or a test that fails
ends the build. The site opens from the disk: build/site/index.html.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")
# Small matrices all along, and other work on the machine: threads of BLAS that wait for each other cost ten times more.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ["COLUMNS"] = "100"  # the width of the help of the command line
DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path[:0] = [str(DOCS), str(ROOT)]

from executed_pages import executed  # noqa: E402  modules beside this file, found by the line above
from reference_pages import reference_pages  # noqa: E402
from validation_page import validation_tables  # noqa: E402

TABLES = "<!-- tables -->"


def build(site: Path, draft: bool = False) -> None:
    """Write the site into a folder, which is replaced.

    Parameters
    ----------
    site : the folder.
    draft : leave out what takes long: pages without output and figures, no table on the validation page.

    Raises
    ------
    RuntimeError : code of a page, a test or Sphinx fails, or the folder holds something else.
    """
    try:
        from sphinx.cmd.build import main as sphinx
    except ImportError as error:
        raise RuntimeError('the site is built by Sphinx: pip install ".[docs]"') from error
    if site.exists() and any(site.iterdir()) and not (site / "objects.inv").exists():
        raise RuntimeError(f"{site} holds something that is no built site; it is not replaced. Name another folder.")
    with tempfile.TemporaryDirectory() as scratch:
        source = Path(scratch) / "source"
        source.mkdir()
        _stage(source, draft)
        made = Path(scratch) / "html"
        trees = Path(scratch) / "trees"
        if sphinx(["-q", "-W", "--keep-going", "-b", "html", "-d", str(trees), str(source), str(made)]):
            raise RuntimeError("Sphinx has warned of the above; the site was not written.")
        shutil.rmtree(site, ignore_errors=True)
        shutil.copytree(made, site)


def _stage(source: Path, draft: bool) -> None:
    """Put pages, pictures and settings into the folder that Sphinx reads."""
    shutil.copy(DOCS / "conf.py", source)
    shutil.copytree(DOCS / "_static", source / "_static")
    (source / "written").mkdir()
    for picture in DOCS.glob("*.png"):
        shutil.copy(picture, source)
    for path, text in reference_pages().items():
        (source / path).parent.mkdir(exist_ok=True)
        (source / path).write_text(text, encoding="utf-8")
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if not draft:
            with tempfile.TemporaryDirectory() as scratch:
                folder = Path(scratch) / f"{page.stem}_files"
                folder.mkdir()
                text = executed(page, folder)
                _copy(folder, "*.png", source / folder.name)
                _copy(folder, "*.html", source / "written" / folder.name)
                for picture in folder.glob("*.png"):
                    if (source / picture.name).exists():  # the page shows it by name: as it is now
                        shutil.copy(picture, source)
            if TABLES in text:
                text = text.replace(TABLES, validation_tables(_validation(source.parent)))
        (source / page.name).write_text(text, encoding="utf-8")


def _copy(folder: Path, pattern: str, target: Path) -> None:
    for file in folder.glob(pattern):
        target.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, target)


def _validation(folder: Path) -> Path:
    """Run the tests that hold numbers against others, and return the file that tells what they found."""
    found = folder / "validation.json"
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", f"--validation={found}", str(ROOT / "tests")]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if run.returncode:
        raise RuntimeError(f"tests of the validation page fail:\n{run.stdout[-3000:]}")
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "build" / "site")
    parser.add_argument("--draft", action="store_true", help="leave out output, figures and the validation table")
    arguments = parser.parse_args()
    try:
        build(arguments.folder, arguments.draft)
    except RuntimeError as error:
        sys.exit(str(error))
    print(arguments.folder / "index.html")
