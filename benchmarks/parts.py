"""Quadratic tetrahedral parts of the benchmarks' own, meshed and assembled by array operations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse, special

import fem_import as fi

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]

YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7850.0  # steel [Pa, -, kg/m3]
_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # mid-edge nodes 5 to 10 in CalculiX's order (C3D10)
_AXES = ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))


@dataclass(frozen=True, eq=False)
class Part:
    """A meshed part: positions (n, 3) [m], elements (n_e, 10) with rows of positions, shape of each (n_e,).

    corners (6, 4, 3): the six shapes of tetrahedron, which are all there is on a regular grid; ends: the
    nodes of the two x faces; cutoff [Hz]: some 28 modes lie below it with both ends held.
    """

    name: str
    positions: FloatArray
    elements: IntArray
    shapes: IntArray
    corners: FloatArray
    ends: dict[str, IntArray]
    cutoff: float

    @property
    def n_dofs(self) -> int:
        """Number of degrees of freedom, three a node."""
        return 3 * len(self.positions)

    def model(self) -> fi.FEModel:
        """Return the part as an FEModel."""
        K, M = self.matrices()
        labels = np.arange(1, len(self.positions) + 1)
        sets = {name: labels[rows] for name, rows in self.ends.items()}
        return fi.FEModel.from_arrays(K, M, self.positions, 3, node_sets=sets, source=f"{self.name}-{self.n_dofs}")

    def matrices(self) -> tuple[sparse.csr_array[Any, tuple[int, int]], sparse.csr_array[Any, tuple[int, int]]]:
        """Return K and M (consistent), full and symmetric.

        The pattern is found once, for nodes; each of the 3 x 3 components is then summed into it.
        """
        n = len(self.positions)
        pairs = (self.elements[:, :, None] * n + self.elements[:, None, :]).ravel()
        keys, place = np.unique(pairs, return_inverse=True)
        del pairs
        rows, columns = np.divmod(keys, n)
        start = np.searchsorted(rows, np.arange(n + 1))
        stiffness, mass = element_matrices(self.corners)
        blocks = np.empty((len(keys), 3, 3))
        for a in range(3):
            for b in range(3):
                of_shapes = np.ascontiguousarray(stiffness[:, a::3, b::3])
                blocks[:, a, b] = np.bincount(place, of_shapes[self.shapes].ravel(), len(keys))
        K = sparse.csr_array(sparse.bsr_array((blocks, columns, start), shape=(3 * n, 3 * n)))
        del blocks
        nodal = np.bincount(place, mass[self.shapes].ravel(), len(keys))
        M = sparse.kron(sparse.csr_array((nodal, columns, start), shape=(n, n)), sparse.eye_array(3), format="csr")
        return sparse.csr_array(0.5 * (K + K.T)), sparse.csr_array(0.5 * (M + M.T))


def block(divisions: tuple[int, int, int]) -> Part:
    """Return a chunky block of 60 x 50 x 40 mm, held at its x faces."""
    cells = _cells(divisions)
    return _part("block", cells, divisions, np.array([0.06, 0.05, 0.04]), 78.2e3)


def flexure(in_plane: int, thickness: int) -> Part:
    """Return a leaf of 40 x 40 x 2 mm between two bars of 8 x 40 x 10 mm, held at the outer faces of the bars.

    in_plane: cells along 8 mm; thickness: cells along 2 mm.
    """
    divisions = (7 * in_plane, 5 * in_plane, 5 * thickness)
    cells = _cells(divisions)
    x, z = cells[:, 0], cells[:, 2]
    leaf = (z >= 2 * thickness) & (z < 3 * thickness)
    kept = (x < in_plane) | (x >= 6 * in_plane) | leaf
    return _part("flexure", cells[kept], divisions, np.array([0.056, 0.04, 0.01]), 72e3)


def element_matrices(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return K (s, 30, 30) and the nodal mass (s, 10, 10) of quadratic tetrahedra with corners (s, 4, 3)."""
    bulk = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
    shear = YOUNG / (2.0 * (1.0 + POISSON))
    jacobian = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)  # dx/dr
    volume = np.linalg.det(jacobian)  # six times it
    to_global = np.linalg.inv(jacobian)  # dr/dx
    n_shapes = len(corners)
    stiffness, mass = np.zeros((n_shapes, 10, 3, 10, 3)), np.zeros((n_shapes, 10, 10))
    for point, weight in _quadrature():
        bary = np.append(1.0 - point.sum(), point)
        bary_slope = np.vstack([-np.ones(3), np.eye(3)])
        shape = np.append(bary * (2.0 * bary - 1.0), [4.0 * bary[a] * bary[b] for a, b in _EDGES])
        slope = np.vstack(
            [(4.0 * bary[:, None] - 1.0) * bary_slope]
            + [4.0 * (bary[a] * bary_slope[b] + bary[b] * bary_slope[a])[None] for a, b in _EDGES]
        )
        gradient = np.einsum("ar,srx->sax", slope, to_global)
        factor = weight * volume
        mass += DENSITY * factor[:, None, None] * np.outer(shape, shape)
        dyad = np.einsum("s,sai,sbj->saibj", factor, gradient, gradient)
        stiffness += bulk * dyad + shear * np.einsum("sajbi->saibj", dyad)
        stiffness += shear * np.einsum("sakbk,ij->saibj", dyad, np.eye(3))
    return stiffness.reshape(n_shapes, 30, 30), mass


def _quadrature() -> list[tuple[FloatArray, float]]:
    """Points (r, s, t) and weights on the unit tetrahedron, exact to degree 5: Gauss-Jacobi, collapsed cube."""
    u, wu = special.roots_jacobi(3, 2.0, 0.0)
    v, wv = special.roots_jacobi(3, 1.0, 0.0)
    w, ww = special.roots_legendre(3)
    points = []
    for a, wa in zip((1.0 + u) / 2.0, wu / 8.0, strict=True):
        for b, wb in zip((1.0 + v) / 2.0, wv / 4.0, strict=True):
            for c, wc in zip((1.0 + w) / 2.0, ww / 2.0, strict=True):
                points.append((np.array([a, b * (1.0 - a), c * (1.0 - a) * (1.0 - b)]), float(wa * wb * wc)))
    return points


def _cells(divisions: tuple[int, int, int]) -> IntArray:
    grid = np.meshgrid(*[np.arange(n) for n in divisions], indexing="ij")
    return np.stack(grid, axis=-1).reshape(-1, 3)


def _part(name: str, cells: IntArray, divisions: tuple[int, int, int], lengths: FloatArray, cutoff: float) -> Part:
    """Split each cell into six tetrahedra along its diagonal (Kuhn): faces match from cell to cell."""
    paths = np.zeros((6, 4, 3), dtype=np.int64)  # corner to corner, one axis after the other
    for shape, axes in enumerate(_AXES):
        for step, axis in enumerate(axes):
            paths[shape, step + 1 :, axis] += 1
        if np.linalg.det(paths[shape, 1:]) < 0.0:
            paths[shape, [1, 2]] = paths[shape, [2, 1]]
    half_steps = np.concatenate(
        [2 * paths, paths[:, [a for a, _ in _EDGES]] + paths[:, [b for _, b in _EDGES]]], axis=1
    )
    n_grid = 2 * np.array(divisions) + 1
    strides = np.array([n_grid[1] * n_grid[2], n_grid[2], 1])
    at_grid = (2 * cells @ strides)[:, None, None] + half_steps @ strides
    used, elements = np.unique(at_grid.reshape(-1, 10), return_inverse=True)
    step = lengths / (n_grid - 1)
    positions = np.stack(np.unravel_index(used, n_grid), axis=-1) * step
    x = positions[:, 0]
    ends = {"left": np.flatnonzero(x < 0.1 * step[0]), "right": np.flatnonzero(x > lengths[0] - 0.1 * step[0])}
    shapes = np.tile(np.arange(6), len(cells))
    return Part(name, positions, elements.reshape(-1, 10), shapes, paths * (2.0 * step), ends, cutoff)
