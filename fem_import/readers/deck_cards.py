"""Input decks in Abaqus' notation, split into cards: a keyword line with its data lines."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from fem_import.errors import ExportError, MissingFileError
from fem_import.readers.packed_file import read_bytes, text_of

_DEEPEST = 20  # includes within includes; real decks have two or three
_MOST_FILES = 10_000


@dataclass
class Card:
    """One keyword ("*NODE") with its parameters, in capitals, and its data lines, still text."""

    keyword: str
    parameters: dict[str, str]
    where: str
    data: list[str] = field(default_factory=list)

    def refuse(self, what: str) -> NoReturn:
        """Raise ExportError with the place and the keyword."""
        raise ExportError(f"{self.where}, {self.keyword}: {what}")


def read_cards(path: Path) -> Iterator[Card]:
    """Yield the cards in order, those of *INCLUDE in place, data of INPUT= files filled in.

    Raises ExportError with file and line (includes in a circle or too deep), MissingFileError.
    """
    yield from _cards(path, path.parent, (), [0])


def _cards(path: Path, job_folder: Path, including: tuple[Path, ...], n_files: list[int]) -> Iterator[Card]:
    resolved = path.resolve()
    if resolved in including:
        chain = " -> ".join(item.name for item in (*including, resolved))
        raise ExportError(f"*INCLUDE goes round in a circle: {chain}.")
    n_files[0] += 1
    if len(including) >= _DEEPEST or n_files[0] > _MOST_FILES:
        raise ExportError(f"{path.name}: *INCLUDE goes deeper than {_DEEPEST} files or over {_MOST_FILES} files.")
    card: Card | None = None
    for line_number, line, data in _blocks(text_of(read_bytes(path))):
        if line is None:
            if card is not None:
                card.data += data
            continue
        if card is not None:
            yield card
            card = None
        opened = _keyword_card(line, f"{path.name}, line {line_number}")
        if opened.keyword == "*INCLUDE":
            included = _named_file(opened, path, job_folder)
            yield from _cards(included, job_folder, (*including, resolved), n_files)
        else:
            card = opened
            card.data = data
            if "INPUT" in opened.parameters and opened.keyword in ("*NODE", "*NSET", "*ELEMENT", "*ELSET"):
                content = text_of(read_bytes(_named_file(opened, path, job_folder)))
                card.data = [line for line in map(str.strip, content.splitlines()) if line and line[0] != "*"]
    if card is not None:
        yield card


def _blocks(text: str) -> Iterator[tuple[int, str | None, list[str]]]:
    """Yield line number, keyword line (None where a comment stands) and the data lines up to the next one.

    A keyword line that ends in a comma goes on in the line after it. Data lines are most of a deck, so they are
    taken in blocks.
    """
    lines = [line.strip() for line in text.splitlines()]
    starred = [number for number, line in enumerate(lines) if line[:1] == "*"]
    pending, pending_at = "", 0
    for first, last in itertools.pairwise([*starred, len(lines)]):
        data = [line for line in lines[first + 1 : last] if line]
        is_comment = lines[first].startswith("**")
        if not is_comment:
            pending, pending_at = pending + lines[first], pending_at if pending else first
        while pending.endswith(",") and data:
            pending += data.pop(0)
        if pending and not pending.endswith(","):
            yield pending_at + 1, pending, data
            pending = ""
        elif is_comment and not pending:
            yield first + 1, None, data
    if pending:
        yield pending_at + 1, pending.rstrip(","), []


def _keyword_card(line: str, where: str) -> Card:
    keyword, *words = line.split(",")
    parameters = {}
    for word in words:
        name, _, value = word.partition("=")
        parameters[" ".join(name.upper().split())] = value.strip().strip("\"'")
    return Card(" ".join(keyword.upper().split()), parameters, where)


def _named_file(card: Card, including: Path, job_folder: Path) -> Path:
    name = card.parameters.get("INPUT") or card.refuse("the parameter INPUT= is missing.")
    if "\0" in name:
        card.refuse(f"INPUT={name!r} is not a file name.")
    # The path counts from where the job was started, which was most likely the folder of the job.
    candidates = [folder / name for folder in (including.parent, job_folder)]
    candidates += [candidate.with_name(candidate.name + ".gz") for candidate in candidates if candidate.name]
    for candidate in candidates:
        try:
            if candidate.is_file():
                return candidate
        except OSError:
            continue  # a name too long for a file is none
    raise MissingFileError(f"{card.where}: the file {name[:80]!r} is not in {including.parent}. Copy it there.")
