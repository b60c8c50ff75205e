"""Relative damping ratios of parts turned into the damping matrix of the whole, by modal strain energy.

C. D. Johnson, D. A. Kienholz, Finite element prediction of damping in structures with constrained viscoelastic layers,
AIAA Journal 20 (1982) 1284-1290: a mode's ratio is the mean of the ratios of all that it deforms, weighted with strain
energy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.elastic_parts import ElasticPart


def modal_diagonal(shapes: Array, matrix: Array) -> Array:
    """Return phi_r^T matrix phi_r of each column of ``shapes``."""
    diagonal: Array = np.sum(shapes * (matrix @ shapes), axis=0)
    return diagonal


def strain_energy_shares(parts: Sequence[ElasticPart], shapes: Array, rigid: np.ndarray) -> dict[str, Array]:
    """Return the share of each part in the strain energy of each mode; zero for rigid-body modes."""
    energies = np.array([part.energy(shapes) for part in parts]).reshape(len(parts), shapes.shape[1])
    total = energies.sum(axis=0)
    shares = np.where(rigid, 0.0, energies / np.where(rigid | (total == 0), 1.0, total))
    return {part.name: share for part, share in zip(parts, shares, strict=True)}


def modal_ratios(parts: Sequence[ElasticPart], shares: dict[str, Array], count: int) -> Array:
    """Return zeta_r = sum_j zeta_j E_jr / sum_j E_jr of ``count`` modes."""
    ratios = np.zeros(count)
    for part in parts:
        ratios += part.zeta * shares[part.name]
    return ratios


def damping_matrix(M: Array, K_base: Array, omega: Array, shapes: Array, rigid: np.ndarray, ratios: Array) -> Array:
    """Return the (n + n_base, n + n_base) damping matrix with given modal ratios.

    Parameters
    ----------
    M : (n, n).
    K_base : (n, n_base) coupling stiffness to the fixations.
    omega, shapes, rigid, ratios : the undamped modes with the base at rest, rad/s and -.

    Notes
    -----
    C = F diag(2 zeta_r / omega_r³) F^T with F = K Phi over all coordinates; rigid-body modes left out. On the free
    coordinates F = M Phi omega², which keeps the digits of soft modes beside stiff ones.
    """
    kept = ~rigid
    phi, w = shapes[:, kept], omega[kept]
    forces = np.vstack([M @ phi * w**2, K_base.T @ phi])
    scaled = forces * np.sqrt(2.0 * ratios[kept] / w**3)
    damping: Array = scaled @ scaled.T
    return damping
