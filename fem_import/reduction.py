"""reduce(): a finite-element part and its interfaces in, a ReducedBody out."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from numbers import Real

from fem_import.component_modes import METHODS, Recipe, component_modes
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
from fem_import.progress import Progress
from fem_import.reduced_body import InterfaceFrame, ReducedBody, SensorPoint
from fem_import.reduction_cache import ReductionCache
from fem_import.reduction_findings import findings_about
from fem_import.sensor_points import ObservedPoint, observed_points
from fem_import.threads import one_blas_thread

_STAGES = 6  # of the progress bar: two here, four in component_modes


@known_keywords(UnknownKeywordError)
def reduce(
    part: FEModel,
    interfaces: Mapping[str, Interface | Nodes],
    max_frequency: float,
    tie: str = "rigid",
    method: str = "craig-bampton",
    inertia_vectors: bool = True,
    min_participation: float = 0.0,
    sensors: Mapping[str, Interface | Nodes] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> ReducedBody:
    """Reduce a part to its interfaces and the modes below a cut-off.

    Parameters
    ----------
    part : from ``fi.read`` or ``FEModel.from_arrays``.
    interfaces : {name: node set's name, node labels, a region as ``fi.Cylinder(...)`` or ``fi.Interface``}.
    max_frequency : cut-off [Hz]: all modes below it are kept. Trust the body up to max_frequency / 1.5; there the
        error is about 1 % without, far less with inertia vectors.
    tie : "rigid" (the nodes follow the frame) or "average" (the frame follows the nodes), where an Interface does
        not say itself.
    method : "craig-bampton" (modes with the interfaces held), "craig-chang" (modes of the part on its own, with
        residual flexibility: fewer for parts that hang almost free), or "guyan" (no modes: static deflections only).
    inertia_vectors : add up to six vectors an interface that carry the inertia of the constraint modes.
    min_participation : keep only modes with at least this share (0 to 1) in what some interface coordinate feels of
        the inside; of "craig-bampton" only. What is left out is largely made up for by the inertia vectors.
    sensors : {name: nodes} points that are watched, not connected (an accelerometer, the centre of a mirror): one
        node or more, whose mean motion the body then knows as "body.name", static compliance exact.
    cache : folder where bodies are kept by the content of all that made them, and taken from the next time.

    Returns
    -------
    ReducedBody over six coordinates an interface and the interior modes.

    Raises
    ------
    InterfaceError, ReductionError, UnknownNameError : what is wrong with which interface or number.

    Warns
    -----
    ExportWarning : no interior mode lies below the cut-off; the first flexible mode of the reduced part on its own
        lies above the trusted range; a mode in that range is off by more than 1 %; the part is held to ground in the
        export; a file of the cache is damaged (it is made anew).

    Notes
    -----
    R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319;
    R. R. Craig, C.-J. Chang, NASA CR-145190 (1977); R. J. Guyan, AIAA Journal 3 (1965) 380.
    """
    if not isinstance(part, FEModel):
        raise ReductionError(f"part must be a fi.FEModel (from fi.read or from_arrays); got {type(part).__name__}.")
    recipe = _recipe(method, max_frequency, inertia_vectors, min_participation)
    tied = tie_interfaces(part, interfaces, tie)
    points = observed_points(part, sensors or {}, tuple(item.name for item in tied))
    store = None if cache is None else ReductionCache(cache, part, tied, points, recipe)
    body = None if store is None else store.load()
    if body is None:
        body = _reduced(part, tied, points, recipe)
        if store is not None:
            store.save(body)
    for finding in body.findings:
        warn_user(finding)
    return body


def _recipe(method: str, max_frequency: float, inertia_vectors: bool, min_participation: float) -> Recipe:
    if method not in METHODS:
        raise UnknownNameError(f"Unknown method {method!r}.{nearest_known(method, METHODS)}")
    if not _is_number(max_frequency) or not math.isfinite(max_frequency) or max_frequency <= 0.0:
        raise ReductionError(f"max_frequency must be a positive number of Hz; got {max_frequency!r}.")
    if not _is_number(min_participation) or not 0.0 <= min_participation < 1.0:
        raise ReductionError(f"min_participation must be a share from 0 up to 1; got {min_participation!r}.")
    if min_participation > 0.0 and method != "craig-bampton":
        raise ReductionError(
            f"min_participation={min_participation:g} selects among the modes with the interfaces held, which method="
            f"{method!r} does not have. Leave it away, or take 'craig-bampton'."
        )
    return Recipe(method, float(max_frequency), bool(inertia_vectors), float(min_participation))


def _reduced(
    part: FEModel, tied: tuple[TiedInterface, ...], points: tuple[ObservedPoint, ...], recipe: Recipe
) -> ReducedBody:
    with Progress(f"reducing {part.source}", _STAGES) as progress:
        progress.stage("checking the export")
        report = part.report()
        with one_blas_thread():
            modes = component_modes(part, tied, points, recipe, report.is_free, progress)
            progress.stage("inertia integrals")
            integrals = inertia_integrals(part, modes.basis, modes.mass_times_basis)
    frames = {
        item.name: InterfaceFrame(item.name, item.position, item.radius, item.tie, item.node_ids) for item in tied
    }
    watched = {p.name: SensorPoint(p.name, p.position, p.matrix @ modes.basis[p.rows], p.node_ids) for p in points}
    body = ReducedBody(
        M=modes.M,
        K=modes.K,
        C=modes.C,
        interfaces=NamedItems("interface", frames),
        frequencies=modes.frequencies,
        max_frequency=recipe.max_frequency,
        mass=report.mass,
        centre_of_mass=report.centre_of_mass,
        inertia=report.inertia,
        is_free=report.is_free,
        source=part.source,
        solver=modes.solver,
        inertia_integrals=integrals,
        basis=modes.basis,
        display=display_mesh(part.skin, part.node_ids, part.positions, part.dofs, modes.basis),
        sensors=NamedItems("sensor point", watched),
        dynamic_compliance=modes.dynamic_compliance,
        method=recipe.method,
    )
    return replace(body, findings=findings_about(body, report, modes, recipe))


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)
