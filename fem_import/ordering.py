"""The order of elimination: nested dissection of the graph of nodes.

A finite-element matrix couples nodes, not single degrees of freedom. The graph of the nodes has a third of
the vertices and a ninth of the edges of that of the rows, so METIS takes a fraction of the time on it, and
the rows of a node stay side by side, which makes the dense blocks of the factor larger.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

try:
    import pymetis
except ImportError:  # no wheel on this platform: the solver then orders by its own means
    pymetis = None  # type: ignore[assignment]  # a module elsewhere

_LARGE = 200_000  # nodes

IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"


def node_graph(matrix: SparseMatrix, node_of_row: IntArray) -> SparseMatrix:
    """Return which nodes a symmetric matrix couples, as a symmetric boolean pattern (n_nodes, n_nodes).

    Parameters
    ----------
    matrix
        Full, or one triangle of it, (n, n).
    node_of_row
        Number of each row's node (n,), counted from 0 without gaps.
    """
    n, n_nodes = matrix.shape[0], int(node_of_row.max(initial=-1)) + 1
    pattern = sparse.csr_array((np.ones(matrix.nnz, dtype=bool), matrix.indices, matrix.indptr), shape=matrix.shape)
    belongs = sparse.csr_array((np.ones(n, dtype=bool), node_of_row, np.arange(n + 1)), shape=(n, n_nodes))
    one_way = sparse.csr_array(belongs.T) @ (pattern @ belongs)
    return sparse.csr_array(one_way + one_way.T)


def elimination_order(graph: SparseMatrix, node_of_row: IntArray) -> IntArray | None:
    """Return the rows in the order in which to eliminate them, (n,); None where pymetis is not installed.

    Parameters
    ----------
    graph
        Of `node_graph`.
    node_of_row
        As there.

    Notes
    -----
    Nested dissection by METIS (Karypis and Kumar, SIAM J. Sci. Comput. 20(1), 1998) with its fixed seed: the
    same order in every run.
    """
    if pymetis is None:
        return None
    n_nodes = graph.shape[0]
    vertex = np.repeat(np.arange(n_nodes, dtype=np.int32), np.diff(graph.indptr))
    edges = vertex != graph.indices
    starts = np.concatenate([[0], np.cumsum(np.bincount(vertex[edges], minlength=n_nodes))])
    neighbours = graph.indices[edges]
    if len(neighbours) == 0:
        return np.argsort(node_of_row, kind="stable")
    adjacency = pymetis.CSRAdjacency(starts.astype(np.int32), neighbours.astype(np.int32))
    # Four tries at each separator make the factor of a solid block 4 % smaller; in large ones that is worth their time.
    options = pymetis.Options(nseps=4 if n_nodes > _LARGE else 1)
    _, place_of_node = pymetis.nested_dissection(adjacency, options=options)
    return np.argsort(np.asarray(place_of_node)[node_of_row], kind="stable")
