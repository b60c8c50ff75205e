"""The tables of the validation page, out of what the tests have found."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

HEAD = "| what | expected | found | deviation | allowed | source | test |\n|---|---|---|---|---|---|---|"
# An array beyond this is told by its size.
SHOWN = 6


def validation_tables(found: Path) -> str:
    """Return Markdown tables, one for each kind of reference, out of the file that ``pytest --validation`` wrote."""
    checks = json.loads(found.read_text(encoding="utf-8"))
    kinds = list(dict.fromkeys(check["against"] for check in checks))
    tables = []
    for kind in kinds:
        rows = [_row(check) for check in checks if check["against"] == kind]
        table = "\n".join([HEAD, *rows])
        tables.append(f'## {kind[0].upper()}{kind[1:]}\n\n<div class="validation">\n\n{table}\n\n</div>')
    return "\n\n".join(tables)


def _row(check: dict[str, Any]) -> str:
    unit = check["unit"]
    cells = [
        check["name"] + (f" [{unit}]" if unit else ""),
        _numbers(check["expected"]),
        _numbers(check["found"]),
        f"{check['deviation']:.1e}",
        _allowed(check),
        check["source"],
        f"`{check['test'].removeprefix('tests/').replace('::', ' ')}`",
    ]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _allowed(check: dict[str, Any]) -> str:
    if not check["tolerance"]:
        return "exact"
    return f"{check['tolerance']:.0e}" + ("" if check["relative"] else f" {check['unit'] or 'absolute'}")


def _numbers(values: list[float]) -> str:
    if len(values) > SHOWN:
        return f"{len(values)} values, {min(values):.4g} to {max(values):.4g}"
    return ", ".join(f"{value:.6g}" for value in values)
