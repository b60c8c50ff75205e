"""Meshes with fewer points and the edges that tell their shape: what a screen needs of an FE part."""

from __future__ import annotations

import numpy as np

from fem_import.display import DisplayMesh
from ibsdyn.axes import Array
from ibsdyn.picture.shape import NO_LINES, IntArray

# Edges of a mesh are drawn where its faces meet at more than this angle [deg], and where a face ends.
CREASE = 30.0


def thinned(mesh: DisplayMesh, most_points: int) -> tuple[Array, IntArray, IntArray]:
    """Return the (p, 3) points, (t, 3) triangles and (p,) numbers in the mesh of at most ``most_points`` points.

    Points of one cell of a cubic lattice become the one of them that is nearest to their mean: it keeps its own motion.
    """
    everything = np.arange(len(mesh.points))
    if len(mesh.points) <= most_points:
        return mesh.points, mesh.triangles, everything
    low, span = mesh.points.min(axis=0), float(np.ptp(mesh.points, axis=0).max())
    # The finest lattice that is coarse enough, by halving the interval of its cell.
    fine, coarse = span / 2000, span
    while coarse > 1.05 * fine:
        middle = (fine * coarse) ** 0.5
        count = len(np.unique(_cells(mesh.points, low, middle), axis=0))
        fine, coarse = (fine, middle) if count <= most_points else (middle, coarse)
    _, owner, counts = np.unique(_cells(mesh.points, low, coarse), axis=0, return_inverse=True, return_counts=True)
    owner = owner.ravel()
    means = np.stack([np.bincount(owner, mesh.points[:, i]) / counts for i in range(3)], axis=1)
    distance = np.linalg.norm(mesh.points - means[owner], axis=1)
    order = np.lexsort((distance, owner))
    kept = order[np.r_[0, 1 + np.flatnonzero(np.diff(owner[order]))]]
    corners = owner[mesh.triangles]
    proper = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    # Two sides of a sheet thinner than a cell fall onto each other; one of them is enough.
    _, first = np.unique(np.sort(corners[proper], axis=1), axis=0, return_index=True)
    return mesh.points[kept], corners[proper][np.sort(first)], kept


def crease_edges(points: Array, faces: IntArray) -> IntArray:
    """Return the (l, 2) edges where faces meet at an angle, or where a face ends."""
    if not len(faces):
        return NO_LINES
    normals = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(lengths > 0, lengths, 1.0)
    edges = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    unique, first, counts = np.unique(edges, axis=0, return_index=True, return_counts=True)
    pair = counts == 2
    sharp = ~pair  # an edge of one face ends it; an edge of three is a seam of the thinning
    one, other = normals[owner[first[pair]]], normals[owner[first[pair] + 1]]
    # Faces of a thinned mesh may be wound either way: the angle between planes is what counts.
    sharp[pair] = np.abs(np.sum(one * other, axis=1)) < np.cos(np.radians(CREASE))
    found: IntArray = unique[sharp]
    return found


def _cells(points: Array, low: Array, cell: float) -> IntArray:
    return np.floor((points - low) / cell).astype(np.int64)
