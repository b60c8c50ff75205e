"""Read-only mappings by name, one of which answers a wrong name with the nearest right one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeVar

from fem_import.errors import UnknownNameError, nearest_known

Item = TypeVar("Item")


class ReadOnlyMapping(Mapping[str, Item]):
    """Items by name in the order given; it travels between processes, which MappingProxyType does not."""

    def __init__(self, items: Mapping[str, Item]) -> None:
        """Keep a copy of `items`."""
        self._items = dict(items)

    def __getitem__(self, name: str) -> Item:
        """Return the item of that name; KeyError if there is none."""
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names in the order given."""
        return iter(self._items)

    def __len__(self) -> int:
        """Return the number of names."""
        return len(self._items)

    def __repr__(self) -> str:
        """Return the items as a dict shows them."""
        return repr(self._items)


class NamedItems(ReadOnlyMapping[Item]):
    """Read-only {name: item}; names are found in any case, as FEA programs change it.

    Two names that differ only in case stay apart: the exact spelling goes first.
    """

    def __init__(self, kind: str, items: Mapping[str, Item]) -> None:
        """Keep a copy of `items`; `kind` is the word for one of them in messages ("node set")."""
        super().__init__(items)
        self._kind = kind
        self._folded = {name.casefold(): name for name in reversed(self._items)}

    def __getitem__(self, name: str) -> Item:
        """Return the item of that name; UnknownNameError (a KeyError) if there is none."""
        if name in self._items:
            return self._items[name]
        spelled = self._folded.get(name.casefold()) if isinstance(name, str) else None
        if spelled is None:
            raise UnknownNameError(f"There is no {self._kind} {name!r}.{nearest_known(name, self._items)}")
        return self._items[spelled]
