"""Finite elements of the tests' own: bricks (HEX8, 2x2x2 Gauss) and Euler-Bernoulli beams, consistent mass."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy import sparse

STEEL = (2.1e11, 0.3, 7850.0)  # E [Pa], nu, rho [kg/m3]
_CORNERS = np.array(
    [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
)


@dataclass(frozen=True)
class OwnModel:
    K: sparse.csr_array
    M: sparse.csr_array
    positions: np.ndarray
    dofs: np.ndarray
    elements: np.ndarray
    node_sets: dict[str, np.ndarray]

    @property
    def arrays(self):
        return {"K": self.K, "M": self.M, "positions": self.positions, "dofs": self.dofs, "node_sets": self.node_sets}


def brick_matrices(size, material=STEEL):
    """K (24, 24) and M of a rectangular brick with edges `size` [m]."""
    young, nu, density = material
    lame, shear = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))
    elasticity = np.zeros((6, 6))
    elasticity[:3, :3] = lame
    elasticity += np.diag([2 * shear] * 3 + [shear] * 3)
    half = np.asarray(size) / 2
    stiffness, mass = np.zeros((24, 24)), np.zeros((24, 24))
    for point in itertools.product((-1 / np.sqrt(3), 1 / np.sqrt(3)), repeat=3):
        factors = 1 + _CORNERS * point
        shape = factors.prod(axis=1) / 8
        slope = np.array([_CORNERS[:, k] * np.delete(factors, k, 1).prod(axis=1) / 8 / half[k] for k in range(3)])
        strain = np.zeros((6, 24))
        for k in range(3):
            strain[k, k::3] = slope[k]
        for row, (a, b) in enumerate(((0, 1), (1, 2), (0, 2)), start=3):
            strain[row, a::3], strain[row, b::3] = slope[b], slope[a]
        field = np.kron(shape, np.eye(3))
        stiffness += strain.T @ elasticity @ strain * half.prod()
        mass += density * field.T @ field * half.prod()
    return stiffness, mass


def brick_block(divisions, lengths, material=STEEL, keep=None, origin=(0.0, 0.0, 0.0)):
    """A block of bricks along x, y, z; `keep(centres)` selects bricks. Sets LEFT and RIGHT: its x ends."""
    counts = np.array(divisions)
    size = np.array(lengths) / counts
    grid = np.stack(np.meshgrid(*[np.arange(n + 1) for n in counts], indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), axis=-1).reshape(-1, 3)
    if keep is not None:
        cells = cells[keep((cells + 0.5) * size)]
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    corners = (cells[:, None, :] + (_CORNERS + 1) // 2) @ strides
    used = np.unique(corners)
    elements = np.searchsorted(used, corners)
    positions = grid[used] * size
    rows = (3 * elements[:, :, None] + np.arange(3)).reshape(len(cells), 24)
    stiffness, mass = brick_matrices(size, material)
    n = 3 * len(used)

    def assemble(matrix):
        data = np.broadcast_to(matrix, (len(cells), 24, 24)).ravel()
        i, j = np.repeat(rows, 24, axis=1).ravel(), np.tile(rows, (1, 24)).ravel()
        return sparse.csr_array(sparse.coo_array((data, (i, j)), shape=(n, n)))

    labels = np.arange(1, len(used) + 1)
    sets = {
        "LEFT": labels[positions[:, 0] < 1e-12],
        "RIGHT": labels[positions[:, 0] > lengths[0] - 1e-12],
    }
    dofs = np.column_stack([np.repeat(labels, 3), np.tile([1, 2, 3], len(used))])
    return OwnModel(assemble(stiffness), assemble(mass), positions + np.array(origin), dofs, labels[elements], sets)


def euler_beam(length, n_elements, young, shear, density, area, inertia, polar):
    """An Euler-Bernoulli beam along x with rotary inertia, six DoF a node. Nodes 1..n+1."""
    n = n_elements
    h = length / n
    k, m = np.zeros((12, 12)), np.zeros((12, 12))
    for a, b, stiff, inert in ((0, 6, young * area, density * area), (3, 9, shear * polar, density * polar)):
        k[np.ix_([a, b], [a, b])] += stiff / h * np.array([[1, -1], [-1, 1]])
        m[np.ix_([a, b], [a, b])] += inert * h / 6 * np.array([[2, 1], [1, 2]])
    bend = (
        np.array(
            [
                [12, 6 * h, -12, 6 * h],
                [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                [-12, -6 * h, 12, -6 * h],
                [6 * h, 2 * h**2, -6 * h, 4 * h**2],
            ]
        )
        * young
        * inertia
        / h**3
    )
    mass = (
        np.array(
            [
                [156, 22 * h, 54, -13 * h],
                [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                [54, 13 * h, 156, -22 * h],
                [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
            ]
        )
        * density
        * area
        * h
        / 420
    )
    mass += (
        np.array(
            [
                [36, 3 * h, -36, 3 * h],
                [3 * h, 4 * h**2, -3 * h, -(h**2)],
                [-36, -3 * h, 36, -3 * h],
                [3 * h, -(h**2), -3 * h, 4 * h**2],
            ]
        )
        * density
        * inertia
        / (30 * h)
    )
    for where, sign in (([1, 5, 7, 11], 1), ([2, 4, 8, 10], -1)):  # w' = -ry
        flip = np.outer([1, sign, 1, sign], [1, sign, 1, sign])
        k[np.ix_(where, where)] += bend * flip
        m[np.ix_(where, where)] += mass * flip
    size = 6 * (n + 1)
    K, M = np.zeros((size, size)), np.zeros((size, size))
    for e in range(n):
        rows = slice(6 * e, 6 * e + 12)
        K[rows, rows] += k
        M[rows, rows] += m
    positions = np.column_stack([np.linspace(0, length, n + 1), np.zeros((n + 1, 2))])
    labels = np.arange(1, n + 2)
    dofs = np.column_stack([np.repeat(labels, 6), np.tile(np.arange(1, 7), n + 1)])
    return OwnModel(
        sparse.csr_array(K),
        sparse.csr_array(M),
        positions,
        dofs,
        np.column_stack([labels[:-1], labels[1:]]),
        {"ROOT": labels[:1], "TIP": labels[-1:]},
    )


def frequencies(K, M):
    """All frequencies [Hz] by a dense solution."""
    from scipy.linalg import eigh

    dense = [matrix.toarray() if sparse.issparse(matrix) else matrix for matrix in (K, M)]
    return np.sqrt(np.maximum(eigh(*dense, eigvals_only=True), 0.0)) / (2 * np.pi)


def flexure_block():
    """Two blocks joined by a thin leaf: soft inside, about 700 DoF."""

    def keep(centre):
        return (centre[:, 0] < 0.012) | (centre[:, 0] > 0.028) | (abs(centre[:, 2] - 0.006) < 0.0015)

    return brick_block((20, 3, 6), (0.04, 0.009, 0.012), keep=keep)
