"""What a user should know of a reduction before trusting it, in words."""

from __future__ import annotations

import numpy as np

from fem_import.component_modes import ComponentModes, Recipe
from fem_import.export_report import ExportReport
from fem_import.flexible_modes import flexible_modes
from fem_import.reduced_body import USEFUL_SHARE, ReducedBody

_NOTICEABLE = 0.01  # relative error of a frequency in the trusted range that the user is told of


def findings_about(body: ReducedBody, report: ExportReport, modes: ComponentModes, recipe: Recipe) -> tuple[str, ...]:
    """Return doubts about a body, most serious first; empty where there are none."""
    doubts = [
        _held(body, report),
        _cutoff_too_low(body) or _static_only(body, modes) or _inaccurate(body, recipe),
    ]
    return tuple(doubt for doubt in doubts if doubt is not None)


def _held(body: ReducedBody, report: ExportReport) -> str | None:
    if body.is_free:
        return None
    return (
        f"{body.source} is fixed to ground in the export ({report.support}; rigid-body residual "
        f"{report.rigid_body_residual.max():.1e}): the body cannot move freely, and its mass {report.mass:.6g} "
        "kg counts only the DoF that are present. Export the part free and hold it in the assembly if that is "
        "not meant."
    )


def _trust(body: ReducedBody) -> str:
    return (
        f"Frequencies above max_frequency / {USEFUL_SHARE} = {body.trusted_frequency:.4g} Hz are not to be trusted "
        f"(the usual factor of {USEFUL_SHARE} is a 1 % rule)."
    )


def _cutoff_too_low(body: ReducedBody) -> str | None:
    """A body is reduced to show flexibility, so at least its first flexible mode must lie where it is trusted.

    Its own reduced frequencies tell: they are too high at worst, which warns on the safe side.
    """
    flexible, _ = flexible_modes(body)
    if not len(flexible) or flexible[0] <= body.trusted_frequency:
        return None
    return (
        f"max_frequency={body.max_frequency:g} Hz is too low for {body.source}: its first flexible mode by itself is "
        f"near {flexible[0]:.4g} Hz, so the body is no more than a spring and a mass. {_trust(body)} Ask for at least "
        f"{USEFUL_SHARE * flexible[0]:.3g} Hz."
    )


def _static_only(body: ReducedBody, modes: ComponentModes) -> str | None:
    if modes.n_below or modes.next_frequency is None:
        return None
    first = modes.next_frequency
    if body.method == "guyan":
        if first >= body.max_frequency:
            return None
        return (
            f"method='guyan' keeps no mode of {body.source}, and with its interfaces held the first is at "
            f"{first:.4g} Hz, below max_frequency={body.max_frequency:g} Hz. Take 'craig-bampton', or a "
            "lower max_frequency."
        )
    return (
        f"max_frequency={body.max_frequency:g} Hz keeps no mode of {body.source} with its interfaces held; the first "
        f"is at {first:.4g} Hz. The body deforms statically only. {_trust(body)} Ask for more than {first:.4g} Hz if "
        "dynamics up to there matter."
    )


def _inaccurate(body: ReducedBody, recipe: Recipe) -> str | None:
    """The estimate is sharp below half of the cut-off, and too low above: what it shows is there at least."""
    frequencies, shapes = flexible_modes(body)
    trusted = frequencies <= body.trusted_frequency
    errors = body.reduction_errors(frequencies[trusted], shapes[:, trusted])
    if errors is None or not np.any(errors > _NOTICEABLE):
        return None
    worst = int(np.argmax(errors))
    cure = f"Raise max_frequency (now {body.max_frequency:g} Hz)."
    if recipe.method == "guyan":
        cure = "Take method='craig-bampton', which keeps modes."
    elif not recipe.inertia_vectors or recipe.min_participation:
        cure = "Take inertia_vectors=True and all modes, or raise max_frequency."
    return (
        f"The reduction raises the mode of {body.source} by itself at {frequencies[worst]:.4g} Hz by at least "
        f"{100 * errors[worst]:.2g} %. {cure}"
    )
