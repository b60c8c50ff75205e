"""The inside of a part with its interfaces held: one factorization for every static and modal question."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse import csgraph

from fem_import.errors import ReductionError
from fem_import.factorization import factorize
from fem_import.fe_model import FEModel
from fem_import.interfaces import TiedInterface
from fem_import.ordering import elimination_order, node_graph
from fem_import.sparse_blocks import RowParallel, absolute_product, principal_submatrix
from fem_import.threads import side_by_side

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"


class Interior:
    """The rows not on rigid interfaces: M over them and a solver that holds all interfaces.

    Held means: nodes of rigid interfaces stand still, averaged frames A u = q are prescribed. The averages
    are constraints with multipliers, bordered onto one factor of the sparse K: eliminating them would couple
    every pair of their nodes. A part that is free and has averaged interfaces only is first grounded by
    springs at six isostatic DoF. Self-balanced loads put no force into them, and the border makes all loads
    so:

        [A G A^T  -A R] [lambda]   [A G f - q]
        [(A R)^T    0 ] [  a   ] = [R^T f    ],   x = G (f - A^T lambda) + R a,   G = (K + springs)^-1

    with R the rigid motions (no columns where K itself can be factored). Nothing of the springs remains in x.
    """

    def __init__(self, part: FEModel, interfaces: tuple[TiedInterface, ...], is_free: bool) -> None:
        """Factor; raises ReductionError if a piece of the part stays loose with all interfaces held."""
        tied_rigidly = np.zeros(len(part.dofs), dtype=bool)
        for interface in interfaces:
            if interface.tie == "rigid":
                tied_rigidly[interface.rows] = True
        self.rows: IntArray = np.flatnonzero(~tied_rigidly)
        self.M: SparseMatrix
        self.M, K = side_by_side(
            lambda given: principal_submatrix(given[0], self.rows, upper=given[1]), ((part.M, False), (part.K, True))
        )
        averaged = [interface for interface in interfaces if interface.tie == "average"]
        self._averages = self._average_rows(averaged)
        needs_ground = is_free and not np.any(tied_rigidly)

        _, node_of_row = np.unique(part.dof_nodes()[self.rows], return_inverse=True)
        graph = node_graph(K, node_of_row)
        n_pieces, piece_of_node = csgraph.connected_components(graph, directed=False)
        piece_of_row = piece_of_node[node_of_row].astype(np.int64)
        if is_free:
            _refuse_separate_bodies(part, self.rows, n_pieces, piece_of_row, interfaces)
        if not needs_ground or n_pieces > 1:
            _refuse_loose_pieces(part, self.rows, n_pieces, piece_of_row, interfaces)
        order = elimination_order(graph, node_of_row) if len(self.rows) else None
        del graph

        if not is_free and not np.any(tied_rigidly):
            _refuse_held_in_part(part)
        motion = np.zeros((len(self.rows), 0))
        if needs_ground:
            centre = part.positions.mean(axis=0)
            motion = part.rigid_body_motion(centre)[self.rows]
            diagonal = K.diagonal()
            chosen = _isostatic_rows(motion)
            diagonal[chosen] *= 2.0
            K.setdiag(diagonal)
        self._motion = motion
        self._factor = factorize(K, "The stiffness with the interfaces held", order)
        self.solver = self._factor.solver
        self._compliance_of_averages = self._factor.solve(self._averages.T.copy())
        self._border = self._factor_border() if self.n_averaged else None

    @property
    def n_averaged(self) -> int:
        """Number of prescribed averages, six an averaged interface, in the order of the interfaces."""
        return len(self._averages)

    def solve(self, loads: FloatArray, averages: FloatArray | None = None) -> FloatArray:
        """Return displacements (n, k) under loads (n, k), averages prescribed (n_averaged, k) or 0."""
        free = self._factor.solve(loads)
        if self._border is None:
            return free
        gap = self._averages @ free - (0.0 if averages is None else averages)
        balance = self._motion.T @ loads
        answer = linalg.lu_solve(self._border, np.vstack([gap, balance]))
        multipliers, rigid = answer[: self.n_averaged], answer[self.n_averaged :]
        return np.asarray(free - self._compliance_of_averages @ multipliers + self._motion @ rigid)

    def _average_rows(self, averaged: list[TiedInterface]) -> FloatArray:
        dense = np.zeros((6 * len(averaged), len(self.rows)))
        for index, interface in enumerate(averaged):
            dense[6 * index : 6 * index + 6, np.searchsorted(self.rows, interface.rows)] = interface.matrix
        return dense

    def _factor_border(self) -> tuple[FloatArray, NDArray[np.int32]]:
        compliance = self._averages @ self._compliance_of_averages
        of_motion = self._averages @ self._motion
        zero = np.zeros((self._motion.shape[1],) * 2)
        border = np.block([[0.5 * (compliance + compliance.T), -of_motion], [of_motion.T, zero]])
        factor: tuple[FloatArray, NDArray[np.int32]] = linalg.lu_factor(border)
        return factor


def _isostatic_rows(motion: FloatArray) -> IntArray:
    """Return six rows that hold all rigid motions well: pivoted QR puts them far apart, as 3-2-1 does."""
    scale = np.linalg.norm(motion, axis=0)
    _, _, order = linalg.qr((motion / scale).T, mode="economic", pivoting=True)
    return np.asarray(order[:6], dtype=np.int64)


def _refuse_held_in_part(part: FEModel) -> None:
    """Refuse a part that ground holds in some directions only and no interface rigidly: its K is singular."""
    motion = part.rigid_body_motion(part.positions.mean(axis=0))
    size = np.linalg.norm(motion, axis=0)
    motion /= np.where(size > 0.0, size, 1.0)
    energy = motion.T @ (RowParallel(part.K) @ motion)
    if np.linalg.eigvalsh(0.5 * (energy + energy.T))[0] < 1e-12 * part.K.diagonal().max():
        raise ReductionError(
            f"{part.source} is held to ground in some directions and free in others (half of a symmetric part?), which "
            "averaged interfaces alone cannot bear. Tie one of them rigidly, or export the part free."
        )


def _refuse_separate_bodies(
    part: FEModel, rows: IntArray, n_pieces: int, piece_of_row: IntArray, interfaces: tuple[TiedInterface, ...]
) -> None:
    """Refuse a free part whose interfaces are on bodies that may move against each other: rounding would join them.

    rows: the inside, piece_of_row: which of its pieces each row is on. Pieces hang together by the interfaces.
    """
    owner = np.full(len(part.dofs), -1)
    owner[rows] = piece_of_row
    for number, interface in enumerate(interfaces, start=n_pieces):
        if interface.tie == "rigid":
            owner[interface.rows] = number
    links = []
    for number, interface in enumerate(interfaces, start=n_pieces):
        touched = part.K[interface.rows].indices if interface.tie == "rigid" else interface.rows
        links += [(number, other) for other in np.unique(owner[touched]).tolist()]
    ends = np.array(links).T
    size = n_pieces + len(interfaces)
    graph = sparse.coo_array((np.ones(len(links)), (ends[0], ends[1])), shape=(size, size))
    body_of_interface = csgraph.connected_components(graph, directed=False)[1][n_pieces:]
    for name_at in np.flatnonzero(body_of_interface != body_of_interface[0])[:1]:
        raise ReductionError(
            f"{part.source} is {len(np.unique(body_of_interface))} bodies that nothing joins: interface "
            f"{interfaces[0].name!r} is on one and {interfaces[name_at].name!r} on another. Join their meshes, or "
            "export and reduce each by itself and connect them in the model."
        )


def _refuse_loose_pieces(
    part: FEModel,
    rows: IntArray,
    n_pieces: int,
    piece_of_row: IntArray,
    interfaces: tuple[TiedInterface, ...],
) -> None:
    """A piece that no interface reaches makes the held stiffness singular, which a solver need not notice."""
    tied = np.concatenate([[], *(item.rows for item in interfaces if item.tie == "rigid")]).astype(np.int64)
    motion = part.rigid_body_motion(part.positions.mean(axis=0))
    # What moves of the tied rows alone does to the others is quickly seen, and enough for most pieces.
    pulled = part.K[tied].T @ motion[tied]
    touched = np.flatnonzero(np.max(abs(pulled), axis=1))
    size = absolute_product(part.K[touched], np.max(abs(motion), axis=1))
    is_held = np.zeros(len(part.dofs), dtype=bool)
    is_held[touched] = np.max(abs(pulled[touched]), axis=1) > 1e-6 * size
    loose = np.setdiff1d(np.arange(n_pieces), piece_of_row[is_held[rows]])
    if not len(loose):
        return
    motion[tied] = 0.0
    strain = np.max(abs(RowParallel(part.K) @ motion), axis=1)[rows]
    size = absolute_product(part.K, np.max(abs(motion), axis=1))[rows]
    averaged = [item for item in interfaces if item.tie == "average"]
    for piece in loose.tolist():
        members = np.flatnonzero(piece_of_row == piece)
        if np.any(strain[members] > 1e-6 * size[members]):
            continue
        node = part.dofs[rows[members[0]], 0]
        held_by = [item.name for item in averaged if np.isin(item.rows, rows[members]).any()]
        what = f"hangs only on the averaged interface {held_by[0]!r}" if held_by else "no interface reaches it"
        cure = (
            "Tie that interface rigidly, or join the pieces."
            if held_by
            else "Join the pieces, or give it an interface."
        )
        raise ReductionError(
            f"{part.source} falls into {n_pieces} pieces; the one with node {node} ({len(members)} DoF) is "
            f"loose: {what}. " + cure
        )
