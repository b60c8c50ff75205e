"""What a long calculation is doing, shown where somebody watches."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")


class Progress:
    """A bar over a known number of stages on the terminal; nothing where standard error is no terminal."""

    def __init__(self, title: str, n_stages: int) -> None:
        """Take the title and the number of calls to `stage` that will come."""
        self._bar = tqdm(
            total=n_stages,
            desc=title,
            bar_format="{desc}: {bar:20} {n_fmt}/{total_fmt} [{elapsed}]{postfix}",
            disable=not sys.stderr.isatty(),
            leave=False,
        )
        self._started = False

    def stage(self, name: str) -> None:
        """Say what begins now."""
        if self._started:
            self._bar.update()
        self._started = True
        self._bar.set_postfix_str(name)

    def through(self, items: Iterable[Item], stages: Iterable[str]) -> Iterator[Item]:
        """Yield the items, each a stage of its own from when it is asked for."""
        waiting = iter(items)
        for stage in stages:
            self.stage(stage)
            yield next(waiting)

    def __enter__(self) -> Progress:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the bar away."""
        self._bar.close()
