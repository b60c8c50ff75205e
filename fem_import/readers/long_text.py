"""A text as long as a printed matrix, read block by block where a file holds it, so that it never fills the memory."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, TypeVar, cast

import numpy as np

from fem_import.progress import Progress
from fem_import.readers.packed_file import is_packed, read_bytes, unreadable
from fem_import.threads import n_threads, one_behind_another, side_by_side

Parsed = TypeVar("Parsed")
Made = TypeVar("Made")

BLOCK = 1 << 17  # bytes; stays in the cache
_LARGER_BLOCK = 1 << 19  # on which threads work without standing in each other's way
_NEWLINE = ord("\n")
_TAIL = 256
_SAMPLES, _SAMPLE = 32, 8192


class LongText:
    """A range of bytes, of a file or in memory. Slices are bytes; `between` is another LongText.

    Raises ExportError where the file can no longer be read.
    """

    def __init__(self, source: bytes | Path, start: int = 0, stop: int | None = None) -> None:
        self._source = source
        self._start = start
        size = (len(source) if isinstance(source, bytes) else source.stat().st_size) if stop is None else stop
        self._stop = max(size, start)

    def __len__(self) -> int:
        """Return the number of bytes."""
        return self._stop - self._start

    def __bytes__(self) -> bytes:
        """Return all of it."""
        return self[:]

    def __getitem__(self, places: slice) -> bytes:
        """Return a range of bytes."""
        start, stop, _ = places.indices(len(self))
        with self._opened() as stream:
            return self._read(stream, start, stop - start)

    def between(self, start: int, stop: int | None = None) -> LongText:
        """Return the bytes from `start` up to `stop`."""
        return LongText(self._source, self._start + start, self._stop if stop is None else self._start + stop)

    def line_at(self, start: int) -> bytes:
        """Return the line that starts there, with its end where it has one."""
        size = BLOCK
        while (end := self[start : start + size].find(b"\n")) < 0 and start + size < len(self):
            size *= 2
        return self[start : start + end + 1] if end >= 0 else self[start:]

    def blocks_of_lines(self) -> Iterator[bytes]:
        """Yield whole lines, up to one that is longer than a block or has no end."""
        start = 0
        with self._opened() as stream:
            while start < len(self):
                stop = min(start + BLOCK, len(self))
                # A line mostly ends in the last bytes; to look there first spares a copy of the block.
                for tail in (_TAIL, BLOCK):
                    first = max(start, stop - tail)
                    end = first + self._read(stream, first, stop - first).rfind(b"\n") + 1
                    if end > first:
                        break
                else:
                    return
                yield self._read(stream, start, end - start)
                start = end

    def count_lines(self) -> int:
        """Return the number of line ends."""
        share = -(-len(self) // n_threads()) or 1
        parts = [self.between(start, min(start + share, len(self))) for start in range(0, len(self), share)]
        return sum(side_by_side(LongText._count_line_ends, parts))

    def about_lines(self) -> int:
        """Return the number of line ends or, of a long text, an estimate of it with 1 % more."""
        if len(self) < _SAMPLES * BLOCK:
            return self.count_lines()
        step = len(self) // _SAMPLES
        with self._opened() as stream:
            samples = b"".join(self._read(stream, start, _SAMPLE) for start in range(step // 2, len(self), step))
        return int(1.01 * samples.count(b"\n") / max(1, len(samples)) * len(self))

    def ends_of_lines(self, numbers: list[int]) -> list[int]:
        """Return where the lines of these ascending numbers (from 1) end, as many of them as there are."""
        ends: list[int] = []
        passed = start = 0
        with self._opened() as stream:
            while start < len(self) and len(ends) < len(numbers):
                text = np.frombuffer(self._read(stream, start, _LARGER_BLOCK), np.uint8)
                found = np.flatnonzero(text == _NEWLINE)
                while len(ends) < len(numbers) and numbers[len(ends)] <= passed + len(found):
                    number = numbers[len(ends)]
                    ends.append(start + int(found[number - passed - 1]) + 1 if number else 0)
                passed += len(found)
                start += len(text)
                if not len(text):  # the file has shrunk
                    break
        return ends

    def _count_line_ends(self) -> int:
        room = np.empty(min(_LARGER_BLOCK, len(self)), np.uint8)
        flags = np.empty(len(room), bool)
        count = 0
        with self._opened() as stream:
            stream.seek(self._start)
            for start in range(0, len(self), len(room)):
                size = cast("Any", stream).readinto(room[: len(self) - start])
                count += int(np.count_nonzero(np.equal(room[:size], _NEWLINE, out=flags[:size])))
        return count

    @contextmanager
    def _opened(self) -> Iterator[BinaryIO]:
        if isinstance(self._source, bytes):
            yield io.BytesIO(self._source)
            return
        try:
            with open(self._source, "rb", buffering=0) as stream:
                yield stream
        except OSError as error:
            raise unreadable(self._source, error) from None

    def _read(self, stream: BinaryIO, start: int, size: int) -> bytes:
        stream.seek(self._start + start)
        return stream.read(max(0, min(size, len(self) - start)))


def texts_of(*paths: Path) -> Iterator[LongText]:
    """Return the texts of files in order; a thread unpacks the gzipped ones while the caller works.

    Raises MissingFileError and ExportError as `read_bytes` does.
    """
    pool = ThreadPoolExecutor(1)
    waiting = [pool.submit(read_bytes, path) if is_packed(path) else path for path in paths]
    pool.shutdown(wait=False)
    return (LongText(item if isinstance(item, Path) else item.result()) for item in waiting)


def read_in_turn(
    paths: Sequence[Path],
    texts: Iterator[LongText],
    parse: Callable[[tuple[Path, LongText]], Parsed],
    assemble: Callable[[Parsed], Made],
) -> list[Made]:
    """Return assemble(parse((path, text))) of each file, one assembled while the next is parsed; shown on a terminal.

    Raises what was raised for the first file that failed.
    """
    with Progress(f"reading {paths[0].name}", len(paths)) as progress:
        shown = progress.through(texts, (path.name for path in paths))
        return one_behind_another(parse, assemble, zip(paths, shown, strict=True))
