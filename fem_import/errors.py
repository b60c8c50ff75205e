"""What can go wrong with an export, in words that name the item, show the value and say the cure."""

from __future__ import annotations

import difflib
import os
import sys
import warnings
from collections.abc import Iterable

PACKAGE_FOLDER = os.path.dirname(os.path.abspath(__file__)) + os.sep


class FemImportError(Exception):
    """Base of all errors of this package."""


class ExportError(FemImportError, ValueError):
    """An export, or a saved body, that is damaged, incomplete or contradicts itself."""


class MissingFileError(FemImportError, FileNotFoundError):
    """A file that the import needs is not there."""


class UnknownNameError(FemImportError, KeyError):
    """A name that does not exist; the message gives the nearest one that does."""

    def __str__(self) -> str:
        """Return the message itself (KeyError would show its repr)."""
        return str(self.args[0]) if self.args else ""


class UnknownKeywordError(UnknownNameError, TypeError):
    """A keyword that the called function does not have."""


class InterfaceError(FemImportError, ValueError):
    """Nodes that cannot be tied to a frame of six degrees of freedom."""


class ReductionError(FemImportError, ValueError):
    """A part or a request that cannot be reduced."""


class ExportWarning(UserWarning):
    """Something in an export or a reduction that the user should know before trusting it."""


def nearest_known(name: object, known: Iterable[str]) -> str:
    """Say which of the known names is meant: " Did you mean 'x'? Known: ..." (leading blank included)."""
    names = list(known)
    by_folded = {candidate.casefold(): candidate for candidate in names}
    close = difflib.get_close_matches(str(name).casefold(), list(by_folded), n=1, cutoff=0.5)
    guess = f" Did you mean {by_folded[close[0]]!r}?" if close else ""
    shown = ", ".join(repr(candidate) for candidate in names[:20]) + (", ..." if len(names) > 20 else "")
    return f"{guess} Known: {shown}." if names else " There are none."


def refuse_unknown_names(what: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Raise UnknownNameError for the first of the given names that is not known."""
    names = list(known)
    for name in given:
        if name not in names:
            raise UnknownNameError(f"{what} has no {name!r}.{nearest_known(name, names)}")


def warn_user(message: str) -> None:
    """Issue an ExportWarning that points at the first line outside this package."""
    warn_outside(message, ExportWarning, (PACKAGE_FOLDER,))


def warn_outside(message: str, category: type[Warning], folders: tuple[str, ...]) -> None:
    """Issue a warning that points at the first line outside some folders.

    A fixed stacklevel would be wrong for one of two routes, as `read` calls `read_calculix`.
    """
    level = 1
    frame = sys._getframe()
    while frame.f_back is not None and os.path.abspath(frame.f_code.co_filename).startswith(folders):
        frame = frame.f_back
        level += 1
    warnings.warn(message, category, stacklevel=level)
