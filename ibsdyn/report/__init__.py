"""One self-contained HTML page about a model, for a design review."""

from ibsdyn.report.document import report

__all__ = ["report"]
