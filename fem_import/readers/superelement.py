"""A superelement that an FEA program has reduced already becomes a ReducedBody."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_import.errors import ExportError, InterfaceError, nearest_known, warn_user
from fem_import.reduced_body import ReducedBody
from fem_import.units import required_units

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]

MODAL = 0
"""Direction of a row that is a modal coordinate."""


def superelement_body(
    K: FloatArray,
    M: FloatArray,
    C: FloatArray | None,
    dofs: IntArray,
    interfaces: Mapping[str, int],
    positions: Mapping[int, ArrayLike],
    units: str | None,
    source: str,
) -> ReducedBody:
    """Order the rows by interface, put the modal ones last, convert to SI.

    dofs: (n, 2) node label and direction 1..6, or MODAL, of each row; interfaces: {name: node label};
    positions: {node label: (3,)}, as written. Raises ExportError, InterfaceError.
    """
    system = required_units(units, source)
    if not interfaces:
        raise InterfaceError(f"{source}: name its interfaces: interfaces={{'base': node label, ...}}.")
    place = {(int(node), int(direction)): row for row, (node, direction) in enumerate(dofs) if direction != MODAL}
    order: list[int] = []
    frames: dict[str, FloatArray] = {}
    nodes = sorted({node for node, _ in place})
    for name, label in interfaces.items():
        missing = [direction for direction in range(1, 7) if (label, direction) not in place]
        if missing:
            raise InterfaceError(
                f"{source}: interface {name!r} is node {label!r}, of which DoF {missing} are not retained"
                + (f".{nearest_known(label, map(str, nodes))}" if len(missing) == 6 else "")
                + " An interface needs all six: tie its nodes to one reference node and retain 1 to 6 of that."
            )
        order += [place[label, direction] for direction in range(1, 7)]
        if label not in positions:
            raise ExportError(f"{source}: node {label} of interface {name!r} has no position. Give it by positions=.")
        frames[name] = np.asarray(positions[label], dtype=np.float64) * system.length
    if len(set(order)) < len(order):
        raise InterfaceError(f"{source}: two interfaces are the same node ({list(interfaces.values())}).")
    modal = np.flatnonzero(dofs[:, 1] == MODAL)
    left_out = sorted(set(range(len(dofs))) - set(order) - set(modal.tolist()))
    if left_out:
        raise InterfaceError(
            f"{source}: node {dofs[left_out[0], 0]} is retained and is no interface here. Name all retained nodes: "
            f"{', '.join(map(str, nodes))}."
        )
    rows = np.array(order + modal.tolist(), dtype=np.int64)
    # A modal coordinate may be scaled at will, as long as all matrices are scaled alike.
    directions = np.where(dofs[rows, 1] == MODAL, 6, dofs[rows, 1])
    scale = system.stiffness_scale(directions)
    weights = np.outer(scale, scale)

    def ordered(matrix: Any, factor: float) -> FloatArray:
        return np.asarray(matrix[np.ix_(rows, rows)] * weights * factor)

    body = ReducedBody.from_arrays(
        M=ordered(M, system.time**2),
        K=ordered(K, 1.0),
        C=None if C is None else ordered(C, system.time),
        interfaces=frames,
        source=source,
    )
    if not body.is_free:
        warn_user(
            f"{source} does not move freely: rigid motion of its interfaces strains it. It is held to ground in the "
            "export, its positions are not those of its nodes, its rows are in another order (they are known where "
            "bulk= of a Nastran file has EXTRN), or too few digits are printed."
        )
    return body
