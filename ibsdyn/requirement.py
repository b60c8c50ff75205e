"""A requirement: a quantity and its limit, met or not by a model."""

from __future__ import annotations

from dataclasses import dataclass

from ibsdyn.errors import ModelError, known_keywords, nearest
from ibsdyn.linear_system import LinearSystem, checked_system
from ibsdyn.quantities import Quantity
from ibsdyn.validation import number

SENSES = ("<=", ">=")


@dataclass(frozen=True)
class RequirementResult:
    """What a requirement comes to for one system.

    Attributes
    ----------
    name : of the requirement.
    value, limit : in ``unit``.
    unit : of both.
    met : whether the value keeps the limit.
    margin : what is left of the limit, as a share of it; negative where it is not met.
    sense : ``"<="`` or ``">="``, how the value must stand to the limit.
    """

    name: str
    value: float
    limit: float
    unit: str
    met: bool
    margin: float
    sense: str

    def __str__(self) -> str:
        """Return one line: value, limit, met or not, margin."""
        unit = "" if self.unit == "-" else f" {self.unit}"
        verdict = "met" if self.met else "NOT MET"
        return (
            f"{self.name}: {self.value:.4g}{unit} {self.sense} {self.limit:.4g}{unit} {verdict}, "
            f"margin {100 * self.margin:+.3g} %"
        )


@dataclass(frozen=True, init=False)
class Requirement:
    """A quantity and the limit that it must keep.

    Parameters
    ----------
    name : how results call it.
    quantity : ``ModeFrequency``, ``ModeDamping``, ``ResponseAt``, ``PeakResponse`` or ``RmsResponse``.
    limit : in the unit of the quantity, above 0.
    sense : ``"<="`` (at most, the default) or ``">="`` (at least).

    Raises
    ------
    ModelError : something that is no quantity, no limit or no sense.
    """

    name: str
    quantity: Quantity
    limit: float
    sense: str

    @known_keywords
    def __init__(self, name: str, quantity: Quantity, limit: float, sense: str = "<=") -> None:
        if not isinstance(name, str) or not name.strip():
            raise ModelError(f"requirement: the name must be a non-empty text, got {name!r}.")
        what = f"requirement {name!r}"
        if not callable(getattr(quantity, "evaluate", None)) or isinstance(quantity, type):
            raise ModelError(f"{what}: quantity must be one as ibs.ModeFrequency(1), got {quantity!r}.")
        if sense not in SENSES:
            raise ModelError(f"{what}: sense {sense!r} is not known. {nearest(str(sense), SENSES)}")
        fields = {
            "name": name,
            "quantity": quantity,
            "limit": number(limit, f"{what}: limit", quantity.unit, above=0.0),
            "sense": sense,
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    def __str__(self) -> str:
        """Return one line: name, quantity and limit."""
        unit = "" if self.quantity.unit == "-" else f" {self.quantity.unit}"
        return f"{self.name}: {self.quantity.name} {self.sense} {self.limit:.4g}{unit}"

    def check(self, system: LinearSystem) -> RequirementResult:
        """Return the value of the quantity for a system, held against the limit.

        Raises
        ------
        AnalysisError : the quantity has no value, as that of a mode that does not exist.
        ModelError : no linear system; ``model.check_requirements()`` takes those of a model.
        """
        value = self.quantity.evaluate(checked_system(system, f"requirement {self.name!r}"))
        margin = (self.limit - value) / self.limit if self.sense == "<=" else (value - self.limit) / self.limit
        return RequirementResult(self.name, value, self.limit, self.quantity.unit, margin >= 0.0, margin, self.sense)
