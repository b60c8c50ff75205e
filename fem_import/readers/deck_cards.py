"""Input decks in Abaqus' notation, split into cards: a keyword line with its data lines."""

from __future__ import annotations

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
    for line_number, line in _logical_lines(text_of(read_bytes(path))):
        if not line.startswith("*"):
            if card is not None:
                card.data.append(line)
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
            if "INPUT" in opened.parameters and opened.keyword in ("*NODE", "*NSET", "*ELEMENT", "*ELSET"):
                content = text_of(read_bytes(_named_file(opened, path, job_folder)))
                card.data = [line for _, line in _logical_lines(content) if not line.startswith("*")]
    if card is not None:
        yield card


def _logical_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield (line number, line) without comments and blanks; a keyword line ending in a comma goes on."""
    pending: list[str] = []
    pending_number = 0
    for line_number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        number = pending_number if pending else line_number
        if (pending or line.startswith("*")) and line.endswith(","):
            pending.append(line)
            pending_number = number
            continue
        yield number, "".join([*pending, line])
        pending = []
    if pending:
        yield pending_number, "".join(pending).rstrip(",")


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
