"""What each revision of a model predicted, kept in one file."""

from ibsdyn.history.difference import Difference, Effect, ParameterChange
from ibsdyn.history.history import History
from ibsdyn.history.revision import RecordedResult, Revision

__all__ = ["Difference", "Effect", "History", "ParameterChange", "RecordedResult", "Revision"]
