"""FEModel: the matrices, nodes, DoF table and node sets of one finite-element part, checked and in SI."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg, sparse

from fem_import.errors import ExportError, UnknownKeywordError
from fem_import.export_report import MINIMUM_DIGITS, ExportReport
from fem_import.keywords import known_keywords
from fem_import.names import NamedItems
from fem_import.rigid_motion import MassProperties, mass_properties, rigid_motion_at, rigid_motion_of_dofs
from fem_import.sparse_blocks import RowParallel, absolute_product, diagonal_of
from fem_import.threads import n_threads, side_by_side
from fem_import.units import unit_system

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_SYMMETRY_TOLERANCE = 1e-6  # printed triangles may differ in their last digit, physics does not make them
_PENALTY_RATIO = 1e10
_BLOCK = 1 << 16  # entries that stay in the cache
_PENALTY = 1e30  # no stiffness or mass in any unit system; programs write 1e36


@dataclass(frozen=True, eq=False, repr=False)
class FEModel:
    """One part as exported by an FEA program. Make it with a reader or with `from_arrays`, which check it.

    Attributes
    ----------
    K, M, C : (n, n) full symmetric sparse arrays, SI; C is None where nothing damps.
    node_ids : (n_nodes,) labels.
    positions : (n_nodes, 3) global [m].
    dofs : (n, 2) node label and direction 1..6 (x, y, z, rx, ry, rz) of each row of K.
    node_sets : {name: labels}.
    source : where it comes from.
    digits : printed ones, None where the numbers were binary.
    units : of the export; the model itself is SI.
    symmetry_residual : of the exported K, before it was made exact.
    skin : (t, 3) node labels of the triangles that bound the part, for drawing; None where not known.
    """

    K: SparseMatrix
    M: SparseMatrix
    C: SparseMatrix | None
    node_ids: IntArray
    positions: FloatArray
    dofs: IntArray
    node_sets: NamedItems[IntArray]
    source: str
    digits: int | None
    units: str
    symmetry_residual: float
    skin: IntArray | None = None

    @classmethod
    @known_keywords(UnknownKeywordError)
    def from_arrays(
        cls,
        K: Any,
        M: Any,
        positions: ArrayLike,
        dofs: ArrayLike | int,
        node_ids: ArrayLike | None = None,
        node_sets: Mapping[str, ArrayLike] | None = None,
        C: Any = None,
        units: str = "SI",
        *,
        source: str = "arrays",
        digits: int | None = None,
        skin: ArrayLike | None = None,
        copy: bool = True,
        symmetric: bool = False,
    ) -> FEModel:
        """Check arrays of any FEA program and make an FEModel of them.

        Parameters
        ----------
        K, M, C : (n, n) sparse or dense, both triangles.
        positions : (n_nodes, 3).
        dofs : (n, 2) node label and direction 1..6 of each row; or 3 or 6, the DoF of every node in node order.
        node_ids : (n_nodes,) labels; 1..n_nodes if None.
        node_sets : {name: labels}.
        units : "SI", "mm-t-s", "mm-kg-s" or "in-lbf-s", of everything given.
        source : what reports call it.
        digits : how many were printed, if the numbers were read from text.
        skin : (t, 3) node labels of the triangles that bound the part, for drawing.
        copy : False lets the model take over CSR matrices of yours, which it may change: half the memory of a large
            part.
        symmetric : True where each matrix was made of one triangle: spares the comparison with its mirror image.

        Raises
        ------
        ExportError : what is wrong, where, and how to mend it.
        UnknownNameError : an unknown system of units or keyword.
        """
        system = unit_system(units)
        coordinates = _checked_positions(positions)
        labels = _checked_labels(node_ids, len(coordinates))
        table = _checked_dofs(dofs, labels)
        n_dofs = len(table)
        given = {"K": K, "M": M} | ({} if C is None else {"C": C})

        def checked(name: str) -> SparseMatrix:
            return _checked_matrix(name, given[name], n_dofs, copy)

        def compared(name: str) -> tuple[SparseMatrix, float]:
            matrix = matrices[name]
            made, residual = (matrix, 0.0) if symmetric else _symmetric(name, matrix, table)
            _scale(made, system.stiffness_scale(table[:, 1]))
            return made, residual

        matrices = dict(zip(given, side_by_side(checked, given), strict=True))
        diagonals = {name: diagonal_of(matrices[name]) for name in ("K", "M")}
        _refuse_bad_diagonals(matrices["K"], diagonals["K"], diagonals["M"], table)
        for name, diagonal in diagonals.items():
            _refuse_large_couplings(name, matrices[name], diagonal, table)
        made = dict(zip(given, side_by_side(compared, given), strict=True))
        for name, power in (("M", 2), ("C", 1)):
            if name in made and system.time != 1.0:
                made[name][0].data *= system.time**power
        return cls(
            K=made["K"][0],
            M=made["M"][0],
            C=made["C"][0] if "C" in made else None,
            node_ids=_frozen(labels),
            positions=_frozen(coordinates * system.length),
            dofs=_frozen(table),
            node_sets=_checked_sets(node_sets or {}, labels),
            source=source,
            digits=digits,
            units=units,
            symmetry_residual=made["K"][1],
            skin=_checked_skin(skin, labels),
        )

    def __repr__(self) -> str:
        """Return one line: source, nodes, DoF, sets."""
        sets = ", ".join(self.node_sets) or "none"
        return f"FEModel({self.source}: {len(self.node_ids)} nodes, {len(self.dofs)} DoF, node sets {sets})"

    def dof_nodes(self) -> IntArray:
        """Return the index into node_ids and positions of each row of K, (n,)."""
        return self._dof_nodes

    @functools.cached_property
    def _dof_nodes(self) -> IntArray:
        nodes: IntArray = _frozen(_indices_of(self.node_ids, self.dofs[:, 0]))
        return nodes

    def rigid_body_motion(self, origin: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
        """Return R (n, 6): all DoF per unit translation and small rotation about `origin`."""
        return rigid_motion_of_dofs(self.positions[self.dof_nodes()], self.dofs[:, 1], origin)

    def mass_properties(self) -> MassProperties:
        """Return mass, centre of gravity and inertia of what the DoF carry."""
        origin, _, rigid_mass = self._rigid_mass()
        return mass_properties(rigid_mass, origin)

    def _rigid_mass(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a point amid the nodes, the rigid motions R (n, 6) about it, and R^T M R."""
        origin = self.positions[self.dof_nodes()].mean(axis=0)
        motion = self.rigid_body_motion(origin)
        return origin, motion, motion.T @ (RowParallel(self.M) @ motion)

    def report(self) -> ExportReport:
        """Prove the import: mass, CoG, inertia, rigid-body residual, symmetry, digits, findings in words."""
        origin, motion, rigid_mass = self._rigid_mass()
        properties = mass_properties(rigid_mass, origin)
        to_centre = rigid_motion_at(origin, properties.centre_of_mass)
        arm = np.sqrt(np.mean(np.sum((self.positions - properties.centre_of_mass) ** 2, axis=1))) or 1.0
        to_centre /= np.array([1.0, 1.0, 1.0, arm, arm, arm])
        motion, rigid_mass = motion @ to_centre, to_centre.T @ rigid_mass @ to_centre
        forces = RowParallel(self.K) @ motion
        # Row by row against what cancels in it: a soft leaf beside a stiff block is judged by its own
        # stiffness.
        row_sums = absolute_product(self.K, np.max(abs(motion), axis=1))
        residual = np.max(abs(forces) / row_sums[:, None], axis=0)
        support = self._support(residual)
        return ExportReport(
            source=self.source,
            units=self.units,
            n_nodes=len(self.node_ids),
            n_dofs=len(self.dofs),
            mass_per_axis=properties.mass_per_axis,
            centre_of_mass=properties.centre_of_mass,
            inertia=properties.inertia,
            rigid_body_residual=residual,
            rigid_body_frequencies=_rayleigh_frequencies(motion.T @ forces, rigid_mass),
            symmetry_residual=self.symmetry_residual,
            digits=self.digits,
            support=support,
            node_sets=tuple(self.node_sets),
            findings=tuple(self._findings(properties, residual, support)),
        )

    def _support(self, residual: FloatArray) -> str:
        # Rotations also feel the printed digits of the coordinates, so they get more room.
        printed = 0.0 if self.digits is None else 10.0 ** (2 - self.digits)
        if np.all(residual[:3] < max(1e-9, printed)) and np.all(residual[3:] < max(1e-6, printed)):
            return "free"
        return "held" if residual.max() > 1e-3 else "unclear"

    def _findings(self, properties: MassProperties, residual: FloatArray, support: str) -> list[str]:
        findings = []
        if support == "held":
            findings.append(
                "The part is held to ground in the export (constrained DoF are absent), so it cannot move as a rigid "
                "body; mass, CoG and inertia count only the DoF that are present."
            )
        elif support == "unclear":
            findings.append(
                f"Rigid-body motions leave {residual.max():.1e} of the row's stiffness: neither free (under 1e-9) "
                "nor clearly held. Soft springs to ground, or too few printed digits? It is treated as held."
            )
        spread = float(np.ptp(properties.mass_per_axis))
        if properties.mass <= 0.0:
            findings.append("The mass matrix carries no mass in translation. Is the density missing?")
        elif spread > 1e-6 * properties.mass and support == "free":
            findings.append(
                f"The mass differs by axis: {properties.mass_per_axis[0]:.6g}, {properties.mass_per_axis[1]:.6g}, "
                f"{properties.mass_per_axis[2]:.6g} kg. DoF without mass, or an inertia that acts one way?"
            )
        if self.digits is not None and self.digits < MINIMUM_DIGITS:
            findings.append(
                f"Printed with {self.digits} digits; at least {MINIMUM_DIGITS} keep the rigid-body modes of a "
                "flexure at zero. Export with more digits or in binary."
            )
        if self.symmetry_residual > 1e-9:
            findings.append(f"K was unsymmetric by {self.symmetry_residual:.1e} and was averaged with its transpose.")
        massless = int(np.count_nonzero(self.M.diagonal() == 0.0))
        if massless:
            findings.append(f"{massless} of {len(self.dofs)} DoF have no mass.")
        return findings


def _rayleigh_frequencies(stiffness: FloatArray, mass: FloatArray) -> FloatArray:
    """Return the six frequencies [Hz] of rigid motions alone; nan where the mass cannot tell."""
    if np.any(np.diag(mass) <= 0.0):
        return np.full(6, np.nan)
    weights = 1.0 / np.sqrt(np.outer(np.diag(mass), np.diag(mass)))
    try:
        values = linalg.eigh(stiffness * weights, mass * weights, eigvals_only=True)
    except linalg.LinAlgError:
        return np.full(6, np.nan)
    return np.asarray(np.sqrt(abs(values)) / (2.0 * np.pi))


def _frozen(array: Any) -> Any:
    array = np.array(array)
    array.setflags(write=False)
    return array


def _indices_of(labels: IntArray, wanted: IntArray) -> IntArray:
    """Return where each wanted label (all known) stands in `labels`."""
    order = np.argsort(labels, kind="stable")
    return np.asarray(order[np.searchsorted(labels[order], wanted)], dtype=np.int64)


def _as_integers(what: str, values: ArrayLike) -> IntArray:
    try:
        array = np.asarray(values)
        if array.dtype.kind == "i":
            return array.astype(np.int64)
        as_float = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ExportError(f"{what} must be whole numbers; {error}.") from None
    if array.size and (not np.all(np.isfinite(as_float)) or np.any(as_float != np.floor(as_float))):
        bad = array[(~np.isfinite(as_float)) | (as_float != np.floor(as_float))].ravel()[0]
        raise ExportError(f"{what} must be whole numbers; found {bad!s}.")
    return array.astype(np.int64)


def _checked_positions(positions: ArrayLike) -> FloatArray:
    try:
        coordinates = np.asarray(positions, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ExportError(f"positions must be an (n_nodes, 3) array of numbers; {error}.") from None
    if coordinates.ndim != 2 or coordinates.shape[1] != 3 or len(coordinates) == 0:
        raise ExportError(f"positions must be (n_nodes, 3), one row a node; got shape {coordinates.shape}.")
    if not np.all(np.isfinite(coordinates)):
        row = int(np.flatnonzero(~np.isfinite(coordinates).all(axis=1))[0])
        raise ExportError(f"The position of node row {row} is not finite: {coordinates[row]}.")
    return coordinates


def _checked_labels(node_ids: ArrayLike | None, n_nodes: int) -> IntArray:
    if node_ids is None:
        return np.arange(1, n_nodes + 1, dtype=np.int64)
    labels = _as_integers("node_ids", node_ids)
    if labels.shape != (n_nodes,):
        raise ExportError(f"node_ids must hold one label for each of the {n_nodes} positions; shape {labels.shape}.")
    unique, counts = np.unique(labels, return_counts=True)
    if len(unique) < n_nodes:
        raise ExportError(f"Node label {unique[counts > 1][0]} occurs {counts.max()} times; labels must be unique.")
    return labels


def _checked_dofs(dofs: ArrayLike | int, labels: IntArray) -> IntArray:
    if isinstance(dofs, (int, np.integer)):
        if dofs not in (3, 6):
            raise ExportError(f"dofs={dofs}: a number of DoF a node must be 3 or 6; else give the (n, 2) table.")
        directions = np.arange(1, int(dofs) + 1, dtype=np.int64)
        return np.column_stack([np.repeat(labels, int(dofs)), np.tile(directions, len(labels))])
    table = _as_integers("dofs", dofs)
    if table.ndim != 2 or table.shape[1] != 2 or len(table) == 0:
        raise ExportError(f"dofs must be (n, 2): node label, direction 1..6 of each row; got shape {table.shape}.")
    wrong = (table[:, 1] < 1) | (table[:, 1] > 6)
    if np.any(wrong):
        row = int(np.flatnonzero(wrong)[0])
        raise ExportError(
            f"dofs row {row}: direction {table[row, 1]} of node {table[row, 0]}; directions are 1..6 (x y z rx ry rz)."
        )
    unknown = ~np.isin(table[:, 0], labels)
    if np.any(unknown):
        row = int(np.flatnonzero(unknown)[0])
        raise ExportError(f"dofs row {row} names node {table[row, 0]}, which has no position. Give all nodes.")
    keys = np.sort(8 * _indices_of(labels, table[:, 0]) + table[:, 1])
    for key in keys[:-1][np.diff(keys) == 0][:1]:
        raise ExportError(
            f"DoF {labels[key >> 3]}.{key & 7} (node.direction) occurs {np.count_nonzero(keys == key)} times; each row "
            "must be another DoF."
        )
    return table


def _checked_sets(node_sets: Mapping[str, ArrayLike], labels: IntArray) -> NamedItems[IntArray]:
    if not isinstance(node_sets, Mapping):
        raise ExportError(f"node_sets must be a mapping {{name: labels}}; got {type(node_sets).__name__}.")
    sets: dict[str, IntArray] = {}
    for name, members in node_sets.items():
        nodes = np.unique(_as_integers(f"Node set {name!r}", members))
        unknown = nodes[~np.isin(nodes, labels)]
        if len(unknown):
            raise ExportError(f"Node set {name!r} names node {unknown[0]}, which does not exist ({len(unknown)} such).")
        sets[str(name)] = _frozen(nodes)
    return NamedItems("node set", sets)


def _checked_skin(skin: ArrayLike | None, labels: IntArray) -> IntArray | None:
    if skin is None:
        return None
    triangles = _as_integers("skin", skin)
    if triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ExportError(f"skin must be (t, 3): three node labels a triangle; got shape {triangles.shape}.")
    unknown = triangles[~np.isin(triangles, labels)]
    if unknown.size:
        raise ExportError(f"skin names node {unknown[0]}, which has no position.")
    frozen: IntArray = _frozen(triangles)
    return frozen


def _checked_matrix(name: str, matrix: Any, n_dofs: int, copy: bool) -> SparseMatrix:
    if matrix is None:
        raise ExportError(f"{name} is missing.")
    if np.iscomplexobj(matrix):
        raise ExportError(f"{name} is complex; give the real matrix, and structural damping as zeta in the model.")
    try:
        with np.errstate(all="ignore"):
            # A copy: what follows works in place and must not touch the caller's matrix.
            is_ready = not copy and isinstance(matrix, sparse.csr_array) and matrix.dtype == np.float64
            checked = matrix if is_ready else sparse.csr_array(matrix, dtype=np.float64, copy=copy)
            checked.check_format(full_check=True)
    except (TypeError, ValueError) as error:
        raise ExportError(f"{name} must be a real (n, n) matrix, sparse or dense; {error}.") from None
    if checked.shape != (n_dofs, n_dofs):
        raise ExportError(f"{name} is {checked.shape}, but the DoF table has {n_dofs} rows; both must agree.")
    if checked.indices.dtype != np.int32 and checked.nnz <= np.iinfo(np.int32).max:
        # Half the memory of indices that assembly in int64 leaves, and products a third faster.
        pointers, columns = checked.indptr.astype(np.int32), checked.indices.astype(np.int32)
        checked = sparse.csr_array((checked.data, columns, pointers), shape=checked.shape)
    checked.sum_duplicates()
    blocks = list(_row_blocks(checked))
    if not all(np.isfinite(checked.data[entries]).all() for _, entries in blocks):
        entry = int(np.argmin(np.isfinite(checked.data)))
        row = int(np.searchsorted(checked.indptr, entry, side="right") - 1)
        raise ExportError(f"{name}[{row}, {checked.indices[entry]}] is {checked.data[entry]}; it must be finite.")
    if not all(checked.data[entries].all() for _, entries in blocks):
        checked.eliminate_zeros()
    if checked.nnz == 0:
        cure = " Is the density missing, or did the analysis never form it?" if name == "M" else ""
        if name != "C":
            raise ExportError(f"{name} has no non-zero entry.{cure}")
    return checked


def _row_blocks(matrix: SparseMatrix) -> Iterator[tuple[slice, slice]]:
    """Yield rows, and their entries, in blocks that stay in the cache."""
    size = matrix.shape[0]
    n_blocks = max(1, matrix.nnz // _BLOCK)
    bounds = np.unique(np.searchsorted(matrix.indptr, np.linspace(0, matrix.nnz, n_blocks + 1)).clip(0, size))
    for first, last in itertools.pairwise([0, *bounds[1:-1].tolist(), size]):
        yield slice(first, last), slice(int(matrix.indptr[first]), int(matrix.indptr[last]))


def _of_rows(matrix: SparseMatrix, rows: slice, per_row: FloatArray) -> FloatArray:
    """Repeat what belongs to the rows for each of their entries."""
    return np.repeat(per_row[rows], np.diff(matrix.indptr[rows.start : rows.stop + 1]))


def _refuse_large_couplings(name: str, matrix: SparseMatrix, diagonal: FloatArray, dofs: IntArray) -> None:
    """A positive semi-definite matrix has |a_ij| <= sqrt(a_ii a_jj)."""
    root = np.sqrt(diagonal)
    row_root = (1.0 + _SYMMETRY_TOLERANCE) * root
    room = 1e-12 * root.max() ** 2

    def refuse(blocks: list[tuple[slice, slice]]) -> None:
        for rows, entries in blocks:
            columns, values = matrix.indices[entries], matrix.data[entries]
            allowed = _of_rows(matrix, rows, row_root)
            allowed *= root.take(columns, mode="clip")  # all are inside, and this is twice as fast
            excess = abs(values)
            excess -= allowed
            if excess.max(initial=0.0) > room:
                worst = int(np.argmax(excess))
                row = int(np.searchsorted(matrix.indptr, entries.start + worst, side="right")) - 1
                raise ExportError(
                    f"{name}[{row}, {columns[worst]}] is {values[worst]:.4g}, more than the diagonals of "
                    f"{_dof(dofs, row)} and {_dof(dofs, int(columns[worst]))} allow: {name} is not positive "
                    "semi-definite. Is the file damaged, or a row of another matrix?"
                )

    blocks = list(_row_blocks(matrix))
    share = -(-len(blocks) // n_threads())
    side_by_side(refuse, [blocks[start : start + share] for start in range(0, len(blocks), share)])


def _dof(dofs: IntArray, row: int) -> str:
    return f"row {row} (node {dofs[row, 0]}, direction {dofs[row, 1]})"


def _refuse_bad_diagonals(K: SparseMatrix, stiff: FloatArray, heavy: FloatArray, dofs: IntArray) -> None:
    for name, diagonal in (("K", stiff), ("M", heavy)):
        if np.any(diagonal < 0.0):
            row = int(np.argmin(diagonal))
            raise ExportError(
                f"{name} has {diagonal[row]:.4g} on its diagonal in {_dof(dofs, row)}; it cannot be negative."
            )
    if np.any(heavy > _PENALTY):
        raise ExportError(
            f"M has {heavy.max():.3g} on the diagonal of {_dof(dofs, int(np.argmax(heavy)))}: a penalty, not a mass. "
            "Remove its rows and columns and their DoF."
        )
    null_rows = np.flatnonzero(stiff == 0.0)
    if len(null_rows):
        raise ExportError(
            f"K has nothing on the diagonal of {len(null_rows)} rows, first {_dof(dofs, int(null_rows[0]))}: a DoF "
            "without stiffness, or a constrained one that the export kept. Remove these rows and columns and their DoF."
        )
    for rotational in (False, True):
        rows = np.flatnonzero((dofs[:, 1] > 3) == rotational)
        if len(rows) == 0:
            continue
        typical = float(np.median(stiff[rows]))
        suspects = rows[(stiff[rows] > _PENALTY_RATIO * typical) | (stiff[rows] > _PENALTY)]
        neighbours = np.array([_largest_neighbour(K, int(row)) for row in suspects])
        huge = suspects[(stiff[suspects] > _PENALTY_RATIO * neighbours) | (stiff[suspects] > _PENALTY)]
        if len(huge):
            row = int(huge[0])
            raise ExportError(
                f"K has {stiff[row]:.3g} on the diagonal of {_dof(dofs, row)}, far above all else ({len(huge)} such): "
                "a penalty that stands for a constraint. Remove these rows and columns and their DoF."
            )


def _largest_neighbour(matrix: SparseMatrix, row: int) -> float:
    entries = slice(matrix.indptr[row], matrix.indptr[row + 1])
    return float(abs(matrix.data[entries][matrix.indices[entries] != row]).max(initial=0.0))


def _symmetric(name: str, matrix: SparseMatrix, dofs: IntArray) -> tuple[SparseMatrix, float]:
    """Return the matrix made exactly symmetric and its scaled residual; refuse what is not symmetric."""
    mirror = sparse.csr_array(matrix.T)
    if (
        np.array_equal(matrix.indptr, mirror.indptr)
        and np.array_equal(matrix.indices, mirror.indices)
        and np.array_equal(matrix.data, mirror.data)
    ):
        return matrix, 0.0
    lower, upper = sparse.tril(matrix, -1).nnz, sparse.triu(matrix, 1).nnz
    if (lower == 0) != (upper == 0):
        given = "upper" if lower == 0 else "lower"
        raise ExportError(
            f"{name} holds only its {given} triangle. Give both: {name} + {name}.T - diag({name}.diagonal())."
        )
    difference = sparse.csr_array(matrix - mirror)
    size = np.sqrt(abs(matrix.diagonal()))
    size[size == 0.0] = np.sqrt(abs(matrix).max())
    scaled = sparse.coo_array(difference)
    rows, columns = scaled.row, scaled.col
    relative = abs(scaled.data) / (size[rows] * size[columns])
    worst = int(np.argmax(relative))
    if relative[worst] > _SYMMETRY_TOLERANCE:
        row, column = int(rows[worst]), int(columns[worst])
        raise ExportError(
            f"{name} is not symmetric: [{row}, {column}] and [{column}, {row}] differ by {scaled.data[worst]:.4g} "
            f"(nodes {dofs[row, 0]} and {dofs[column, 0]}), {relative[worst]:.1e} of the diagonal."
        )
    return sparse.csr_array(0.5 * (matrix + mirror)), float(relative[worst])


def _scale(matrix: SparseMatrix, scale: FloatArray) -> None:
    """Multiply rows and columns in place."""
    if np.all(scale == 1.0):
        return
    for rows, entries in _row_blocks(matrix):
        matrix.data[entries] *= _of_rows(matrix, rows, scale) * scale[matrix.indices[entries]]
