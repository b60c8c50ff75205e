"""What changed between two revisions, and what that did to each requirement."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fem_import.names import ReadOnlyMapping
from fem_import.progress import Progress
from ibsdyn.errors import IbsdynError
from ibsdyn.history.revision import RecordedResult, Revision

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.model import Model

# What the same model gives again, on another machine or with another version, agrees to this share.
SAME = 1e-6
NO_EFFECT = 1e-10


@dataclass(frozen=True)
class ParameterChange:
    """A parameter that both revisions have, with another value.

    Attributes
    ----------
    address : as ``mirror.mass``.
    before, after : SI.
    """

    address: str
    before: float
    after: float

    def __str__(self) -> str:
        """Return ``mirror.mass: 0.25 -> 0.3 (+20 %)``."""
        share = ""
        if self.before and math.isfinite(self.before) and math.isfinite(self.after):
            share = f" ({100 * (self.after / self.before - 1):+.3g} %)"
        return f"{self.address}: {self.before:.6g} -> {self.after:.6g}{share}"


@dataclass(frozen=True)
class Effect:
    """What the changes did to a requirement.

    Attributes
    ----------
    name : of the requirement.
    before, after : its results; None where a revision does not have it.
    contributions : by address, what each change does by itself to the first revision's value, in the requirement's
        unit; NaN where it cannot be made alone. Empty where the first revision cannot be rebuilt.
    """

    name: str
    before: RecordedResult | None
    after: RecordedResult | None
    contributions: Mapping[str, float]

    @property
    def total(self) -> float:
        """Value after less value before; NaN where one of them is missing or they are in different units."""
        if self.before is None or self.after is None or self.before.unit != self.after.unit:
            return math.nan
        return self.after.value - self.before.value

    @property
    def remainder(self) -> float:
        """What the single changes do not explain: their interplay, and all that is no change of a number."""
        return self.total - float(np.nansum([0.0, *self.contributions.values()]))

    def __str__(self) -> str:
        """Return values before and after, then the largest contributions."""
        if self.before is None or self.after is None:
            only = self.after or self.before
            return f"{'new' if self.before is None else 'gone'}: {only}"
        unit = "" if self.after.unit == "-" else f" {self.after.unit}"
        turned = ""
        if self.before.met != self.after.met:
            turned = ", now met" if self.after.met else ", NO LONGER MET"
        lines = [f"{self.name}: {self.before.value:.4g} -> {self.after.value:.4g}{unit} ({self.total:+.3g}){turned}"]
        if self.before.quantity != self.after.quantity:
            lines.append(f"  another quantity: {self.before.quantity} -> {self.after.quantity}")
        if self.before.limit != self.after.limit:
            lines.append(f"  limit {self.before.limit:.4g} -> {self.after.limit:.4g}{unit}")
        ranked = sorted(self.contributions.items(), key=lambda pair: -abs(np.nan_to_num(pair[1])))
        lines += [f"  {value:+10.3g}  {address}" for address, value in ranked[:8] if value]
        if self.contributions:
            lines.append(f"  {self.remainder:+10.3g}  together or by structure")
        return "\n".join(lines)


@dataclass(frozen=True)
class Difference:
    """What changed between two revisions.

    Attributes
    ----------
    before, after : the revisions.
    changed : parameters that have another value.
    appeared, vanished : parameters that only one of them has, with their values, SI.
    effects : one a requirement of either.
    notes : what else the reader must know, in words.
    """

    before: Revision
    after: Revision
    changed: tuple[ParameterChange, ...]
    appeared: Mapping[str, float]
    vanished: Mapping[str, float]
    effects: tuple[Effect, ...]
    notes: tuple[str, ...]

    def __str__(self) -> str:
        """Return the changes, then what they did."""
        lines = [f"{self.before.name} ({self.before.fidelity}) -> {self.after.name} ({self.after.fidelity})"]
        lines += [f"  {change}" for change in self.changed]
        for words, found in (("new", self.appeared), ("gone", self.vanished)):
            names = [address.split(".", 1)[0] for address in found]
            for name in dict.fromkeys(names):
                entries = [address.split(".", 1)[1] for address in found if address.split(".", 1)[0] == name]
                more = f" and {len(entries) - 4} more" if len(entries) > 5 else ""
                lines.append(f"  {words}: {name} ({', '.join(entries[:4] if more else entries)}{more})")
        if len(lines) == 1:
            lines.append("  no parameter changed")
        lines += ["", *(str(effect) for effect in self.effects)]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def plot(self, axes: Sequence[Axes] | np.ndarray | None = None) -> np.ndarray:
        """Draw what each change did to each requirement as bars from the value before to the value after.

        Parameters
        ----------
        axes : one a requirement that both revisions have; a new figure if None.

        Returns
        -------
        (n_requirements,) array of matplotlib Axes.

        Raises
        ------
        AnalysisError : the revisions have no requirement in common.
        """
        from ibsdyn.plotting.history import plot_difference

        return plot_difference(self, axes)


def difference(before: Revision, after: Revision, first: Model | None, why_not: str) -> Difference:
    """Return what changed between two revisions.

    Parameters
    ----------
    before, after : the revisions.
    first : the model of ``before``, to make each change by itself; None where it cannot be rebuilt.
    why_not : says why.
    """
    old, new = before.parameters, after.parameters
    changed = tuple(
        ParameterChange(address, value, new[address])
        for address, value in old.items()
        if address in new and new[address] != value
    )
    notes = []
    contributions: dict[str, dict[str, float]] = {}
    if first is None:
        notes.append(f"what each change does by itself is not known: {why_not}")
    elif changed:
        contributions, doubts = _contributions(before, changed, first)
        notes += doubts
    if before.input_hash != after.input_hash and not changed and old.keys() == new.keys():
        notes.append("the numbers of the components are the same; a flexible body, signal or requirement is another")
    if before.versions != after.versions:
        pairs = [f"{p} {before.versions.get(p, '-')} -> {v}" for p, v in after.versions.items()
                 if before.versions.get(p) != v]  # fmt: skip
        notes.append(f"calculated by other versions: {', '.join(pairs)}")
    one = {result.name: result for result in before.results}
    other = {result.name: result for result in after.results}
    effects = tuple(
        Effect(name, one.get(name), other.get(name), ReadOnlyMapping(contributions.get(name, {})))
        for name in dict.fromkeys([*one, *other])
    )
    return Difference(
        before,
        after,
        changed,
        ReadOnlyMapping({address: value for address, value in new.items() if address not in old}),
        ReadOnlyMapping({address: value for address, value in old.items() if address not in new}),
        effects,
        tuple(notes),
    )


def _contributions(
    before: Revision, changed: Sequence[ParameterChange], first: Model
) -> tuple[dict[str, dict[str, float]], list[str]]:
    """Return {requirement: {address: change of its value}} and doubts in words."""
    reference = requirement_values(first)
    notes = []
    for result in before.results:
        again = reference.get(result.name, math.nan)
        if abs(again - result.value) > SAME * abs(result.value):
            notes.append(
                f"{result.name}: recorded as {result.value:.6g}, the same model gives {again:.6g} {result.unit} now"
            )
    found: dict[str, dict[str, float]] = {name: {} for name in reference}
    with Progress("changes one by one", len(changed)) as progress:
        for change in changed:
            progress.stage(change.address)
            try:
                values = requirement_values(first.with_parameters({change.address: change.after}))
            except IbsdynError as error:
                values = {}
                notes.append(f"{change.address} cannot change alone: {error}")
            for name, value in reference.items():
                by_itself = values.get(name, math.nan) - value
                # What is left of rounding is no effect.
                found[name][change.address] = 0.0 if abs(by_itself) < NO_EFFECT * abs(value) else by_itself
    return found, notes


def requirement_values(model: Model) -> dict[str, float]:
    """Return the value of each requirement's quantity, NaN where it has none."""
    system = model.linearize()
    values = {}
    for name, requirement in model.requirements.items():
        try:
            values[name] = requirement.check(system).value
        except IbsdynError:
            values[name] = math.nan
    return values
