"""Locked directions: which coordinates they leave, and how all others follow from those."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibsdyn.assembly import Assembly
from ibsdyn.axes import Array
from ibsdyn.components import FlexibleBody
from ibsdyn.errors import ModelError
from ibsdyn.validation import in_words

# Rows of locks hold direction cosines and levers in metres; what is left of one below this is rounding.
PIVOT_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Elimination:
    """The independent coordinates of a model with locked directions.

    Attributes
    ----------
    free : (n,) places of the independent free coordinates among all N.
    base : (n_base,) places of the fixations' coordinates.
    to_full : (N, n + n_base) all coordinates from the independent ones and the base's.
    redundant : number of locks that repeat others (the model is over-constrained by as many).
    """

    free: np.ndarray
    base: np.ndarray
    to_full: Array
    redundant: int

    @property
    def independent(self) -> np.ndarray:
        """(n + n_base,) places of both, in that order."""
        return np.concatenate([self.free, self.base])


def eliminate_locks(assembly: Assembly) -> Elimination:
    """Express the coordinates that locks determine by the others.

    Interface frames are eliminated first, then bodies, the last added first; fixations and modes never.

    Raises
    ------
    ModelError : locks tie fixations to each other, or leave nothing that can move.
    """
    count = len(assembly.names)
    base = np.flatnonzero(assembly.is_base)
    locked = [joint.locks for joint in assembly.joints if any(joint.connection.locked)]
    if not locked and not assembly.is_base.all():  # the base comes last: nothing changes places
        return Elimination(np.flatnonzero(~assembly.is_base), base, np.eye(count), 0)
    rows = np.vstack([np.zeros((0, count)), *locked])
    total = len(rows)
    determined: list[int] = []
    eliminated: list[Array] = []
    for group in _groups(assembly) if total else ():
        rows, pivots, expressions = _reduce(rows, group)
        for column, expression in zip(pivots, expressions, strict=True):
            eliminated = [row - row[column] * expression for row in eliminated]
            eliminated.append(expression)
            determined.append(column)
    if np.abs(rows).max(initial=0.0) > PIVOT_TOLERANCE:
        tied = {assembly.names[c].rsplit(".", 1)[0] for c in np.flatnonzero(np.abs(rows).max(axis=0) > PIVOT_TOLERANCE)}
        raise ModelError(
            f"locked connections (inf) tie the fixations {in_words(sorted(tied))} rigidly to each other, so they "
            "could not move independently; give one of those connections a finite stiffness or use one fixation."
        )
    independent = ~assembly.is_base
    independent[determined] = False
    free = np.flatnonzero(independent)
    if not len(free):
        raise ModelError("every coordinate is locked (inf) to a fixation: nothing in the model can move.")
    kept = np.concatenate([free, base])
    to_full = np.eye(count)[:, kept]
    for column, expression in zip(determined, eliminated, strict=True):
        to_full[column] = -expression[kept]
    return Elimination(free, base, to_full, total - len(determined))


def _groups(assembly: Assembly) -> list[np.ndarray]:
    interfaces = [np.arange(place.start, place.stop) for name, place in assembly.places.items() if "." in name]
    bodies = [
        np.arange(assembly.places[item.name].start, assembly.places[item.name].stop)
        for item in reversed(assembly.bodies)
        if not isinstance(item, FlexibleBody)
    ]
    return [np.concatenate(interfaces), *bodies] if interfaces else bodies


def _reduce(rows: Array, columns: np.ndarray) -> tuple[Array, list[int], list[Array]]:
    """Gauss-Jordan with complete pivoting over some columns; return the rows left, the pivots, the pivot rows."""
    pivots: list[int] = []
    done: list[Array] = []
    while len(rows):
        block = np.abs(rows[:, columns])
        row, place = np.unravel_index(int(block.argmax()), block.shape)
        if block[row, place] <= PIVOT_TOLERANCE:
            break
        column = int(columns[place])
        pivot_row = rows[row] / rows[row, column]
        rows = np.delete(rows, row, axis=0)
        rows = rows - np.outer(rows[:, column], pivot_row)
        rows[:, column] = 0.0
        done = [earlier - earlier[column] * pivot_row for earlier in done]
        pivots.append(column)
        done.append(pivot_row)
    return rows, pivots, done
