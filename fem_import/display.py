"""The skin of a part and how it moves with the reduced coordinates: only for drawing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]

# Corner nodes of each face of the solids whose corners come first in the node list.
_TETRAHEDRON = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_WEDGE = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_HEXAHEDRON = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
_FACES = {4: _TETRAHEDRON, 6: _WEDGE, 8: _HEXAHEDRON}
# A picture needs no more; beyond this the basis of the skin would outweigh the reduced body.
MOST_POINTS = 20_000


@dataclass(frozen=True, eq=False)
class DisplayMesh:
    """The skin of a part as flat triangles between corner nodes.

    points (p, 3) [m]; triangles (t, 3) into points; basis (3 p, n): displacement of the points, x y z each, per
    reduced coordinate [m].
    """

    points: FloatArray
    triangles: IntArray
    basis: FloatArray


def skin_of_solids(corners: list[IntArray]) -> IntArray:
    """Return the (t, 3) node labels of the outer faces of solids, quadrilaterals cut in two.

    corners: one (m, 4), (m, 6) or (m, 8) array of corner labels a kind of solid.
    """
    faces: dict[int, list[IntArray]] = {3: [], 4: []}
    for solids in corners:
        for face in _FACES[solids.shape[1]]:
            faces[len(face)].append(solids[:, face])
    triangles = [np.empty((0, 3), dtype=np.int64)]
    for size, found in faces.items():
        if not found:
            continue
        outer = _once(np.vstack(found))
        triangles += [outer] if size == 3 else [outer[:, [0, 1, 2]], outer[:, [0, 2, 3]]]
    return np.vstack(triangles)


def display_mesh(
    skin: IntArray | None, node_ids: IntArray, positions: FloatArray, dofs: IntArray, basis: FloatArray
) -> DisplayMesh | None:
    """Return the skin with its part of a reduction basis; None without a skin or with one too fine to draw.

    skin (t, 3) node labels; node_ids (N,), positions (N, 3) [m]; dofs (rows, 2) label and direction of each row of
    basis (rows, n). Directions that are constrained away stay at rest.
    """
    if skin is None or not len(skin):
        return None
    labels, triangles = np.unique(skin, return_inverse=True)
    if len(labels) > MOST_POINTS:
        return None
    order = np.argsort(node_ids, kind="stable")
    points = positions[order[np.searchsorted(node_ids[order], labels)]]
    rows = np.flatnonzero(np.isin(dofs[:, 0], labels) & (dofs[:, 1] <= 3))
    moved = np.zeros((3 * len(labels), basis.shape[1]))
    moved[3 * np.searchsorted(labels, dofs[rows, 0]) + dofs[rows, 1] - 1] = basis[rows]
    return DisplayMesh(points=points, triangles=triangles.reshape(-1, 3).astype(np.int64), basis=moved)


def _once(faces: IntArray) -> IntArray:
    """Return the faces that belong to one solid only."""
    _, first, counts = np.unique(_numbered(np.sort(faces, axis=1)), return_index=True, return_counts=True)
    return np.asarray(faces[first[counts == 1]])


def _numbered(rows: IntArray) -> IntArray:
    """Return one number a row, the same for equal rows only: to sort these is five times as fast as to sort rows."""
    numbers = np.zeros(len(rows), dtype=np.int64)
    for column in rows.T:
        part = column - column.min()
        if (int(numbers.max()) + 1) * (int(part.max()) + 1) >= 2**63:
            numbers, part = (np.unique(values, return_inverse=True)[1] for values in (numbers, part))
        numbers = numbers * (part.max() + 1) + part
    return numbers
