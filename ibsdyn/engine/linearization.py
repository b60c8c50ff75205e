"""The linearised model: Exudyn's mass matrix and the Jacobians of its forces in the undeformed state."""

from __future__ import annotations

from typing import NamedTuple

import exudyn as exu
import numpy as np

from ibsdyn.assembly import Assembly
from ibsdyn.axes import Array
from ibsdyn.elastic_parts import damping_size, stiffness_size
from ibsdyn.engine.translation import FlexibleMapping, Translation, checked_mapping, silent
from ibsdyn.errors import EngineError

# Jacobians of rigid models are symmetric to 1e-12; a floating frame's are differentiated numerically (1e-6).
ASYMMETRY_LIMIT = {"small-deflection": 1e-9, "floating-frame": 1e-4}
# Antisymmetric entries of C up to this rate [1/s] times the inertia, times the limit above, are rounding.
GYROSCOPIC_RATE = 10.0


class FullMatrices(NamedTuple):
    """M, C, K over all coordinates of an assembly, base included, before any lock is applied."""

    M: Array
    C: Array
    K: Array


def linearized_matrices(assembly: Assembly, flexible: FlexibleMapping = "small-deflection") -> FullMatrices:
    """Return Exudyn's mass matrix and the Jacobians of its forces in the undeformed state.

    Parameters
    ----------
    assembly : coordinates and joints; n coordinates.
    flexible : "small-deflection" (reduced matrices as they are) or "floating-frame" (large rigid motion of
        flexible bodies, the form that nonlinear simulations need; linearised it is the same).

    Returns
    -------
    FullMatrices of (n, n) arrays: M [kg, kg m, kg m²], C and K of the finite springs and dampers [SI].

    Raises
    ------
    ModelError : unknown ``flexible``, or a flexible body without what a floating frame needs.
    EngineError : Exudyn refuses the model or its Jacobians are unsymmetric or not finite.
    """
    checked_mapping(flexible)
    with silent():
        try:
            matrices = _exudyn_matrices(assembly, flexible)
        except (exu.ExudynError, RuntimeError) as error:
            raise EngineError(f"Exudyn refused the model: {error}") from error
    M, K, C = _symmetric(matrices, assembly, ASYMMETRY_LIMIT[flexible])
    return FullMatrices(M, C, K)


def _symmetric(matrices: Array, assembly: Assembly, limit: float) -> Array:
    """Return the symmetric parts of M, K and C after checking that nothing but rounding is lost."""
    transposed = np.swapaxes(matrices, 1, 2)
    asymmetry = np.abs(matrices - transposed)
    sizes = np.abs(np.diagonal(matrices, axis1=1, axis2=2))
    # Exudyn finds the velocity Jacobian of the gyroscopic terms by differences, about 1e-10 rad/s beside rest.
    gyroscopic = GYROSCOPIC_RATE * sizes[0]
    sizes[2] += gyroscopic
    if not (asymmetry <= limit * _scale(sizes)).all():
        # Where something cancelled in a diagonal, rounding is as large as what it is made of.
        sizes[1:] = stiffness_size(assembly), damping_size(assembly) + gyroscopic
        # What is not finite differs from itself by nan, which is not small either.
        small = asymmetry <= limit * _scale(sizes)
        if not small.all():
            worst = int(np.argmin(small.all(axis=(1, 2))))
            raise EngineError(
                f"Exudyn's {'MKC'[worst]} is unsymmetric (by up to {asymmetry[worst].max():.2g}) or not finite; please "
                "report the model."
            )
    symmetric: Array = 0.5 * (matrices + transposed)
    return symmetric


def _scale(diagonals: Array) -> Array:
    """Return the geometric mean of the diagonals' entries, (3, N) to (3, N, N)."""
    scale = np.sqrt(diagonals)
    means: Array = scale[:, :, None] * scale[:, None, :]
    return means


def _exudyn_matrices(assembly: Assembly, flexible: FlexibleMapping) -> Array:
    """Return (3, n, n) M, K and C as Exudyn has them."""
    container = exu.SystemContainer()
    translation = Translation(assembly, container.AddSystem(), flexible)
    translation.mbs.Assemble()
    settings = exu.SimulationSettings()
    # Dense Jacobians of 500 bodies take minutes, sparse ones a fraction of a second; the numbers are the same.
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    raw = translation.mbs.ComputeLinearizedSystem(simulationSettings=settings)[:3]
    return translation.over_model(np.array(raw, dtype=float))
