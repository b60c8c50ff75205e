"""Unknown keywords answered with the nearest one that is known."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from fem_import.errors import nearest_known

P = ParamSpec("P")
R = TypeVar("R")


def known_keywords(error: type[Exception]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator that raises ``error`` for a keyword which the function does not have.

    Python itself suggests the nearest keyword only from 3.13 on, and never lists the others.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        parameters = [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]
        called = function.__qualname__.removesuffix(".__init__")

        @functools.wraps(function)
        def checked(*args: P.args, **kwargs: P.kwargs) -> R:
            for keyword in kwargs:
                if keyword not in parameters:
                    raise error(f"{called}() has no parameter {keyword!r}.{nearest_known(keyword, parameters)}")
            return function(*args, **kwargs)

        return checked

    return decorate
