"""One self-contained HTML page about a model, for a design review."""

from ibsdyn.reporting.document import report

__all__ = ["report"]
