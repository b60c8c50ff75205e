"""What variants of the model came to: scatter, odds to meet each requirement, and what drives it."""

from __future__ import annotations

from html import escape

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.reporting.html import Cell, Markup, badge, number, paragraph, table, with_unit
from ibsdyn.study_results import StudyResults

# Variants of a sweep that are listed one by one.
MOST_LISTED = 40
# Parameters that are named as what drives a quantity, and the rank correlation below which none is.
NAMED, WEAK = 3, 0.1
# A histogram: its size, and the space below and beside the bars [px].
WIDTH, HEIGHT, BELOW, BESIDE = 460, 170, 38, 12
MOST_BINS = 40
# A limit further from the values than this many of their spreads is told in words: it would hide the bars.
FAR = 3.0
# Values that differ by less than this share are one.
SAME = 1e-9


def study_section(results: StudyResults) -> str:
    """Return odds, scatter and histograms of random variants, or the variants of a sweep."""
    study = results.study
    addresses = ", ".join(study.samples.addresses)
    html = [paragraph(f"{study.name}: {len(results.values)} variants of {addresses}.")]
    if study.samples.random:
        html += [_odds(results), "<h3>Scatter</h3>", _scatter(results), '<div class="small">']
        html += [
            f"<div><h3>{escape(name)}</h3>{_histogram(results, place)}</div>"
            for place, name in enumerate(results.quantities)
            if np.isfinite(results.values[:, place]).any()
        ]
        html += ["</div>", "<h3>Parameters as drawn</h3>", _parameters(results)]
    else:
        html.append(_extremes(results))
        if len(results.values) <= MOST_LISTED:
            html += ["<h3>One by one</h3>", _variants(results)]
    if results.failed:
        words = f"{len(results.failed)} variants could not be calculated, or not all of them; the first: "
        html.append(paragraph(words + str(results.failed[0]), "remark"))
    return "\n".join(html)


def _odds(results: StudyResults) -> str:
    if not results.study.requirements:
        return ""
    rows: list[list[Cell]] = []
    for requirement, odds in zip(results.study.requirements, results.odds(), strict=True):
        sign = "≤" if requirement.sense == "<=" else "≥"
        interval = f"{number(100 * odds.lower)} to {number(100 * odds.upper)} %" if odds.calculated else "–"
        rows.append(
            [
                requirement.name,
                f"{sign} {with_unit(requirement.limit, requirement.quantity.unit)}",
                with_unit(100 * odds.share, "%"),
                interval,
                badge(odds.met == odds.calculated > 0, f"{odds.met} of {odds.calculated}"),
            ]
        )
    head = [("requirement", "name"), ("limit", "number"), ("odds to meet it", "number")]
    return table([*head, ("95 % confidence", "number"), ("met by", "")], rows)


def _scatter(results: StudyResults) -> str:
    rows: list[list[Cell]] = []
    for column, (name, unit) in enumerate(zip(results.quantities, results.units, strict=True)):
        own = _calculated(results, column)
        spread = float(own.std(ddof=1)) if len(own) > 1 else float("nan")
        shown = [float(results.nominal[column]), float(own.mean()) if len(own) else float("nan"), spread]
        shown += np.percentile(own, (5, 50, 95)).tolist() if len(own) else [float("nan")] * 3
        rows.append(
            [name, "" if unit == "-" else unit, *(number(value) for value in shown), _driven_by(results, column)]
        )
    head = [("quantity", "name"), ("unit", ""), ("nominal", "number"), ("mean", "number"), ("1 σ", "number")]
    head += [("5 %", "number"), ("50 %", "number"), ("95 %", "number"), ("driven by (rank correlation)", "quiet")]
    return table(head, rows)


def _driven_by(results: StudyResults, column: int) -> str:
    if np.isfinite(results.values[:, column]).sum() < 3:
        return ""
    found = [(address, r) for address, r in results.rank_correlations(column).items() if abs(r) >= WEAK]
    return ", ".join(f"{address} {r:+.2f}".replace("-", "−") for address, r in found[:NAMED])


def _extremes(results: StudyResults) -> str:
    rows: list[list[Cell]] = []
    for column, (name, unit) in enumerate(zip(results.quantities, results.units, strict=True)):
        own = _calculated(results, column)
        shown = [float(results.nominal[column]), *((own.min(), own.max()) if len(own) else (float("nan"),) * 2)]
        rows.append([name, *(with_unit(float(value), unit) for value in shown)])
    return table([("quantity", "name"), ("nominal", "number"), ("lowest", "number"), ("highest", "number")], rows)


def _variants(results: StudyResults) -> str:
    samples = results.study.samples
    units = [f" [{unit}]" if unit != "-" else "" for unit in results.units]
    head = [(address, "number") for address in samples.addresses]
    head += [(name + unit, "number") for name, unit in zip(results.quantities, units, strict=True)]
    rows: list[list[Cell]] = []
    for parameters, values in zip(samples.values, results.values, strict=True):
        row: list[Cell] = [number(float(value)) for value in parameters]
        for column, value in enumerate(values):
            limits = results.limits(column)
            met = all(value <= each.limit if each.sense == "<=" else value >= each.limit for each in limits)
            row.append(number(float(value)) + ("" if met or np.isnan(value) else " ✗"))
        rows.append(row)
    crossed = any(str(cell).endswith("✗") for row in rows for cell in row)
    return table(head, rows) + (paragraph("✗ marks what misses a requirement.", "remark") if crossed else "")


def _parameters(results: StudyResults) -> str:
    samples = results.study.samples
    nominal = results.study.model.parameters()
    rows: list[list[Cell]] = []
    for address, own in zip(samples.addresses, samples.values.T, strict=True):
        spread = float(own.std(ddof=1)) if len(own) > 1 else float("nan")
        rows.append(
            [address, *(number(float(v)) for v in (nominal[address], own.mean(), spread, own.min(), own.max()))]
        )
    head = [("parameter [SI]", "name"), ("nominal", "number"), ("mean", "number"), ("1 σ", "number")]
    return table([*head, ("lowest", "number"), ("highest", "number")], rows)


def _histogram(results: StudyResults, column: int) -> str:
    """Return bars, the nominal value and the limits that are near as a drawing."""
    own, nominal = _calculated(results, column), float(results.nominal[column])
    low, high = min(float(own.min()), nominal), max(float(own.max()), nominal)
    if high - low <= SAME * max(abs(low), abs(high)):
        return paragraph(f"All variants have {with_unit(nominal, results.units[column])}.", "remark")
    first, last = float(own.min()), float(own.max())
    if last - first <= SAME * (high - low):  # one bar
        first, last = first - 0.02 * (high - low), last + 0.02 * (high - low)
    counts, edges = np.histogram(own, bins=np.linspace(first, last, min(MOST_BINS, 6 + len(own) // 20) + 1))
    reach = FAR * (high - low)
    limits = results.limits(column)
    near = [each.limit for each in limits if low - reach <= each.limit <= high + reach]
    low, high = min([low, *near]), max([high, *near])
    margin = 0.03 * (high - low)
    low, high = low - margin, high + margin
    floor = HEIGHT - BELOW

    def across(value: float) -> float:
        return BESIDE + (WIDTH - 2 * BESIDE) * (value - low) / (high - low)

    parts = [f'<svg class="histogram" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="histogram">']
    for count, left, right in zip(counts.tolist(), edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        tall = (floor - 8) * count / counts.max()
        wide = max(across(right) - across(left) - 0.6, 0.6)
        parts.append(f'<rect x="{across(left):.1f}" y="{floor - tall:.1f}" width="{wide:.1f}" height="{tall:.1f}"/>')
    parts.append(f'<path class="floor" d="M{BESIDE} {floor}H{WIDTH - BESIDE}"/>')
    for tick in _ticks(low, high):
        parts.append(f'<path class="floor" d="M{across(tick):.1f} {floor}v4"/>')
        parts.append(f'<text x="{across(tick):.1f}" y="{floor + 17}">{escape(number(tick))}</text>')
    unit = results.units[column]
    if unit != "-":
        parts.append(f'<text x="{WIDTH / 2:.1f}" y="{HEIGHT - 4}">[{escape(unit)}]</text>')
    parts.append(f'<path class="nominal" d="M{across(nominal):.1f} {floor}V2"/>')
    parts += [f'<path class="limit" d="M{across(limit):.1f} {floor}V2"/>' for limit in near]
    words = ["black: nominal", *(["dashed: limit"] if near else [])]
    words += [
        f"{each.name}: limit {with_unit(each.limit, unit)} far to the {'left' if each.limit < low else 'right'}"
        for each in limits
        if each.limit not in near
    ]
    return Markup("".join([*parts, "</svg>"])).text + paragraph("; ".join(words) + ".", "remark")


def _ticks(low: float, high: float) -> list[float]:
    """Return about four round values within a range."""
    raw = (high - low) / 4
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(factor for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= raw)
    first, last = np.ceil(low / step), np.floor(high / step)
    return [float(k * step) for k in np.arange(first, last + 1)]


def _calculated(results: StudyResults, column: int) -> Array:
    own = results.values[:, column]
    calculated: Array = own[np.isfinite(own)]
    return calculated
