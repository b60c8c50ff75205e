"""Model against test, in words and tables; the curves are in `responses`."""

from __future__ import annotations

import math

from ibsdyn.comparison import Comparison
from ibsdyn.reporting.html import Cell, number, paragraph, table


def comparison_section(comparison: Comparison) -> str:
    """Return how the model stands to the test, and the place of the chart."""
    html = []
    if comparison.confidence is not None:
        share = f"{100 * comparison.total_share_inside:.1f} %"
        html.append(
            paragraph(
                f"{share} of the model's values lie inside the {100 * comparison.confidence:g} % region of the test "
                "(shaded; magnitudes within the radius of the region)."
            )
        )
    html.append('<div class="controls" id="comparison-chart-choice"></div><div id="comparison-chart"></div>')
    rows: list[list[Cell]] = []
    for o, output in enumerate(comparison.model.outputs):
        for i, input_ in enumerate(comparison.model.inputs):
            inside = [] if comparison.inside is None else [f"{100 * comparison.share_inside[o, i]:.1f} %"]
            rows.append(
                [
                    f"{input_} → {output}",
                    *inside,
                    f"{comparison.frac[o, i]:.4f}",
                    f"{100 * comparison.deviation[o, i]:.3g} %",
                ]
            )
    head = [("response", "name"), *([] if comparison.inside is None else [("inside the region", "number")])]
    html.append(table([*head, ("FRAC", "number"), ("largest deviation, of the peak", "number")], rows))
    if comparison.resonances:
        rows = []
        for pair in comparison.resonances:
            cells = [
                "–" if side is None else number(getattr(side, what) * factor)
                for what, factor in (("frequency", 1.0), ("damping_ratio", 100.0))
                for side in (pair.model, pair.test)
            ]
            error = pair.frequency_error
            off = "–" if math.isnan(error) else f"{100 * error:+.2f} %".replace("-", "−")
            rows.append([*cells[:2], off, *cells[2:], f"{pair.input} → {pair.output}"])
        head = [("model [Hz]", "number"), ("test [Hz]", "number"), ("model off by", "number")]
        head += [("ζ model [%]", "number"), ("ζ test [%]", "number"), ("seen in", "quiet")]
        html.append("<h3>Resonances</h3>" + table(head, rows))
    return "\n".join(html)
