"""Packages that only some users need, imported when they do."""

from __future__ import annotations

import importlib
from typing import Any

from ibsdyn.errors import ExtraMissingError


def extra_package(name: str, extra: str, purpose: str) -> Any:
    """Return a package of an extra.

    Raises
    ------
    ExtraMissingError : it is not installed; the message has the command.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ExtraMissingError(f'{purpose} needs {name}: pip install "ibsdyn[{extra}]".') from None
