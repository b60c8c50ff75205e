"""Modes: their table, their energies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ibsdyn.axes import Array
from ibsdyn.modes import Modes
from ibsdyn.reporting.html import Cell, number, paragraph, table

# Shares of energy below this are left out of the bars.
SHOWN_SHARE = 0.005
MOST_BARS = 8
# So many parts are named in the table.
NAMED = 4


def mode_section(modes: Modes, numbers: Sequence[int]) -> str:
    """Return the place of the moving picture, and the table of modes (numbers from 0)."""
    rows: list[list[Cell]] = []
    for n in numbers:
        rows.append(
            [
                str(n + 1),
                number(float(modes.frequencies[n])),
                number(100 * float(modes.damping_ratios[n]), 3),
                "rigid-body motion" if modes.rigid[n] else _leading(modes.strain_energy, n),
                _leading(modes.kinetic_energy, n),
                _raised(float(modes.reduction_errors[n])),
            ]
        )
    head = [("mode", "number"), ("frequency [Hz]", "number"), ("ζ [%]", "number")]
    head += [("strain energy in", ""), ("kinetic energy of", ""), ("raised by reduction", "number")]
    if all(row[-1] == "–" for row in rows):
        head, rows = head[:-1], [row[:-1] for row in rows]
    told = "Motions are enlarged; each mode is scaled to the same largest motion."
    elastic = [n for n in numbers if not modes.rigid[n]]
    if elastic and len(elastic) < len(numbers):
        told += f" Requirements count elastic modes only: their mode 1 is mode {elastic[0] + 1} here."
    return (
        '<div class="modes"><div><div class="view" id="mode-view"></div><div class="controls">'
        '<button type="button" id="mode-run">pause</button><label>size of the motion<input id="mode-size" type="range" '
        'min="0" max="3" step="0.05" value="1"></label></div></div><div><h3 id="mode-title" style="margin-top:0"></h3>'
        '<div class="modelist" id="mode-list"></div><h3>Strain energy</h3><div class="bars" id="mode-strain"></div>'
        '<h3>Kinetic energy</h3><div class="bars" id="mode-kinetic"></div></div></div><h3>All modes shown</h3>'
        + table(head, rows)
        + paragraph(told, "remark")
    )


def mode_data(modes: Modes, n: int) -> dict[str, Any]:
    """Return what the page's picker and bars show of a mode (from 0)."""
    return {
        "number": n + 1,
        "frequency": number(float(modes.frequencies[n])),
        "damping": number(100 * float(modes.damping_ratios[n]), 3),
        "rigid": bool(modes.rigid[n]),
        "strain": _ranked(modes.strain_energy, n),
        "kinetic": _ranked(modes.kinetic_energy, n),
    }


def _ranked(shares: Mapping[str, Array], n: int) -> list[tuple[str, float]]:
    ranked = sorted(((name, round(float(share[n]), 5)) for name, share in shares.items()), key=lambda pair: -pair[1])
    return [pair for pair in ranked if pair[1] >= SHOWN_SHARE][:MOST_BARS]


def _leading(shares: Mapping[str, Array], n: int) -> str:
    ranked = _ranked(shares, n)
    words = ", ".join(f"{name}: {100 * share:.0f}\u00a0%" for name, share in ranked[:NAMED])
    return f"{words}, …" if len(ranked) > NAMED else words


def _raised(error: float) -> str:
    if math.isnan(error) or error == 0:
        return "–"
    return "< 0.01 %" if error < 1e-4 else f"{100 * error:.2g} %"
