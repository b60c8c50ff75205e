"""What a file holds before anyone said what it means: columns of numbers, labels, a sample rate perhaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ibsdyn.axes import Array
from ibsdyn.errors import RecordError, UnknownNameError, nearest


@dataclass(frozen=True, eq=False)
class Columns:
    """The content of a record's file.

    Attributes
    ----------
    source : name of the file, for messages.
    labels : what the file calls each column; made different by the readers.
    values : (n_samples,) of each column.
    units : what the file says of each column's unit; None where it says nothing.
    sample_rates : [Hz] of each column; None where the file says nothing.
    starts : time of the first sample of each column [s].
    period : samples in one period of the excitation; None where the file says nothing.
    full_scale : numbers are fractions of the recorder's full scale, as in WAV.
    """

    source: str
    labels: tuple[str, ...]
    values: tuple[Array, ...]
    units: tuple[str | None, ...]
    sample_rates: tuple[float | None, ...]
    starts: tuple[float, ...]
    period: int | None = None
    full_scale: bool = False

    def place(self, column: str | int, whose: str) -> int:
        """Return the place of a column by its label or its number from 0.

        Raises
        ------
        UnknownNameError, RecordError : there is none; the message lists those that are there.
        """
        if isinstance(column, int):
            if not 0 <= column < len(self.labels):
                raise RecordError(
                    f"{self.source} has {len(self.labels)} columns, numbered 0 to {len(self.labels) - 1} "
                    f"({self._listed()}); {whose} asks for column {column}."
                )
            return column
        if column not in self.labels:
            raise UnknownNameError(
                f"{self.source} has no column {column!r}, which {whose} asks for. {nearest(column, self.labels)}"
            )
        return self.labels.index(column)

    def _listed(self) -> str:
        return ", ".join(repr(label) for label in self.labels[:20]) + (", ..." if len(self.labels) > 20 else "")


def different(labels: Sequence[str]) -> tuple[str, ...]:
    """Return labels of which repeated ones are numbered: ``acc``, ``acc (2)``."""
    found: list[str] = []
    for label in labels:
        number, candidate = 1, label
        while candidate in found:
            number += 1
            candidate = f"{label} ({number})"
        found.append(candidate)
    return tuple(found)
