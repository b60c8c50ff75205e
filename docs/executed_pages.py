"""Markdown pages whose Python runs: what it prints and draws is put under it."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

EXAMPLE_PART = Path(__file__).parents[1] / "examples" / "mirror_flexure"
BLOCK = re.compile(r"```python\n(.*?)```\n", re.DOTALL)
FIGURE_DPI = 144  # sharp on screens with two pixels a point


def executed(page: Path, folder: Path) -> str:
    """Run the Python of a page, block after block, and return the page with output and figures put in.

    Parameters
    ----------
    page : Markdown; its blocks share one namespace and find the export of ``examples/mirror_flexure`` beside them.
    folder : where they run and what they write stays.

    Returns
    -------
    The text of the page; after each block what it printed and warned of, the PNG files it wrote, where the page does
    not show those already, and links to the HTML files. Both are named as in ``folder``, under the folder's own name.

    Raises
    ------
    RuntimeError : a block that fails, with the page and the block's number; its cause is attached.
    """
    text = page.read_text(encoding="utf-8")
    shown = set(re.findall(r"!\[[^]]*\]\(([^)]+)\)", text))
    names: dict[str, Any] = {"__name__": page.stem}
    parts, end = [], 0
    if not BLOCK.search(text):
        return text
    for export in EXAMPLE_PART.iterdir():
        shutil.copy(export, folder)
    with _in_folder(folder), plt.rc_context({"savefig.dpi": FIGURE_DPI}):
        for number, block in enumerate(BLOCK.finditer(text), start=1):
            before = _written(folder)
            try:
                output = _output(compile(block[1], f"{page.name}, block {number}", "exec"), names)
            except Exception as error:
                raise RuntimeError(f"{page.name}: block {number} fails: {error}") from error
            after = _written(folder)
            new = sorted((path for path in after if before.get(path) != after[path]), key=after.__getitem__)
            parts += [text[end : block.end()], _printed(output)]
            parts += [_shown(path) for path in new if path.name not in shown]
            end = block.end()
        plt.close("all")
    return "".join([*parts, text[end:]])


def _written(folder: Path) -> dict[Path, int]:
    """Return when each figure and each report in a folder was written."""
    return {path: path.stat().st_mtime_ns for kind in ("*.png", "*.html") for path in folder.glob(kind)}


def _shown(path: Path) -> str:
    if path.suffix == ".png":
        return f"\n![{path.stem.replace('_', ' ')}]({path.parent.name}/{path.name})\n"
    return f'\n<p class="written"><a href="{path.parent.name}/{path.name}">Open {path.name}</a></p>\n'


def _output(code: Any, names: dict[str, Any]) -> str:
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream), warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("default")
        exec(code, names)
    said = [f"{warning.category.__name__}: {warning.message}\n" for warning in warned]
    return stream.getvalue() + "".join(said)


def _printed(output: str) -> str:
    if not output.strip():
        return ""
    fence = "`" * 4
    return f"\n{fence}{{code-block}} text\n:class: output\n\n{output.rstrip()}\n{fence}\n"


@contextlib.contextmanager
def _in_folder(folder: Path) -> Iterator[None]:
    home = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(home)
