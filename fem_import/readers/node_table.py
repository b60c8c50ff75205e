"""Text tables of nodes: label and three coordinates a line, as Ansys and spreadsheets write them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError
from fem_import.readers.packed_file import read_bytes, text_of
from fem_import.readers.triplets import refuse_cut_text

_LABEL = re.compile(r"\d{1,15}\.?$")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD]?[+-]?\d+)?$")


@dataclass(frozen=True, eq=False)
class Nodes:
    """Labels (n,), global positions (n, 3) as written, and named sets of labels."""

    labels: NDArray[np.int64]
    positions: NDArray[np.float64]
    sets: dict[str, NDArray[np.int64]]


def read_node_table(path: Path) -> Nodes:
    """Read lines "label x y z", parted by tabs, blanks, semicolons or commas; decimal commas are taken.

    Lines that do not start with a label are headings (NLIST repeats them on each page). A seventh column at
    most: NLIST's angles of the nodal system, which must be zero. Raises ExportError, MissingFileError.
    """
    content = read_bytes(path)
    refuse_cut_text(content, path.name)
    table = _regular_table(text_of(content))
    if table is not None:
        return Nodes(table[:, 0].astype(np.int64), table[:, 1:], {})
    labels: list[int] = []
    positions: list[list[float]] = []
    for number, line in enumerate(text_of(content).splitlines(), start=1):
        fields = _fields(line)
        if not fields or not _LABEL.match(fields[0]):
            continue
        where = f"{path.name}, line {number}"
        if len(fields) not in (4, 7):
            raise ExportError(
                f"{where}: expected 'label x y z', found {line.strip()[:60]!r}. (NWRITE leaves zeros out: write the "
                "nodes "
                "with CDWRITE or NLIST,ALL,,,COORD.)"
            )
        values = [_number(field, where) for field in fields[1:]]
        if any(values[3:]):
            raise ExportError(
                f"{where}: node {fields[0]} has a rotated nodal coordinate system (angles {values[3:]}), so its "
                "matrix rows are not in global axes. Turn it back (NROTAT after CSYS,0) and export again."
            )
        labels.append(int(float(fields[0])))
        positions.append(values[:3])
    if not labels:
        raise ExportError(f"{path.name} holds no line 'label x y z'.")
    return Nodes(np.array(labels, dtype=np.int64), np.array(positions), {})


def _regular_table(text: str) -> NDArray[np.float64] | None:
    """Return label, x, y, z of lines that have just these; None where a line has more, or is hard to tell."""
    lines = [line for line in text.splitlines() if line.lstrip()[:1].isdecimal()]
    body = "\n".join(lines)
    if "\t" in body or ";" in body:
        if "," in body and "." in body:
            return None
        body = body.replace(",", ".")
    words = body.translate({ord("\t"): " ", ord(";"): " "}).split()
    if not lines or set(body) - set("0123456789+-.eE \t;\n"):
        return None
    if len(words) != 4 * len(lines) or any(len(line.replace(";", " ").split()) != 4 for line in lines):
        return None
    labels = words[::4]
    if not all(map(str.isdigit, labels)) or len(max(labels, key=len)) > 15 or not all(map(_NUMBER.match, words)):
        return None
    return np.array(words, dtype=np.float64).reshape(-1, 4)


def _fields(line: str) -> list[str]:
    text = line.strip()
    for separator in ("\t", ";"):
        if separator in text:
            return [field.strip() for field in text.split(separator)]
    fields = text.split()
    if len(fields) == 1 or (fields and fields[0].endswith(",")):  # the comma parts the fields, it is not a decimal one
        return [field.strip() for field in text.split(",")]
    return fields


def _number(field: str, where: str) -> float:
    text = field if "," not in field else field.replace(",", ".")
    if "," in field and "." in field:
        raise ExportError(f"{where}: {field!r} has a comma and a dot. Export without thousands separators.")
    if not _NUMBER.match(text):
        raise ExportError(f"{where}: {field!r} is not a number.")
    return float(text.upper().replace("D", "E"))
