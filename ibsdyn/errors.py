"""The errors and warnings of ibsdyn; each one also is the built-in that a caller would expect."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Callable, Iterable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


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


class AnalysisError(IbsdynError, ValueError):
    """An analysis that is asked for something that has no answer."""


class EngineError(IbsdynError, RuntimeError):
    """Exudyn refused a model or gave back matrices that contradict it."""


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
    names = [str(k) for k in known]
    lower = {k.lower(): k for k in names}
    close = difflib.get_close_matches(str(name).lower(), list(lower), n=1, cutoff=0.5)
    guess = f"Did you mean {lower[close[0]]!r}? " if close else ""
    listing = ", ".join(repr(k) for k in names[:12]) + (", ..." if len(names) > 12 else "")
    return f"{guess}Known: {listing}." if names else "There are none yet."


def known_keywords(function: Callable[P, R]) -> Callable[P, R]:
    """Make a function answer an unknown keyword with the nearest one that it knows.

    Raises
    ------
    UnknownKeywordError : in place of Python's bare TypeError.
    """
    parameters = [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        for keyword in kwargs:
            if keyword not in parameters:
                called = function.__qualname__.removesuffix(".__init__")
                raise UnknownKeywordError(f"{called}() has no parameter {keyword!r}. {nearest(keyword, parameters)}")
        return function(*args, **kwargs)

    return checked
