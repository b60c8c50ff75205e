"""The code of a page in docs, run as it is printed."""

import re
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[1] / "docs"


def run_page(name: str, folder: Path, monkeypatch: Any) -> dict[str, Any]:
    """Run all Python blocks of a page, one after the other, in a folder; return the names they leave."""
    monkeypatch.chdir(folder)
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", (DOCS / name).read_text(encoding="utf-8"), re.DOTALL):
        exec(compile(block, name, "exec"), names)
    return names
