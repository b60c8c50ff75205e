"""Inertia integrals of a reduced body for the floating frame of reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.fe_model import FEModel
from fem_import.tall_blocks import inner

FloatArray: TypeAlias = NDArray[np.float64]

_ISOTROPY = 1e-9


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
    mass matrix is not touched again: nine products of (N/3, n) blocks are all.
    """
    nodes = part.dof_nodes()
    order = np.lexsort((part.dofs[:, 1], nodes))
    if len(order) % 3 or np.any(part.dofs[order, 1].reshape(-1, 3) != (1, 2, 3)):
        return None
    by_axis = order.reshape(-1, 3).T
    if np.any(nodes[by_axis[0]] != nodes[by_axis[2]]):
        return None
    sorted_mass = part.M[order][:, order]
    nodal = sparse.csr_array(sorted_mass[::3][:, ::3])
    difference = abs(sorted_mass - sparse.kron(nodal, sparse.eye_array(3), format="csr"))
    if difference.nnz and difference.max() > _ISOTROPY * abs(nodal).max():
        return None
    x = part.positions[nodes[by_axis[0]]]
    mass_x = nodal @ x
    fields = [basis[rows] for rows in by_axis]
    mass_fields = [mass_times_basis[rows] for rows in by_axis]
    return InertiaIntegrals(
        mass=float(nodal.sum()),
        first_moment=mass_x.sum(axis=0),
        second_moment=x.T @ mass_x,
        translation=np.array([field.sum(axis=0) for field in mass_fields]),
        rotation=np.array([[x[:, k] @ mass_fields[axis] for axis in range(3)] for k in range(3)]),
        flexible=np.array([[inner(fields[k], mass_fields[axis]) for axis in range(3)] for k in range(3)]),
    )
