"""First derivatives of modes and of their damping to the parameters of a model.

R. L. Fox, M. P. Kapoor, Rates of change of eigenvalues and eigenvectors, AIAA Journal 6 (1968) 2426-2429; for repeated
frequencies the derivatives are the eigenvalues of the projected change (I. W. Lee, G. H. Jung, Computers & Structures
62 (1997) 429-435).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.parameter_derivatives import MatrixChange, MotionBasis

# Natural frequencies nearer to each other than this, relatively, are one: their modes turn freely.
REPEATED = 1e-7
# Modal strain energy gives modes of one frequency one ratio if it is the same, within this, in every combination.
SAME_RATIO = 1e-6


@dataclass(frozen=True, eq=False)
class ModeDerivatives:
    """Derivatives of n modes to P parameters.

    Attributes
    ----------
    eigenvalues : (P, n) of omega² [(rad/s)²]; those of repeated frequencies in ascending order.
    shapes : (P, n, n) column r is the derivative of mode r, as a combination of the modes.
    eigenvalue_blocks, damping_blocks : (P, n, n) of omega² and of phi^T C phi from ratios, diagonal but for blocks of
        repeated frequencies, in the modes as they are.
    ratios : (P, n) of the damping ratios, explicit dampers included; those of repeated frequencies in the modes as they
        are.
    clusters : modes of repeated frequencies, from 0.
    uneven : those of them whose ratio depends on the choice of the modes.
    """

    eigenvalues: Array
    shapes: Array
    eigenvalue_blocks: Array
    damping_blocks: Array
    ratios: Array
    clusters: tuple[np.ndarray, ...]
    uneven: tuple[np.ndarray, ...]


def mode_derivatives(basis: MotionBasis, changes: Sequence[MatrixChange]) -> ModeDerivatives:
    """Return the derivatives of all modes to the parameters behind some changes.

    Notes
    -----
    Column r of ``shapes``: phi_s^T (K' - omega_r² M') phi_r / (omega_r² - omega_s²), s other than r; -M'_rr / 2 for
    s = r, and so within repeated frequencies, where any antisymmetric part drops out of every response.
    """
    n, omega, rigid = basis.n, basis.omega, basis.rigid
    squared = omega**2
    M, K, explicit, weighted = (
        np.array([getattr(change, name)[:n, :n] for change in changes]).reshape(-1, n, n)
        for name in ("M", "K", "explicit", "weighted")
    )
    # What strains nothing by geometry does so for every value; beside elastic modes only rounding is left of it.
    K[:, rigid, :] = 0.0
    K[:, :, rigid] = 0.0
    residual = K - squared * M
    clusters = _clusters(omega)
    together = np.eye(n, dtype=bool)
    for cluster in clusters:
        together[np.ix_(cluster, cluster)] = True
    gap = squared - squared[:, None]
    shapes = np.where(together, -0.5 * M, residual / np.where(together, 1.0, gap))
    eigenvalues = np.einsum("prr->pr", residual).copy()
    blocks = np.where(together, residual, 0.0)
    W = basis.weighted[:n, :n]
    turned = W @ shapes
    energies = weighted + turned + np.swapaxes(turned, 1, 2)
    safe = np.where(rigid, 1.0, omega)
    w = np.where(rigid, 0.0, np.diag(W))
    own = 2.0 * np.einsum("prr->pr", energies) / safe - w / safe**3 * eigenvalues
    damping = np.zeros_like(blocks)
    damping[:, np.arange(n), np.arange(n)] = np.where(rigid, 0.0, own)
    uneven = []
    for cluster in clusters:
        pick = np.ix_(cluster, cluster)
        if rigid[cluster[0]]:
            continue
        mean = float(np.mean(w[cluster]))
        even = np.abs(W[pick] - mean * np.eye(len(cluster))).max() <= SAME_RATIO * max(mean, np.finfo(float).tiny)
        if not even:
            uneven.append(cluster)
        for p in range(len(changes)):
            block = residual[p][pick]
            values, turn = np.linalg.eigh(0.5 * (block + block.T))
            eigenvalues[p, cluster] = values
            if even:
                # The modes that the parameter chooses among equals; each takes its own ratio along.
                energy = np.diag(np.diag(turn.T @ energies[p][pick] @ turn))
                o = omega[cluster[0]]
                damping[p][pick] = 2.0 / o * (turn @ energy @ turn.T) - mean / o**3 * block
    return ModeDerivatives(
        eigenvalues=eigenvalues,
        shapes=shapes,
        eigenvalue_blocks=blocks,
        damping_blocks=damping,
        ratios=_ratios(basis, shapes, eigenvalues, damping, explicit),
        clusters=tuple(clusters),
        uneven=tuple(uneven),
    )


def _ratios(basis: MotionBasis, shapes: Array, eigenvalues: Array, damping: Array, explicit: Array) -> Array:
    n, rigid = basis.n, basis.rigid
    safe = np.where(rigid, 1.0, basis.omega)
    dampers = basis.explicit[:n, :n]
    rate = np.einsum("prr->pr", damping) + np.einsum("prr->pr", explicit)
    if dampers.any():
        rate += 2.0 * np.einsum("rs,psr->pr", dampers, shapes)
    total = 2.0 * np.diag(basis.weighted)[:n] / safe + np.diag(dampers)
    ratios: Array = np.where(rigid, 0.0, rate / (2.0 * safe) - total * eigenvalues / (4.0 * safe**3))
    return ratios


def _clusters(omega: Array) -> list[np.ndarray]:
    """Return the modes that share a frequency, each group in order."""
    apart = np.diff(omega) > REPEATED * omega[1:]
    if apart.all():
        return []
    groups = np.split(np.arange(len(omega)), np.flatnonzero(apart) + 1)
    return [group for group in groups if len(group) > 1]
