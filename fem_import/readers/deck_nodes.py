"""The *NODE cards of input decks in Abaqus' notation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fem_import.readers.deck_cards import Card


def node_block(card: Card, words: range) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the labels (n,) and the coordinates (n, 3), as written, of one card.

    words: how many a line may have; Abaqus puts a normal behind the coordinates, CalculiX does not.
    """
    system = card.parameters.get("SYSTEM", "R").upper()
    if system != "R":
        card.refuse(f"SYSTEM={system}: only rectangular coordinates are read.")
    if not card.data:
        return np.empty(0, np.int64), np.empty((0, 3))
    try:
        table = np.loadtxt(card.data, delimiter=",", ndmin=2, comments=None)
        if table.shape[1] != 4:
            raise ValueError("short lines")
    except ValueError:
        table = np.array([_node_line(card, line, words) for line in card.data])
    labels = table[:, 0]
    if not np.all(np.isfinite(table)):
        card.refuse(f"node {labels[~np.isfinite(table).all(axis=1)][0]:.0f} has a coordinate that is not finite.")
    if np.any(labels != np.floor(labels)) or np.any(labels < 1) or np.any(labels > 2**53):
        wrong = labels[(labels != np.floor(labels)) | (labels < 1) | (labels > 2**53)][0]
        card.refuse(f"{wrong!s} is not a node label.")
    return labels.astype(np.int64), table[:, 1:]


def _node_line(card: Card, line: str, words: range) -> list[float]:
    """Parse one line with what the fast route does not take: left-out coordinates (0) and D exponents."""
    found = [word.strip().upper().replace("D", "E") for word in line.rstrip(", ").split(",")]
    if len(found) not in words:
        card.refuse(f"expected 'label, x, y, z', found {line[:60]!r}.")
    try:
        values = [float(word) if word else 0.0 for word in found[:4]]
    except ValueError:
        card.refuse(f"expected 'label, x, y, z', found {line[:60]!r}.")
    return values + [0.0] * (4 - len(values))
