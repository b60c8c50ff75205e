"""CalculiX: matrices of `*FREQUENCY, SOLVER=MATRIXSTORAGE` with nodes and sets of the input deck."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError, MissingFileError
from fem_import.fe_model import FEModel
from fem_import.readers.assembly import warn_of_few_digits
from fem_import.readers.calculix_deck import Deck, read_deck
from fem_import.readers.long_text import LongText, read_in_turn, texts_of
from fem_import.readers.packed_file import read_bytes
from fem_import.readers.regular_text import IntArray
from fem_import.readers.triangles import SparseMatrix, mirrored, refuse_outside
from fem_import.readers.triplets import Triplets, parse_triplets
from fem_import.units import unit_system

JOB_SUFFIXES = (".inp", ".sti", ".mas", ".dof")
_LABEL_DIGITS = 15
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

    matrix_paths = (stiffness_path, mass_path)
    texts = texts_of(*matrix_paths)
    deck = read_deck(deck_path)
    dofs, rotation_nodes = _rotations_to_reference(_read_dofs(dof_path, deck), deck, dof_path.name)
    pattern: list[IntArray] = []  # rows and columns of the stiffness, until those of the mass are compared with them
    digits: list[int] = []

    def parsed(given: tuple[Path, LongText]) -> tuple[Path, Triplets]:
        path, text = given
        triangle = parse_triplets(text, path.name, len(pattern[0]) if pattern else None)
        digits.append(triangle.digits)
        if path == stiffness_path:
            pattern[:] = triangle.rows, triangle.columns
        return path, triangle

    def assembled(given: tuple[Path, Triplets]) -> SparseMatrix:
        path, triangle = given
        rows, columns, values = triangle.rows, triangle.columns, triangle.values
        if path == mass_path:
            if not (np.array_equal(rows, pattern[0]) and np.array_equal(columns, pattern[1])):
                raise ExportError(
                    f"{stiffness_path.name} has {len(pattern[0])} entries and {path.name} {len(rows)}, or at other "
                    "places; ccx writes both with one pattern. They are of different runs or damaged: export again."
                )
            pattern.clear()  # as large as what is made now
        else:
            _refuse_no_triangle(triangle, path.name, len(dofs), dof_path.name)
            if not values.all():  # then the zeros are taken out of these arrays
                rows, columns = rows.copy(), columns.copy()
        return mirrored(rows, columns, values, len(dofs), path.name)

    K, M = read_in_turn(matrix_paths, texts, parsed, assembled)
    # The ROT NODE of a rigid body is no point of the part.
    is_point = np.isin(deck.node_ids, rotation_nodes, invert=True)
    node_sets = deck.node_sets
    if len(rotation_nodes):
        node_sets = {name: nodes[np.isin(nodes, rotation_nodes, invert=True)] for name, nodes in node_sets.items()}
    part = FEModel.from_arrays(
        K=K,
        M=M,
        positions=deck.positions[is_point],
        dofs=dofs,
        node_ids=deck.node_ids[is_point],
        node_sets=node_sets,
        units=units,
        source=f"CalculiX {deck_path.name}",
        digits=min(digits),
        skin=deck.skin,
        copy=False,
        symmetric=True,
    )
    warn_of_few_digits(min(digits), stem.name)
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
    content = read_bytes(path)
    if not content.strip():
        raise ExportError(f"{path.name} is empty: the export broke off. {_HOW_TO_EXPORT}")
    dofs = _regular_dofs(content)
    if dofs is None:
        dofs = _dofs_line_by_line(content, path.name)
    keys = np.sort(8 * dofs[:, 0] + dofs[:, 1])
    for repeated in np.flatnonzero(np.diff(keys) == 0)[:1]:
        node, direction = divmod(int(keys[repeated]), 8)
        kinds = f" ({', '.join(deck.expanded_elements)})" if deck.expanded_elements else ""
        raise ExportError(
            f"{path.name}: DoF {node}.{direction} occurs {np.count_nonzero(keys == keys[repeated])} times. ccx expands "
            f"shells, beams and plane elements{kinds} to solids and repeats their labels; such parts cannot be read. "
            "Mesh them with solids."
        )
    return dofs


def _regular_dofs(content: bytes) -> NDArray[np.int64] | None:
    """Return (n, 2) of lines as ccx writes them; None where one is another."""
    text = np.frombuffer(content, np.uint8)
    dots, ends = np.flatnonzero(text == ord(".")), np.flatnonzero(text == ord("\n"))
    if content.translate(None, b"0123456789.\n") or len(dots) != len(ends) or not content.endswith(b"\n"):
        return None
    starts = np.concatenate([[0], ends[:-1] + 1])
    directions = text[np.minimum(dots + 1, len(text) - 1)].astype(np.int64) - ord("0")
    if np.any(dots <= starts) or np.any(dots - starts > _LABEL_DIGITS) or np.any(dots + 2 != ends):
        return None
    if np.any((directions < 1) | (directions > 3)):
        return None
    labels = text.copy()
    labels[dots] = labels[dots + 1] = ord(" ")
    return np.column_stack([np.fromstring(labels.tobytes(), dtype=np.int64, sep=" "), directions])


def _dofs_line_by_line(content: bytes, name: str) -> NDArray[np.int64]:
    dofs = []
    for number, line in enumerate(content.split(), start=1):
        node, _, direction = line.partition(b".")
        if not node.isdigit() or len(node) > _LABEL_DIGITS or direction not in (b"1", b"2", b"3"):
            shown = line[:40].decode("latin-1")
            raise ExportError(f"{name}, line {number}: expected 'node.direction' (1..3), found {shown!r}.")
        dofs.append((int(node), int(direction)))
    return np.array(dofs, dtype=np.int64)


def _rotations_to_reference(
    dofs: NDArray[np.int64], deck: Deck, name: str
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Make DoF 1..3 of ROT NODEs directions 4..6 of their REF NODEs; also return the ROT NODEs' labels."""
    unplaced = np.unique(dofs[~np.isin(dofs[:, 0], deck.node_ids), 0])
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
    missing = np.unique(result[~np.isin(result[:, 0], deck.node_ids), 0])
    if len(missing):
        kinds = f" Elements {', '.join(deck.expanded_elements)} are expanded by ccx." if deck.expanded_elements else ""
        raise ExportError(
            f"{name} names node {missing[0]}, which the deck does not define ({len(missing)} such). Nodes "
            "that ccx makes itself (expanded shells and beams, *COUPLING, *DISTRIBUTING COUPLING) have no position. "
            "Mesh with solids; leave couplings out and tie their nodes here, fi.reduce(part, {'tip': 'SET'}), or use "
            f"*RIGID BODY.{kinds}"
        )
    return result, labels


def _refuse_no_triangle(triplets: Triplets, name: str, n_dofs: int, dof_name: str) -> None:
    """Raise ExportError where the entries are no upper triangle with its whole diagonal."""
    rows, columns = triplets.rows, triplets.columns
    refuse_outside(rows, columns, n_dofs, name, f"{dof_name} ({n_dofs} DoF)")
    if np.any(rows > columns):
        raise ExportError(f"{name} has entries below the diagonal; ccx writes the upper triangle only.")
    on_diagonal = np.bincount(rows[rows == columns], minlength=n_dofs)
    if np.any(on_diagonal == 0):
        row = int(np.flatnonzero(on_diagonal == 0)[0])
        raise ExportError(
            f"{name} has no diagonal entry in row {row + 1} of {n_dofs} "
            f"({int(np.sum(on_diagonal == 0))} such): "
            "truncated, or of another run than the .dof. Export again."
        )
