"""One entry of a history."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from ibsdyn.errors import IbsdynError, UnknownNameError, nearest
from ibsdyn.linear_system import LinearSystem
from ibsdyn.model import Model


@dataclass(frozen=True)
class RecordedResult:
    """What a revision predicted for a requirement.

    Attributes
    ----------
    name : of the requirement.
    quantity : what it is about, in words.
    value : in ``unit``; NaN where it could not be calculated.
    limit, sense : ``value <= limit`` or ``value >= limit`` is asked for.
    unit : of value and limit.
    met : whether the value keeps the limit.
    problem : why there is no value; empty otherwise.
    """

    name: str
    quantity: str
    value: float
    limit: float
    sense: str
    unit: str
    met: bool
    problem: str = ""

    def __str__(self) -> str:
        """Return one line: value, limit, met or not."""
        unit = "" if self.unit == "-" else f" {self.unit}"
        if math.isnan(self.value):
            return f"{self.name}: no value ({self.problem})"
        verdict = "met" if self.met else "NOT MET"
        return f"{self.name}: {self.value:.4g}{unit} {self.sense} {self.limit:.4g}{unit} {verdict}"


def recorded_results(model: Model, system: LinearSystem) -> tuple[RecordedResult, ...]:
    """Check every requirement of a model; one without a value is kept with the reason, not left out."""
    results = []
    for requirement in model.requirements.values():
        quantity = requirement.quantity
        try:
            checked = requirement.check(system)
            value, met, problem = checked.value, checked.met, ""
        except IbsdynError as error:
            value, met, problem = math.nan, False, str(error)
        results.append(
            RecordedResult(
                requirement.name,
                quantity.name,
                value,
                requirement.limit,
                requirement.sense,
                quantity.unit,
                met,
                problem,
            )
        )
    return tuple(results)


@dataclass(frozen=True)
class Revision:
    """A model as it was, and what it predicted.

    Attributes
    ----------
    name : of the revision, unique in its history.
    number : its place in the history, from 1.
    date : when it was recorded, UTC.
    note : what the user wrote about it.
    model : name of the model.
    fidelity : "1-D", "3-D", "hybrid", or as given.
    input_hash : SHA-256 of all that the prediction depends on.
    parameters : every number of the components by address, SI.
    versions : of Python and of the packages that calculated.
    results : one a requirement.
    model_file : text of the model file; None where the model could not be written as one.
    no_model_file : why not; empty otherwise.
    """

    name: str
    number: int
    date: datetime
    note: str
    model: str
    fidelity: str
    input_hash: str
    parameters: Mapping[str, float]
    versions: Mapping[str, str]
    results: tuple[RecordedResult, ...]
    model_file: str | None
    no_model_file: str

    @property
    def met(self) -> bool:
        """Whether all its requirements are met."""
        return all(result.met for result in self.results)

    def result(self, requirement: str) -> RecordedResult:
        """Return what it predicted for a requirement; UnknownNameError if it had none of that name."""
        for result in self.results:
            if result.name == requirement:
                return result
        known = [result.name for result in self.results]
        raise UnknownNameError(
            f"revision {self.name!r} has no requirement {requirement!r}. {nearest(requirement, known)}"
        )

    def __str__(self) -> str:
        """Return the revision's head and a line a requirement."""
        head = f"{self.name}  {self.date:%Y-%m-%d %H:%M} UTC  {self.fidelity}  {self.model}"
        note = [f"  {self.note}"] if self.note else []
        return "\n".join([head, *note, *(f"  {result}" for result in self.results)])
