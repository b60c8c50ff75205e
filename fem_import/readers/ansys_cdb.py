"""Nodes and named components of an Ansys archive (CDWRITE)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError
from fem_import.readers.node_table import Nodes
from fem_import.readers.packed_file import read_bytes, text_of
from fem_import.readers.triplets import refuse_cut_text

_NODE_FORMAT = re.compile(r"\((\d)i(\d{1,2})(?:,(\d)i(\d{1,2}))?,(\d)[ge](\d{1,2})\.\d+(?:e\d)?\)", re.IGNORECASE)
_NONE = np.empty(0, np.int64)
_COMPONENT_FORMAT = re.compile(r"\((\d{1,2})i(\d{1,2})\)", re.IGNORECASE)


def read_archive(path: Path) -> Nodes:
    """Read NBLOCK and the CMBLOCKs of nodes. Raises ExportError, MissingFileError.

    Format: Ansys Mechanical APDL command reference, CDWRITE; each block is led by its Fortran format, blanks
    at the end of a line are zeros.
    """
    content = read_bytes(path)
    refuse_cut_text(content, path.name)
    lines = enumerate(text_of(content).splitlines(), start=1)
    labels: list[NDArray[np.int64]] = []
    positions: list[NDArray[np.float64]] = []
    sets: dict[str, NDArray[np.int64]] = {}
    for number, line in lines:
        where = f"{path.name}, line {number}"
        words = [word.strip() for word in line.partition("!")[0].split(",")]
        if words[0].upper() == "NBLOCK":
            block_labels, block_positions = _node_block(lines, where)
            labels.append(block_labels)
            positions.append(block_positions)
        elif words[0].upper() == "CMBLOCK" and len(words) > 3 and words[2].upper().startswith("NODE"):
            sets[words[1]] = _component(lines, words, where, np.unique(np.concatenate([_NONE, *labels])))
    if not labels or not sum(map(len, labels)):
        raise ExportError(f"{path.name} holds no NBLOCK of nodes. Write it with CDWRITE,DB,name,cdb (blocked format).")
    return Nodes(np.concatenate(labels), np.vstack(positions), sets)


def _node_block(lines: Iterator[tuple[int, str]], where: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    _, format_line = next(lines, (0, ""))
    found = _NODE_FORMAT.match(format_line.replace(" ", ""))
    if found is None:
        raise ExportError(f"{where}: NBLOCK must be followed by a format such as (3i9,6e21.13e3); got {format_line!r}.")
    n_whole, whole_width, n_more, more_width, n_real, real_width = (int(group or 0) for group in found.groups())
    start = n_whole * whole_width + n_more * more_width
    if not whole_width or not real_width or n_real < 3:
        raise ExportError(f"{where}: the format {format_line.strip()} cannot hold nodes.")
    labels: list[int] = []
    rows: list[list[float]] = []
    for number, line in lines:
        text = line.rstrip()
        if text[:2].upper() == "N," or text.strip() == "-1":
            break
        try:
            label = int(text[:whole_width])
            # A cut number would be another number: each field is whole or blank.
            n_fields, rest = divmod(max(len(text) - start, 0), real_width)
            if rest or n_fields > n_real or label < 1:
                raise ValueError
            fields = [text[start + k * real_width : start + (k + 1) * real_width] for k in range(n_fields)]
            values = [float(field.replace("D", "E")) if field.strip() else 0.0 for field in fields]
        except ValueError:
            raise ExportError(
                f"line {number} of the block of {where}: expected a node as {format_line.strip()}, found {text[:60]!r}."
            ) from None
        values += [0.0] * (n_real - len(values))
        if any(values[3:]):
            raise ExportError(
                f"{where}: node {label} has a rotated nodal coordinate system, so its matrix rows are not in global "
                "axes. Turn it back (NROTAT after CSYS,0) and export again."
            )
        labels.append(label)
        rows.append(values[:3])
    else:
        raise ExportError(f"{where}: the NBLOCK has no end: the file is truncated. Write it again.")
    return np.array(labels, dtype=np.int64), np.array(rows).reshape(-1, 3)


def _component(
    lines: Iterator[tuple[int, str]], words: list[str], where: str, known: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the labels of a component; -n after m stands for the nodes there are from m+1 to n."""
    _, format_line = next(lines, (0, ""))
    found = _COMPONENT_FORMAT.match(format_line.replace(" ", ""))
    if found is None or not words[3].isdigit() or len(words[3]) > 12:
        raise ExportError(f"{where}: expected CMBLOCK,name,NODE,count and a format such as (8i10).")
    per_line, width, count = int(found[1]), int(found[2]), int(words[3])
    if not per_line or not width:
        raise ExportError(f"{where}: the format {format_line.strip()} holds nothing.")
    items: list[int] = []
    while len(items) < count:
        _, line = next(lines, (0, ""))
        text = line.rstrip()
        fields = [text[at : at + width] for at in range(0, min(len(text), per_line * width), width)]
        try:
            items += [int(field) for field in fields]
        except ValueError:
            raise ExportError(f"{where}: component {words[1]!r} holds {text[:60]!r}, expected labels.") from None
        if not fields:
            raise ExportError(
                f"{where}: component {words[1]!r} announces {count} items and has {len(items)}: truncated?"
            )
    chosen = [_NONE]
    previous = 0
    for item in items[:count]:
        first, last = (previous + 1, -item) if item < 0 else (item, item)
        members = known[np.searchsorted(known, first) : np.searchsorted(known, last, side="right")]
        if not len(members) or (item < 0 and previous == 0):
            raise ExportError(f"{where}: component {words[1]!r} names node {first}, which the NBLOCK does not have.")
        chosen.append(members)
        previous = last
    return np.unique(np.concatenate(chosen))
