"""reduce(): a finite-element part and its interfaces in, a ReducedBody out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fem_import.component_modes import ComponentModes, craig_bampton
from fem_import.display import display_mesh
from fem_import.errors import (
    ReductionError,
    UnknownKeywordError,
    UnknownNameError,
    nearest_known,
    warn_user,
)
from fem_import.fe_model import FEModel
from fem_import.inertia_integrals import inertia_integrals
from fem_import.interfaces import Interface, Nodes, TiedInterface, tie_interfaces
from fem_import.keywords import known_keywords
from fem_import.names import NamedItems
from fem_import.reduced_body import InterfaceFrame, ReducedBody

FloatArray: TypeAlias = NDArray[np.float64]

METHODS = ("craig-bampton",)
USEFUL_SHARE = 1.5
"""Frequencies up to the cut-off over this are right to about 1 % (plain Craig-Bampton, measured)."""


@known_keywords(UnknownKeywordError)
def reduce(
    part: FEModel,
    interfaces: Mapping[str, Interface | Nodes],
    max_frequency: float,
    tie: str = "rigid",
    method: str = "craig-bampton",
    inertia_vectors: bool = True,
) -> ReducedBody:
    """Reduce a part to its interfaces and the modes below a cut-off.

    Parameters
    ----------
    part : from ``fi.read`` or ``FEModel.from_arrays``.
    interfaces : {name: node set's name, node labels or ``fi.Interface``}.
    max_frequency : cut-off [Hz]: all modes below it are kept of the part with its interfaces held. Trust the body
        up to max_frequency / 1.5; there the error is about 1 % without, far less with inertia vectors.
    tie : "rigid" (the nodes follow the frame) or "average" (the frame follows the nodes), where an Interface does
        not say itself.
    method : "craig-bampton".
    inertia_vectors : add up to six vectors an interface that carry the inertia of the constraint modes.

    Returns
    -------
    ReducedBody over six coordinates an interface and the interior modes.

    Raises
    ------
    InterfaceError, ReductionError, UnknownNameError : what is wrong with which interface or number.

    Warns
    -----
    ExportWarning : no interior mode lies below the cut-off; the first flexible mode of the reduced part on its own
        lies above the trusted range; the part is held to ground in the export.

    Notes
    -----
    R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319.
    """
    if not isinstance(part, FEModel):
        raise ReductionError(f"part must be a fi.FEModel (from fi.read or from_arrays); got {type(part).__name__}.")
    if method not in METHODS:
        raise UnknownNameError(f"Unknown method {method!r}.{nearest_known(method, METHODS)}")
    is_number = isinstance(max_frequency, Real) and not isinstance(max_frequency, bool)
    if not is_number or not math.isfinite(max_frequency) or max_frequency <= 0.0:
        raise ReductionError(f"max_frequency must be a positive number of Hz; got {max_frequency!r}.")
    cutoff = float(max_frequency)
    tied = tie_interfaces(part, interfaces, tie)
    report = part.report()
    modes = craig_bampton(part, tied, cutoff, report.is_free, inertia_vectors)
    body = ReducedBody(
        M=modes.M,
        K=modes.K,
        C=modes.C,
        interfaces=NamedItems("interface", {item.name: _frame(item) for item in tied}),
        frequencies=modes.frequencies,
        max_frequency=cutoff,
        mass=report.mass,
        centre_of_mass=report.centre_of_mass,
        inertia=report.inertia,
        is_free=report.is_free,
        source=part.source,
        solver=modes.solver,
        inertia_integrals=inertia_integrals(part, modes.basis, modes.mass_times_basis),
        basis=modes.basis,
        display=display_mesh(part.skin, part.node_ids, part.positions, part.dofs, modes.basis),
    )
    if not report.is_free:
        warn_user(
            f"{part.source} is fixed to ground in the export ({report.support}; rigid-body residual "
            f"{report.rigid_body_residual.max():.1e}): the body cannot move freely, and its mass {report.mass:.6g} "
            "kg counts only the DoF that are present. Export the part free and hold it in the assembly if that is "
            "not meant."
        )
    doubt = _doubt_about_cutoff(part, body, modes)
    if doubt is not None:
        warn_user(doubt)
    return body


def flexible_frequencies(body: ReducedBody) -> FloatArray:
    """Return the frequencies [Hz] of the body by itself, without the six rigid-body modes of a free one."""
    scale = 1.0 / np.sqrt(np.diag(body.M))
    weights = np.outer(scale, scale)
    values = linalg.eigh(body.K * weights, body.M * weights, eigvals_only=True)
    kept = values[6:] if body.is_free else values
    return np.asarray(np.sqrt(np.maximum(kept, 0.0)) / (2.0 * np.pi))


def _frame(item: TiedInterface) -> InterfaceFrame:
    return InterfaceFrame(item.name, item.position, item.radius, item.tie, item.node_ids)


def _doubt_about_cutoff(part: FEModel, body: ReducedBody, modes: ComponentModes) -> str | None:
    """Say why a cut-off is too low to be useful; None where it serves.

    A body is reduced to show flexibility, so at least its first flexible mode must lie where the reduction is
    trusted. Its own reduced frequencies tell: they are too high at worst, which warns on the safe side.
    """
    cutoff = body.max_frequency
    flexible = flexible_frequencies(body)
    trusted = (
        f"Frequencies above max_frequency / {USEFUL_SHARE} = {cutoff / USEFUL_SHARE:.4g} Hz are not to be trusted "
        f"(the usual factor of {USEFUL_SHARE} is a 1 % rule)."
    )
    if len(flexible) and flexible[0] > cutoff / USEFUL_SHARE:
        return (
            f"max_frequency={cutoff:g} Hz is too low for {part.source}: its first flexible mode by itself is near "
            f"{flexible[0]:.4g} Hz, so the body is no more than a spring and a mass. {trusted} Ask for at least "
            f"{USEFUL_SHARE * flexible[0]:.3g} Hz."
        )
    if modes.n_below == 0 and modes.next_frequency is not None:
        return (
            f"max_frequency={cutoff:g} Hz keeps no mode of {part.source} with its interfaces held; the first is at "
            f"{modes.next_frequency:.4g} Hz. The body deforms statically only. {trusted} Ask for more than "
            f"{modes.next_frequency:.4g} Hz if dynamics up to there matter."
        )
    return None
