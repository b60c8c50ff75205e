"""What a model keeps by name beside its components, as far as the model itself needs to know it."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from ibsdyn.linear_system import LinearSystem


class Registered(Protocol):
    """Anything with a name."""

    @property
    def name(self) -> str:
        """How the model calls it."""


@runtime_checkable
class Disturbance(Registered, Protocol):
    """A power spectral density on an input."""

    @property
    def psd(self) -> object:
        """Its one-sided density."""


class RequirementResult(Registered, Protocol):
    """Whether a requirement is met."""

    @property
    def met(self) -> bool:
        """Whether it is met."""


@runtime_checkable
class Requirement(Registered, Protocol):
    """A quantity and its limit."""

    def check(self, system: LinearSystem) -> RequirementResult:
        """Tell whether a system meets it."""
