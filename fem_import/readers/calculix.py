"""CalculiX: matrices of `*FREQUENCY, SOLVER=MATRIXSTORAGE` with nodes and sets of the input deck."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ExportError, MissingFileError
from fem_import.fe_model import FEModel
from fem_import.readers.assembly import warn_of_few_digits
from fem_import.readers.calculix_deck import Deck, read_deck
from fem_import.readers.packed_file import read_bytes
from fem_import.readers.triplets import Triplets, parse_triplets
from fem_import.units import unit_system

JOB_SUFFIXES = (".inp", ".sti", ".mas", ".dof")
_HOW_TO_EXPORT = "Run ccx on a free or held part with *STEP / *FREQUENCY, SOLVER=MATRIXSTORAGE / 10 / *END STEP."


def read_calculix(path: str | os.PathLike[str], units: str = "SI") -> FEModel:
    """Read a CalculiX job exported with `*FREQUENCY, SOLVER=MATRIXSTORAGE`.

    path: job.inp (or job.sti, or the stem); job.sti, job.mas and job.dof are taken from beside it, each
    gzipped (.gz) or not; *INCLUDE is followed. units: of the deck, "SI", "mm-t-s", "mm-kg-s", "in-lbf-s".
    The rotations of a *RIGID BODY (DoF 1..3 of its ROT NODE) become directions 4..6 of its REF NODE.
    Raises ExportError, MissingFileError, UnknownNameError; warns below 12 printed digits.
    """
    unit_system(units)
    stem = job_stem(Path(path))
    deck_path = _job_file(stem, ".inp", "It holds the node positions and sets.")
    dof_path = _job_file(stem, ".dof", _HOW_TO_EXPORT)
    stiffness_path = _job_file(stem, ".sti", _HOW_TO_EXPORT)
    mass_path = _job_file(stem, ".mas", f"The analysis never formed the mass matrix. {_HOW_TO_EXPORT}")

    deck = read_deck(deck_path)
    dofs, rotation_nodes = _rotations_to_reference(_read_dofs(dof_path, deck), deck, dof_path.name)
    stiffness = _read_triangle(stiffness_path, len(dofs), dof_path.name)
    mass = _read_triangle(mass_path, len(dofs), dof_path.name)
    if not (np.array_equal(stiffness.rows, mass.rows) and np.array_equal(stiffness.columns, mass.columns)):
        raise ExportError(
            f"{stiffness_path.name} has {len(stiffness.rows)} entries and {mass_path.name} "
            f"{len(mass.rows)}, or at other "
            "places; ccx writes both with one pattern. They are of different runs or damaged: export again."
        )
    digits = min(stiffness.digits, mass.digits)
    # The ROT NODE of a rigid body is no point of the part.
    is_point = ~np.isin(deck.node_ids, rotation_nodes)
    part = FEModel.from_arrays(
        K=_full(stiffness, len(dofs)),
        M=_full(mass, len(dofs)),
        positions=deck.positions[is_point],
        dofs=dofs,
        node_ids=deck.node_ids[is_point],
        node_sets={name: nodes[~np.isin(nodes, rotation_nodes)] for name, nodes in deck.node_sets.items()},
        units=units,
        source=f"CalculiX {deck_path.name}",
        digits=digits,
        skin=deck.skin,
    )
    warn_of_few_digits(digits, stem.name)
    return part


def job_stem(path: Path) -> Path:
    """Return folder/job of folder/job.inp, .sti, .mas, .dof (gzipped or not) or of the stem itself."""
    bare = path.with_suffix("") if path.suffix == ".gz" else path
    return bare.with_suffix("") if bare.suffix.lower() in JOB_SUFFIXES else bare


def _job_file(stem: Path, suffix: str, cure: str) -> Path:
    for ending in (suffix, suffix + ".gz"):
        candidate = stem.with_name(stem.name + ending)
        if candidate.is_file():
            return candidate
    raise MissingFileError(f"{stem.name}{suffix} (or .gz) is not in {stem.parent.resolve()}. {cure}")


def _read_dofs(path: Path, deck: Deck) -> NDArray[np.int64]:
    """Read "node.direction" lines as text: 12.10 and 12.1 would be one float."""
    lines = read_bytes(path).split()
    pairs = [line.split(b".") for line in lines]
    for number, (line, pair) in enumerate(zip(lines, pairs, strict=True), start=1):
        if len(pair) != 2 or not pair[0].isdigit() or len(pair[0]) > 15 or pair[1] not in (b"1", b"2", b"3"):
            shown = line[:40].decode("latin-1")
            raise ExportError(f"{path.name}, line {number}: expected 'node.direction' (1..3), found {shown!r}.")
    if not pairs:
        raise ExportError(f"{path.name} is empty: the export broke off. {_HOW_TO_EXPORT}")
    dofs = np.array([(int(node), int(direction)) for node, direction in pairs], dtype=np.int64)
    unique, counts = np.unique(dofs, axis=0, return_counts=True)
    if len(unique) < len(dofs):
        node, direction = unique[counts > 1][0]
        kinds = f" ({', '.join(deck.expanded_elements)})" if deck.expanded_elements else ""
        raise ExportError(
            f"{path.name}: DoF {node}.{direction} occurs {counts.max()} times. ccx expands shells, beams "
            "and plane "
            f"elements{kinds} to solids and repeats their labels; such parts cannot be read. Mesh them with "
            "solids."
        )
    return dofs


def _rotations_to_reference(
    dofs: NDArray[np.int64], deck: Deck, name: str
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Make DoF 1..3 of ROT NODEs directions 4..6 of their REF NODEs; also return the ROT NODEs' labels."""
    unplaced = np.setdiff1d(dofs[:, 0], deck.node_ids)
    unnamed = [body for body in deck.rigid_bodies if body.rotation_node is None]
    # Without ROT NODE= ccx numbers new nodes upwards, one a rigid body in the order of the deck.
    if len(unplaced) != len(unnamed):
        unnamed = []
    added = dict(zip((body.reference_node for body in unnamed), unplaced.tolist(), strict=bool(unnamed)))
    result = dofs.copy()
    rotation_nodes = []
    for body in deck.rigid_bodies:
        rotation_node = body.rotation_node or added.get(body.reference_node)
        if rotation_node is None:
            continue
        rows = dofs[:, 0] == rotation_node
        result[rows, 0] = body.reference_node
        result[rows, 1] += 3
        rotation_nodes.append(rotation_node)
    labels = np.array(rotation_nodes, dtype=np.int64)
    missing = np.setdiff1d(result[:, 0], deck.node_ids)
    if len(missing):
        kinds = f" Elements {', '.join(deck.expanded_elements)} are expanded by ccx." if deck.expanded_elements else ""
        raise ExportError(
            f"{name} names node {missing[0]}, which the deck does not define ({len(missing)} such). Nodes "
            "that ccx makes "
            f"itself (expanded shells and beams) have no position; mesh with solids.{kinds}"
        )
    return result, labels


def _read_triangle(path: Path, n_dofs: int, dof_name: str) -> Triplets:
    triplets = parse_triplets(read_bytes(path), path.name)
    rows, columns = triplets.rows, triplets.columns
    outside = (np.minimum(rows, columns) < 0) | (np.maximum(rows, columns) >= n_dofs)
    if np.any(outside):
        entry = int(np.flatnonzero(outside)[0])
        raise ExportError(
            f"{path.name} has an entry at row {rows[entry] + 1}, column {columns[entry] + 1}, but "
            f"{dof_name} has "
            f"{n_dofs} DoF. The files are of different runs or damaged: export again."
        )
    if np.any(rows > columns):
        raise ExportError(f"{path.name} has entries below the diagonal; ccx writes the upper triangle only.")
    on_diagonal = np.bincount(rows[rows == columns], minlength=n_dofs)
    if np.any(on_diagonal == 0):
        row = int(np.flatnonzero(on_diagonal == 0)[0])
        raise ExportError(
            f"{path.name} has no diagonal entry in row {row + 1} of {n_dofs} "
            f"({int(np.sum(on_diagonal == 0))} such): "
            "truncated, or of another run than the .dof. Export again."
        )
    keys = rows * n_dofs + columns
    if np.any(np.diff(keys) <= 0):
        keys = np.sort(keys)
    repeated = np.flatnonzero(np.diff(keys) == 0)
    if len(repeated):
        row, column = divmod(int(keys[repeated[0]]), n_dofs)
        raise ExportError(f"{path.name} gives the entry at row {row + 1}, column {column + 1} twice. Export it again.")
    return triplets


def _full(upper: Triplets, n_dofs: int) -> sparse.coo_array:
    """Return both triangles; two thirds of M are printed zeros and are dropped."""
    kept = upper.values != 0.0
    rows, columns, values = upper.rows[kept], upper.columns[kept], upper.values[kept]
    mirrored = rows != columns
    return sparse.coo_array(
        (
            np.concatenate([values, values[mirrored]]),
            (np.concatenate([rows, columns[mirrored]]), np.concatenate([columns, rows[mirrored]])),
        ),
        shape=(n_dofs, n_dofs),
    )
