"""The errors and warnings of ibsdyn; each one also is the built-in that a caller would expect."""

from __future__ import annotations

import os
from collections.abc import Iterable

from fem_import.errors import PACKAGE_FOLDER, nearest_known, warn_outside
from fem_import.keywords import known_keywords as keyword_check


class IbsdynError(Exception):
    """Base of all errors that ibsdyn raises on purpose."""


class ModelError(IbsdynError, ValueError):
    """A component, a connection or a model that cannot be right."""


class UnknownNameError(ModelError, KeyError):
    """A name that the model does not know."""

    def __str__(self) -> str:
        """Return the message as written; KeyError would put it between quotes."""
        return str(self.args[0])


class UnknownKeywordError(ModelError, TypeError):
    """A keyword that the called function does not know."""


class ExpressionError(ModelError):
    """Arithmetic in a model file or table that has no value."""


class ModelFileError(ModelError):
    """A model file or a table of components that cannot be read or written."""


class MissingFileError(ModelFileError, FileNotFoundError):
    """A file that is needed and not there."""


class InterchangeError(IbsdynError, ValueError):
    """A file of results that cannot be read or written."""


class AnalysisError(IbsdynError, ValueError):
    """An analysis that is asked for something that has no answer."""


class StudyError(IbsdynError, RuntimeError):
    """A study that cannot go on: its results file belongs to another one, or its workers died."""


class EngineError(IbsdynError, RuntimeError):
    """Exudyn refused a model or gave back matrices that contradict it."""


class SimulationError(EngineError):
    """A run in time that stalls, diverges or cannot begin."""


class ExcitationError(IbsdynError, ValueError):
    """A signal that cannot be made, or that does not fit the run that it should drive."""


class ExtraMissingError(IbsdynError, ImportError):
    """A package is missing that an extra of ibsdyn brings."""


class RecordError(IbsdynError, ValueError):
    """A time record, or a file of one, that cannot be right."""


class MissingRecordError(RecordError, FileNotFoundError):
    """A file of a time record that is not there."""


class RecordWarning(UserWarning):
    """A suspicious record that is used all the same."""


class HistoryError(IbsdynError, ValueError):
    """A history file that is none or cannot be read, or an entry that it cannot take."""


class HistoryWarning(UserWarning):
    """A revision that is recorded with something missing."""


class ReportError(IbsdynError, ValueError):
    """A report that cannot be made as it was asked for."""


class SimulationWarning(UserWarning):
    """A run in time that is made all the same, though its result may mislead."""


class ModelWarning(UserWarning):
    """Suspicious input that is calculated with all the same."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a sentence that leads from an unknown name to the known ones.

    Parameters
    ----------
    name : what was given.
    known : what would have been understood.

    Returns
    -------
    ``Did you mean 'mirror'? Known: 'base', 'mirror'.``
    """
    return nearest_known(name, known).strip()


def warn_user(message: str, category: type[Warning] = ModelWarning) -> None:
    """Issue a warning that points at the user's line, however deep inside the packages the doubt arose."""
    own = os.path.dirname(os.path.abspath(__file__)) + os.sep
    warn_outside(message, category, (own, PACKAGE_FOLDER))


known_keywords = keyword_check(UnknownKeywordError)
