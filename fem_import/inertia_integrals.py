"""Inertia integrals of a reduced body for the floating frame of reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.fe_model import FEModel
from fem_import.tall_blocks import inner

FloatArray: TypeAlias = NDArray[np.float64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_ISOTROPY = 1e-9
_NODES_AT_ONCE = 16384  # of which copies are made


@dataclass(frozen=True, eq=False)
class InertiaIntegrals:
    """Sums over the nodal masses m_ab, positions x_a (global) and basis fields psi_j, SI.

    mass: sum m_ab; first_moment (3,): sum m_ab x_b; second_moment (3, 3): sum m_ab x_a x_b^T;
    translation (3, n): sum m_ab psi_j,b; rotation (3, 3, n): [k, l, j] sum m_ab x_a,k psi_j,b,l;
    flexible (3, 3, n, n): [k, l, i, j] sum m_ab psi_i,a,k psi_j,b,l. n: all reduced coordinates.
    """

    mass: float
    first_moment: FloatArray
    second_moment: FloatArray
    translation: FloatArray
    rotation: FloatArray
    flexible: FloatArray


def inertia_integrals(part: FEModel, basis: FloatArray, mass_times_basis: FloatArray) -> InertiaIntegrals | None:
    """Integrate over a solid part; None where M is no nodal mass times the identity (beams, lost DoF).

    basis, mass_times_basis: (N, n). With M = m kron I the rows of M Psi of direction l are m psi_l, so the
    mass matrix is not touched again.
    """
    nodes = part.dof_nodes()
    order = np.lexsort((part.dofs[:, 1], nodes))
    if len(order) % 3 or np.any(part.dofs[order, 1].reshape(-1, 3) != (1, 2, 3)):
        return None
    by_axis = order.reshape(-1, 3).T
    if np.any(nodes[by_axis[0]] != nodes[by_axis[2]]):
        return None
    in_order = np.array_equal(order, np.arange(len(order)))
    nodal = _nodal_mass(part.M if in_order else sparse.csr_array(part.M[order][:, order]))
    if nodal is None:
        return None
    x = part.positions[nodes[by_axis[0]]]
    mass_x = nodal @ x
    n = basis.shape[1]

    # Over nodes: 1 and x, and the three fields, times the fields with their mass.
    moments, flexible = np.zeros((4, 3 * n)), np.zeros((3 * n, 3 * n))
    for first in range(0, len(x), _NODES_AT_ONCE):
        nodes_here = slice(first, first + _NODES_AT_ONCE)
        mass_fields = np.hstack([mass_times_basis[rows[nodes_here]] for rows in by_axis])
        moments += np.column_stack([np.ones(len(mass_fields)), x[nodes_here]]).T @ mass_fields
        flexible += inner(np.hstack([basis[rows[nodes_here]] for rows in by_axis]), mass_fields)
    return InertiaIntegrals(
        mass=float(nodal.sum()),
        first_moment=mass_x.sum(axis=0),
        second_moment=x.T @ mass_x,
        translation=moments[0].reshape(3, n),
        rotation=moments[1:].reshape(3, 3, n),
        flexible=flexible.reshape(3, n, 3, n).transpose(0, 2, 1, 3).copy(),
    )


def _nodal_mass(mass: SparseMatrix) -> SparseMatrix | None:
    """Return m of M = m kron I, rows in the order x, y, z of each node; None where M is none."""
    first, *others = (sparse.csr_array(mass[axis::3]) for axis in range(3))
    columns, left = np.divmod(first.indices, 3)
    # As a rule all three directions have the same pattern, and it takes no other matrix to see it.
    if not left.any() and all(
        np.array_equal(other.indptr, first.indptr) and np.array_equal(other.indices, first.indices + shift)
        for shift, other in enumerate(others, start=1)
    ):
        nodal = sparse.csr_array((first.data, columns, first.indptr), shape=(len(first.indptr) - 1,) * 2)
        difference = max((float(np.max(abs(other.data - first.data), initial=0.0)) for other in others), default=0.0)
    else:
        nodal = sparse.csr_array(first[:, ::3])
        apart = abs(mass - sparse.kron(nodal, sparse.eye_array(3), format="csr"))
        difference = float(apart.max()) if apart.nnz else 0.0
    return None if difference > _ISOTROPY * float(np.max(abs(nodal.data), initial=0.0)) else nodal
