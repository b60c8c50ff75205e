"""Tables and texts of the page; every text that comes from a model is escaped here."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np


@dataclass(frozen=True)
class Markup:
    """HTML that is right as it stands, where other texts are escaped."""

    text: str


Cell = str | Markup
# Positions smaller than this are rounding errors [m].
NO_LENGTH = 1e-9
ZOOM = "Drag across to zoom, double-click for the whole range, click a name to hide its curve."


@dataclass(frozen=True)
class Section:
    """A section of the page: anchor, heading, content."""

    anchor: str
    heading: str
    content: str

    @property
    def html(self) -> str:
        """The section as HTML."""
        return f'<section id="{self.anchor}">\n<h2>{escape(self.heading)}</h2>\n{self.content}\n</section>'


def text(cell: Cell) -> str:
    """Return a cell's HTML."""
    return cell.text if isinstance(cell, Markup) else escape(cell)


def paragraph(words: str, kind: str = "") -> str:
    """Return a paragraph, escaped."""
    return f"<p{_class(kind)}>{escape(words)}</p>"


def listed(items: Iterable[str], kind: str = "findings") -> str:
    """Return a bulleted list, escaped."""
    return f"<ul{_class(kind)}>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>"


def table(head: Sequence[tuple[str, str]], rows: Iterable[Sequence[Cell]]) -> str:
    """Return a table.

    head: heading and class of each column ("number" for figures, "name", "quiet", "point" or ""); rows: cells.
    """
    lines = ['<div class="wide"><table><thead><tr>']
    lines += [f"<th{_class(kind if kind == 'number' else '')}>{escape(words)}</th>" for words, kind in head]
    lines.append("</tr></thead><tbody>")
    for row in rows:
        cells = zip(row, head, strict=True)
        lines.append("<tr>" + "".join(f"<td{_class(kind)}>{text(cell)}</td>" for cell, (_, kind) in cells) + "</tr>")
    lines.append("</tbody></table></div>")
    return "".join(lines)


def badge(met: bool, words: str = "") -> Markup:
    """Return met or not met, told by word and by colour."""
    return Markup(
        f'<span class="badge {"good" if met else "bad"}">{escape(words or ("met" if met else "NOT MET"))}</span>'
    )


def gauge(value: float, limit: float, sense: str) -> Markup:
    """Return a small drawing: the value as a bar, the limit as a mark at three fifths of the width."""
    if not math.isfinite(value) or limit <= 0:
        return Markup("")
    end = min(max(100 * value / limit, 1.0), 166.0)
    good = value <= limit if sense == "<=" else value >= limit
    colour = "#14713f" if good else "#b42318"
    beyond = '<path d="M158 4l6 6-6 6" fill="none" stroke="#fff" stroke-width="2"/>' if end == 166.0 else ""
    return Markup(
        '<svg class="gauge" viewBox="0 0 168 20" aria-hidden="true"><rect x="0" y="4" width="168" height="12" '
        f'fill="#e8edf1"/><rect x="0" y="4" width="{end:.1f}" height="12" fill="{colour}"/>{beyond}'
        '<path d="M100 0v20" stroke="#18222d" stroke-width="2"/></svg>'
    )


def number(value: float, digits: int = 4) -> str:
    """Return a figure as people read it: 1.23·10⁻⁵ rather than 1.23e-05."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0 or 1e-4 <= abs(value) < 1e5:
        rounded = float(f"{value:.{digits}g}")
        return np.format_float_positional(rounded, trim="-").replace("-", "−")
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa.replace('-', '−')}·10{str(int(power)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def with_unit(value: float, unit: str, digits: int = 4) -> str:
    """Return a figure with its unit, where it has one."""
    return number(value, digits) if unit == "-" or math.isnan(value) else f"{number(value, digits)} {unit}"


def percent(share: float, digits: int = 3) -> str:
    """Return a share in percent with its sign: +12.5 %, −2370 %."""
    words = number(100 * share, digits)
    return f"{'+' if share > 0 else ''}{words} %"


def point(values: Sequence[float]) -> str:
    """Return a position in mm, rounding errors of a symmetric part as the zeros that they are."""
    return ", ".join(number(1e3 * value if abs(value) > NO_LENGTH else 0.0) for value in values)


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""
