"""One table of a model file, or one row of a component table: its values, and errors that name the place."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fem_import.errors import FemImportError
from ibsdyn.errors import ExpressionError, ExtraMissingError, IbsdynError, ModelFileError, nearest
from ibsdyn.expressions import evaluate

# Axes are lists of lists of numbers; nothing is deeper.
_MAX_NESTING = 3


class Table:
    """Keys and values at a place that errors can name.

    Parameters
    ----------
    where : how errors call it, as ``mirror.toml: [connection.mount]``.
    values : what stands in it.
    parameters : for expressions.
    folder : which its paths are relative to.
    allow_outside : whether paths may lead out of the folder.
    """

    def __init__(
        self,
        where: str,
        values: object,
        parameters: Mapping[str, float],
        folder: Path,
        allow_outside: bool = False,
    ) -> None:
        if not isinstance(values, dict):
            raise ModelFileError(f"{where}: must be a table of keys and values, got {values!r}.")
        self.where = where
        self.values: dict[str, Any] = values
        self._parameters = parameters
        self._folder = folder
        self._allow_outside = allow_outside

    def __contains__(self, key: str) -> bool:
        """Tell whether the key is there."""
        return key in self.values

    def error(self, key: str, words: str) -> ModelFileError:
        """Return an error about a key."""
        return ModelFileError(f"{self.where} {key}: {words}")

    def refuse_unknown(self, known: Iterable[str]) -> None:
        """Raise ModelFileError for the first key that is not among the known ones."""
        names = list(known)
        for key in self.values:
            if key not in names:
                raise self.error(key, f"unknown key. {nearest(key, names)}")

    def inner(self, key: str, values: object | None = None) -> Table:
        """Return a table inside this one; ``values`` where it is not simply that of the key."""
        place = f"{self.where} {key}"
        if values is None and key not in self.values:
            raise self.error(key, "is missing.")
        found = self.values[key] if values is None else values
        return Table(place, found, self._parameters, self._folder, self._allow_outside)

    def with_value(self, key: str, value: Any) -> Table:
        """Return the same table with another value for a key: one entry of a list, say."""
        return Table(self.where, {**self.values, key: value}, self._parameters, self._folder, self._allow_outside)

    def without(self, key: str) -> Table:
        """Return the same table without one of its keys."""
        values = {name: value for name, value in self.values.items() if name != key}
        return Table(self.where, values, self._parameters, self._folder, self._allow_outside)

    def text(self, key: str) -> str:
        """Return a text that must be there.

        Raises
        ------
        ModelFileError : missing, or no text.
        """
        if key not in self.values:
            raise self.error(key, "is missing.")
        value = self.values[key]
        if not isinstance(value, str):
            raise self.error(key, f'must be a text in quotes, as {key} = "...", got {value!r}.')
        return value

    def choice(self, key: str, known: Sequence[str]) -> str:
        """Return one of the known texts."""
        value = self.text(key)
        if value not in known:
            raise self.error(key, f"{value!r} is not known. {nearest(value, known)}")
        return value

    def numeric(self, key: str, default: Any = None) -> Any:
        """Return a number or lists of numbers, expressions calculated; what is none of these is left as it is.

        Raises
        ------
        ModelFileError : an expression that has no value, a number that no float can hold, lists in lists in lists.
        """
        return self._calculated(key, self.values[key], 0) if key in self.values else default

    def path(self, key: str) -> Path:
        """Return a path, relative to the folder of the file and inside it.

        Raises
        ------
        ModelFileError : no text, or a path that leads out of the folder.
        """
        given = self.text(key)
        if not given.strip() or "\0" in given:
            raise self.error(key, f"{given!r} is no path.")
        joined = self._folder / given
        try:
            inside = joined.resolve().is_relative_to(self._folder.resolve())
        except (OSError, RuntimeError) as error:  # links in a circle
            raise self.error(key, f"{given!r} is no path: {error}.") from None
        if not inside and not self._allow_outside:
            raise self.error(
                key,
                f"{given!r} leads out of the folder of the model file. Put the file beside it, or allow it by "
                "allow_outside=True if you trust the model file.",
            )
        return joined

    @contextmanager
    def placed_errors(self) -> Iterator[None]:
        """Put the place before the words of errors that arise inside."""
        try:
            yield
        except (ModelFileError, ExtraMissingError):
            raise
        except (IbsdynError, FemImportError, OSError) as error:
            raise ModelFileError(f"{self.where} {error}") from error

    def _calculated(self, key: str, value: Any, depth: int) -> Any:
        if isinstance(value, str):
            if value.strip().lower() in ("inf", "+inf", "infinity"):
                raise self.error(key, f"write inf without the quotes of {value!r}.")
            try:
                return evaluate(value, self._parameters)
            except ExpressionError as error:
                raise self.error(key, str(error)) from None
        if isinstance(value, list):
            if depth == _MAX_NESTING:
                raise self.error(key, f"has lists in lists more than {_MAX_NESTING} deep.")
            return [self._calculated(key, item, depth + 1) for item in value]
        if isinstance(value, int) and not isinstance(value, bool):
            try:
                return float(value)
            except OverflowError:
                raise self.error(key, f"a whole number of {len(str(value))} digits is too large.") from None
        return value
