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
SETTINGS = {"savefig.dpi": 144, "figure.dpi": 100}


def executed(page: Path, folder: Path) -> str:
    """Run the Python of a page, block after block, and return the page with output and figures put in.

    Parameters
    ----------
    page : Markdown; its blocks share one namespace and find the export of ``examples/mirror_flexure`` beside them.
    folder : where they run and what they write stays.

    Returns
    -------
    The text of the page; after each block what it printed, what it warned of and the PNG files it wrote, where the page
    does not show those already.

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
    with _in_folder(folder), plt.rc_context(SETTINGS):
        for number, block in enumerate(BLOCK.finditer(text), start=1):
            before = {path: path.stat().st_mtime_ns for path in folder.glob("*.png")}
            try:
                output = _output(compile(block[1], f"{page.name}, block {number}", "exec"), names)
            except Exception as error:
                raise RuntimeError(f"{page.name}: block {number} fails: {error}") from error
            drawn = sorted(
                (path for path in folder.glob("*.png") if before.get(path) != path.stat().st_mtime_ns),
                key=lambda path: path.stat().st_mtime_ns,
            )
            parts += [text[end : block.end()], _printed(output)]
            parts += [f"\n![{path.stem.replace('_', ' ')}]({path.name})\n" for path in drawn if path.name not in shown]
            end = block.end()
        plt.close("all")
    return "".join([*parts, text[end:]])


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
