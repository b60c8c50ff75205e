"""Abaqus: the matrices of a substructure, written as a linear user element."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_import.errors import ExportError, UnknownKeywordError
from fem_import.keywords import known_keywords
from fem_import.readers.abaqus_deck import read_abaqus_deck
from fem_import.readers.assembly import warn_of_few_digits
from fem_import.readers.long_text import LongText
from fem_import.readers.packed_file import read_bytes, text_of
from fem_import.readers.superelement import MODAL, superelement_body
from fem_import.readers.triplets import parse_numbers, printed_digits, refuse_cut_text
from fem_import.reduced_body import ReducedBody
from fem_import.units import required_units

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]

_NODE_COUNT = re.compile(r"NODES=(\d{1,6})(,|$)")


@known_keywords(UnknownKeywordError)
def read_abaqus_substructure(
    path: str | os.PathLike[str],
    interfaces: Mapping[str, int],
    *,
    units: str | None = None,
    deck: str | os.PathLike[str] | None = None,
    positions: Mapping[int, ArrayLike] | None = None,
) -> ReducedBody:
    """Read the matrices of `*SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED` as a reduced body.

    Parameters
    ----------
    path : the .mtx file with STIFFNESS=YES and MASS=YES (gzipped or not).
    interfaces : {name: label of the retained node}, each with DoF 1 to 6 retained.
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required, as no file says it.
    deck, positions : where the retained nodes are: the .inp of the model, or {node label: (x, y, z)}.

    Returns
    -------
    ReducedBody : retained eigenmodes (internal nodes without a positive label) become its modes.

    Raises
    ------
    ExportError, InterfaceError, MissingFileError, UnknownNameError : what is wrong and how to mend it.

    Notes
    -----
    The file lists the lower triangle row by row; rows go node by node in the order of its element nodes.
    """
    source = Path(path)
    required_units(units, source.name)
    content = read_bytes(source)
    refuse_cut_text(content, source.name)
    dofs, blocks = _blocks(text_of(content), source.name)
    for kind, card in (("STIFFNESS", "STIFFNESS=YES"), ("MASS", "MASS=YES")):
        if kind not in blocks:
            raise ExportError(f"{source.name} holds no {kind.lower()} matrix. Write it with {card}.")
    matrices = {
        kind: _lower_triangle(lines, len(dofs), f"{source.name}, {kind.lower()}") for kind, lines in blocks.items()
    }
    if positions is None and deck is None:
        raise ExportError(
            f"{source.name} holds no node positions. Give deck= (the .inp) or positions={{label: (x, y, z)}}."
        )
    if positions is None:
        nodes = read_abaqus_deck(Path(str(deck)))
        positions = dict(zip(nodes.labels.tolist(), nodes.positions, strict=True))
    digits = min(max(printed_digits(line.rstrip(" ,").encode() + b"\n") for line in lines) for lines in blocks.values())
    label = f"Abaqus substructure {source.name}"
    warn_of_few_digits(digits, label)
    return superelement_body(matrices["STIFFNESS"], matrices["MASS"], None, dofs, interfaces, positions, units, label)


def _blocks(text: str, name: str) -> tuple[IntArray, dict[str, list[str]]]:
    """Return the DoF table and the data lines of each *MATRIX."""
    labels: list[int] = []
    dof_lines: list[str] = []
    blocks: dict[str, list[str]] = {}
    n_nodes: int | None = None
    target: list[str] | None = None
    in_node_comment = False
    for raw in text.splitlines():
        line = raw.strip()
        squeezed = line.upper().replace(" ", "")
        if squeezed.startswith("**"):
            listed = re.fullmatch(r"\*\*\s*((?:-?\d{1,15}\s*,?\s*)+)", line)
            if in_node_comment and listed:
                labels += [int(word) for word in re.findall(r"-?\d+", listed[1])]
            else:
                in_node_comment = squeezed.startswith("**ELEMENTNODES")
            continue
        in_node_comment = False
        if squeezed.startswith("*USERELEMENT"):
            if n_nodes is not None:
                raise ExportError(f"{name} holds more than one element. Write one substructure a file.")
            found = _NODE_COUNT.search(squeezed)
            if found is None or "UNSYMM" in squeezed:
                raise ExportError(
                    f"{name}: expected '*USER ELEMENT, NODES=n, LINEAR' (symmetric), found {line[:60]!r}."
                )
            n_nodes, target = int(found[1]), dof_lines
        elif squeezed.startswith("*MATRIX,TYPE="):
            kind = squeezed.partition("TYPE=")[2].partition(",")[0]
            if kind in blocks:
                raise ExportError(f"{name} gives the {kind.lower()} matrix twice.")
            target = blocks.setdefault(kind, [])
        elif squeezed.startswith("*"):
            target = None
        elif target is not None and line:
            target.append(line)
    if n_nodes is None or not dof_lines:
        raise ExportError(f"{name} is no substructure's matrix file: it has no *USER ELEMENT with its DoF.")
    if len(labels) != n_nodes:
        raise ExportError(
            f"{name} announces {n_nodes} nodes and lists {len(labels)} after '** ELEMENT NODES'. Damaged?"
        )
    return _dof_table(dof_lines, labels, name), blocks


def _dof_table(lines: list[str], labels: list[int], name: str) -> IntArray:
    """First line: the DoF of the first node and, until a line "position, DoF ..." changes them, of those after."""
    try:
        rows = [[int(word) for word in line.rstrip(", ").split(",")] for line in lines]
    except ValueError:
        raise ExportError(
            f"{name}: the DoF lines of *USER ELEMENT must be whole numbers; found {lines[0][:60]!r}."
        ) from None
    changes = {1: rows[0]} | {row[0]: row[1:] for row in rows[1:]}
    table: list[tuple[int, int]] = []
    active: list[int] = []
    for position, label in enumerate(labels, start=1):
        active = changes.get(position, active)
        for direction in active:
            if label > 0 and not 1 <= direction <= 6:
                raise ExportError(f"{name}: DoF {direction} of node {label} is no displacement or rotation (1..6).")
            table.append((label, direction if label > 0 else MODAL))
    return np.array(table, dtype=np.int64).reshape(-1, 2)


def _lower_triangle(lines: list[str], size: int, what: str) -> FloatArray:
    text = " ".join(lines).replace(",", " ").encode("latin-1", errors="replace")
    if size > 20_000:
        raise ExportError(f"{what}: {size} DoF are no reduced body.")
    values = parse_numbers(LongText(text), size * (size + 1) // 2, what)
    matrix = np.zeros((size, size))
    matrix[np.tril_indices(size)] = values
    return np.asarray(matrix + np.tril(matrix, -1).T)
