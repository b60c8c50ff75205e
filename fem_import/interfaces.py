"""Sets of nodes tied to one frame of six degrees of freedom: rigidly (RBE2) or on average (RBE3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_import.errors import InterfaceError, UnknownNameError, nearest_known
from fem_import.fe_model import FEModel
from fem_import.rigid_motion import rigid_motion_of_dofs
from fem_import.selection import Selection

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
Nodes: TypeAlias = "str | Sequence[int] | IntArray | Selection"

TIES = ("rigid", "average")
_RANK_TOLERANCE = 1e-6  # of the interface's own size: flatter sets of nodes do not hold a rotation


@dataclass(frozen=True, eq=False)
class Interface:
    """What is tied to a frame.

    Attributes
    ----------
    nodes : a node set's name, node labels, or a region as ``fi.Cylinder(...)``.
    position : (3,) of the frame [m]; the mean of the nodes if None.
    tie : "rigid" (RBE2) or "average" (RBE3, adds no stiffness); None takes that of `reduce`.
    weights : of an average: "area", or one positive number a node in the order of ascending labels; all equal if
        None. "area" gives each node its share of the faces between the nodes, so that a fine mesh on one side does
        not pull the average there; nodes without a share (the middles of edges) leave it.
    """

    nodes: Nodes
    position: ArrayLike | None = None
    tie: str | None = None
    weights: ArrayLike | str | None = None


@dataclass(frozen=True, eq=False)
class TiedInterface:
    """An interface resolved on a model.

    position (3,) [m]; node_ids (n_i,); radius: largest distance of a node from the frame [m]; rows: of the
    model's matrices that take part (m,); matrix: rigid: T (m, 6), u = T q; average: A (6, m), q = A u.
    """

    name: str
    tie: str
    position: FloatArray
    node_ids: IntArray
    radius: float
    rows: IntArray
    matrix: FloatArray


def check_tie(tie: object) -> str:
    """Return the tie if it is known; UnknownNameError otherwise."""
    if not isinstance(tie, str) or tie not in TIES:
        raise UnknownNameError(f"Unknown tie {tie!r}.{nearest_known(tie, TIES)}")
    return tie


def tie_interfaces(
    part: FEModel, interfaces: Mapping[str, Interface | Nodes], default_tie: str
) -> tuple[TiedInterface, ...]:
    """Resolve interfaces on a model. Raises InterfaceError in words, UnknownNameError for sets and ties."""
    check_tie(default_tie)
    if not isinstance(interfaces, Mapping) or not interfaces:
        raise InterfaceError(f"interfaces must be a mapping {{name: nodes}} with at least one; got {interfaces!r}.")
    tied: list[TiedInterface] = []
    for name, given in interfaces.items():
        check_interface_name(name)
        interface = given if isinstance(given, Interface) else Interface(given)
        tied.append(tie_one(part, name, interface, default_tie))
    owner: dict[int, str] = {}
    for resolved in tied:
        for node in resolved.node_ids.tolist():
            if node in owner:
                raise InterfaceError(
                    f"Node {node} belongs to the interfaces {owner[node]!r} and {resolved.name!r}; a node can follow "
                    "one frame only. Take it out of one of them."
                )
            owner[node] = resolved.name
    return tuple(tied)


def check_interface_name(name: object) -> None:
    """Raise InterfaceError unless the name can stand before ".x" in a coordinate's name."""
    if not isinstance(name, str) or not name or name != name.strip() or "." in name:
        raise InterfaceError(
            f"{name!r} cannot name an interface: it must be a word without dots, for coordinates like 'tip.x'."
        )


def tie_one(part: FEModel, name: str, interface: Interface, default_tie: str) -> TiedInterface:
    """Resolve one interface on a model. Raises InterfaceError in words, UnknownNameError for sets and ties."""
    tie = check_tie(default_tie if interface.tie is None else interface.tie)
    node_ids = node_labels(part, f"Interface {name!r}", interface.nodes)
    weights = _weights(part, name, interface.weights, tie, node_ids)
    node_ids, weights = node_ids[weights > 0.0], weights[weights > 0.0]
    at = positions_of(part, node_ids)
    position = (
        at.mean(axis=0) if interface.position is None else checked_position(f"Interface {name!r}", interface.position)
    )
    if interface.position is None and tie == "average":
        position = weights @ at / weights.sum()
    radius = float(np.max(np.linalg.norm(at - position, axis=1)))
    rows = _rows(part, name, node_ids, rotations=tie == "rigid")
    motion = rigid_motion_of_dofs(part.positions[part.dof_nodes()[rows]], part.dofs[rows, 1], position)
    _refuse_loose(name, tie, node_ids, part.positions[part.dof_nodes()[rows]], part.dofs[rows, 1])
    if tie == "rigid":
        matrix = motion
    else:
        # The frame moves as the rigid motion nearest to that of the nodes (weighted least squares). Its
        # distance from them only shifts the reference, as the nodes' own rigid motions are about the frame.
        weight = weights[np.searchsorted(node_ids, part.dofs[rows, 0])]
        matrix = np.linalg.solve(motion.T @ (weight[:, None] * motion), motion.T * weight)
    return TiedInterface(name, tie, position, node_ids, radius, rows, matrix)


def positions_of(part: FEModel, node_ids: IntArray) -> FloatArray:
    """Return the positions (n, 3) [m] of nodes by their ascending labels, all known."""
    found = np.flatnonzero(np.isin(part.node_ids, node_ids))
    return np.asarray(part.positions[found[np.argsort(part.node_ids[found])]])


def node_labels(part: FEModel, what: str, nodes: Nodes) -> IntArray:
    """Return the ascending labels of nodes given in any form; what: "Interface 'tip'" in errors.

    Raises InterfaceError, UnknownNameError.
    """
    if isinstance(nodes, Selection):
        try:
            return nodes.nodes(part)
        except InterfaceError as error:
            raise InterfaceError(f"{what}: {error}") from None
    if isinstance(nodes, str):
        labels = part.node_sets[nodes]
        if len(labels) == 0:
            raise InterfaceError(f"{what}: the node set {nodes!r} is empty.")
        return labels
    try:
        given = np.atleast_1d(np.asarray(nodes))
    except ValueError as error:
        raise InterfaceError(f"{what}: nodes must be a set's name or node labels; {error}.") from None
    if given.ndim != 1 or given.size == 0 or not np.issubdtype(given.dtype, np.integer):
        raise InterfaceError(
            f"{what}: nodes must be a set's name, whole-number labels, a region as fi.Plane(...) or a "
            f"fi.Interface; got {nodes!r}."
        )
    unique, counts = np.unique(given.astype(np.int64), return_counts=True)
    if len(unique) < len(given):
        raise InterfaceError(f"{what} names node {unique[counts > 1][0]} more than once.")
    unknown = unique[~np.isin(unique, part.node_ids)]
    if len(unknown):
        raise InterfaceError(f"{what} names node {unknown[0]}, which {part.source} does not have.")
    return unique


def checked_position(what: str, position: ArrayLike) -> FloatArray:
    """Return a position (3,) [m]; InterfaceError unless it is one."""
    try:
        point = np.asarray(position, dtype=np.float64)
    except (TypeError, ValueError):
        point = np.empty(0)
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise InterfaceError(f"{what}: position must be three finite numbers [m]; got {position!r}.")
    return point


def _weights(part: FEModel, name: str, weights: ArrayLike | str | None, tie: str, node_ids: IntArray) -> FloatArray:
    if weights is None:
        return np.ones(len(node_ids))
    if tie == "rigid":
        raise InterfaceError(f"Interface {name!r}: weights belong to tie='average'; a rigid tie has none.")
    if isinstance(weights, str):
        if weights != "area":
            raise UnknownNameError(
                f"Interface {name!r}: unknown weights {weights!r}.{nearest_known(weights, ['area'])}"
            )
        return _area_weights(part, name, node_ids)
    try:
        values = np.asarray(weights, dtype=np.float64)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape != node_ids.shape or not np.all(np.isfinite(values)) or np.any(values <= 0.0):
        raise InterfaceError(f"Interface {name!r}: weights must be {len(node_ids)} positive numbers; got {weights!r}.")
    return values


def _area_weights(part: FEModel, name: str, node_ids: IntArray) -> FloatArray:
    """Return a third of the area of each face between the nodes to each of its corners, (n,) [m²].

    With these weights the mean of the nodes is the mean over the area, for any field linear on the faces.
    """
    if part.skin is None:
        raise InterfaceError(
            f"Interface {name!r}: weights='area' needs the faces of the mesh, which {part.source} does not tell. "
            "Export the elements too, give skin= to from_arrays, or leave weights away."
        )
    faces = part.skin[np.isin(part.skin, node_ids).all(axis=1)]
    if len(faces) == 0:
        raise InterfaceError(
            f"Interface {name!r}: no face of the mesh has all its corners among the {len(node_ids)} nodes, so they "
            "have no area. Take the nodes of a surface, or leave weights away."
        )
    corners = np.searchsorted(node_ids, faces)
    a, b, c = (positions_of(part, node_ids)[corners[:, corner]] for corner in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    shares = np.bincount(corners.ravel(), np.repeat(area / 3.0, 3), minlength=len(node_ids))
    return np.asarray(shares, dtype=np.float64)


def _rows(part: FEModel, name: str, node_ids: IntArray, rotations: bool) -> IntArray:
    """Return the rows of the nodes' DoF, after checking that no node has lost some of its own."""
    mine = np.flatnonzero(np.isin(part.dofs[:, 0], node_ids))
    own = part.dofs[mine]
    index = np.searchsorted(node_ids, own[:, 0])
    translations = np.bincount(index[own[:, 1] <= 3], minlength=len(node_ids))
    turns = np.bincount(index[own[:, 1] > 3], minlength=len(node_ids))
    lacking = np.flatnonzero((translations < 3) | ((turns > 0) & (turns < 3)))
    if len(lacking):
        node = node_ids[lacking[0]]
        present = sorted(own[own[:, 0] == node, 1].tolist())
        raise InterfaceError(
            f"Interface {name!r}: node {node} has only the DoF {present} left in {part.source} ({len(lacking)} such "
            "nodes): constrained away (*BOUNDARY, *EQUATION, a tie) or never in an element. Export the part without "
            "that constraint, or leave the node out."
        )
    return mine if rotations else mine[own[:, 1] <= 3]


def tells_rotation(at: FloatArray, directions: IntArray) -> bool:
    """Return whether DoF at positions (n, 3) in directions (n,) 1..6 tell all six motions of a frame."""
    centred = at - at.mean(axis=0)
    size = float(np.max(np.linalg.norm(centred, axis=1))) or 1.0
    motion = rigid_motion_of_dofs(centred / size, directions, np.zeros(3))
    return len(motion) >= 6 and bool(np.linalg.svd(motion, compute_uv=False)[-1] > _RANK_TOLERANCE)


def _refuse_loose(name: str, tie: str, node_ids: IntArray, at: FloatArray, directions: IntArray) -> None:
    """Refuse nodes that do not fix all six motions of the frame."""
    if tells_rotation(at, directions):
        return
    count = len(node_ids)
    shape = "a single node" if count == 1 else "two nodes" if count == 2 else f"{count} nodes on one line"
    carries = " without rotations" if tie == "rigid" else ""
    raise InterfaceError(
        f"Interface {name!r} is {shape}{carries}, which leaves the frame free to turn. tie={tie!r} needs at least "
        "three nodes that are not on one line."
    )
