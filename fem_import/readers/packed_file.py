"""The bytes of a file, unpacked where it is gzipped, within bounds."""

from __future__ import annotations

import zlib
from pathlib import Path

from fem_import.errors import ExportError, MissingFileError

_GZIP = b"\x1f\x8b"
_CHUNK = 1 << 24
_HARMLESS = 1 << 26  # bytes that any file may unpack to
_RATIO = 200  # printed matrices were measured to shrink 3 to 15 times, the most repetitive ones below 100


def read_bytes(path: Path) -> bytes:
    """Return the content of a file, unpacked if it is gzipped (told by content, not by name).

    Raises MissingFileError, and ExportError for what is no file, is damaged, or unpacks to absurd size.
    """
    _refuse_no_file(path)
    try:
        content = path.read_bytes()
        return _unpacked(content, path) if content[:2] == _GZIP else content
    except (OSError, zlib.error) as error:
        raise unreadable(path, error) from None


def is_packed(path: Path) -> bool:
    """Whether a file is gzipped. Raises as `read_bytes` does."""
    return _head(path, len(_GZIP)) == _GZIP


def first_bytes(path: Path, size: int) -> bytes:
    """Return the start of a file's (unpacked) content, to tell what it is."""
    head = _head(path, size)
    try:
        return zlib.decompressobj(wbits=31).decompress(head, size) if head[:2] == _GZIP else head
    except zlib.error as error:
        raise unreadable(path, error) from None


def unreadable(path: Path, error: Exception) -> ExportError:
    """Return the error to raise where the system, or a packed file's check, refused."""
    return ExportError(f"{path} cannot be read ({error}); damaged or truncated? Export it again.")


def _head(path: Path, size: int) -> bytes:
    _refuse_no_file(path)
    try:
        with path.open("rb") as stream:
            return stream.read(size)
    except OSError as error:
        raise unreadable(path, error) from None


def _refuse_no_file(path: Path) -> None:
    if not path.exists():
        raise MissingFileError(f"{path} does not exist.")
    if not path.is_file():
        raise ExportError(f"{path} is not a file.")


def text_of(content: bytes) -> str:
    """Return the text of a file of names and numbers, in whatever encoding its program wrote it."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    return content.removeprefix(b"\xef\xbb\xbf").decode("latin-1")


def bare_suffix(path: Path) -> str:
    """Return the suffix in lower case, that before .gz where there is one."""
    return (path.with_suffix("") if path.suffix.lower() == ".gz" else path).suffix.lower()


def _unpacked(content: bytes, path: Path) -> bytes:
    limit = max(_HARMLESS, _RATIO * len(content))
    parts: list[bytes] = []
    size = 0
    rest = content
    while rest[:2] == _GZIP:  # gzip files may be concatenated
        unpacker = zlib.decompressobj(wbits=31)
        while not unpacker.eof:
            part = unpacker.decompress(rest, _CHUNK)
            rest = unpacker.unconsumed_tail
            size += len(part)
            parts.append(part)
            if size > limit:
                raise ExportError(
                    f"{path} unpacks to more than {_RATIO} times its size; no printed matrix does. Unpack it "
                    "yourself if it is what you mean."
                )
            if not part and not rest and not unpacker.eof:
                raise ExportError(
                    f"{path} cannot be read (it ends within the packed data); truncated? Export it again."
                )
        rest = unpacker.unused_data
    if rest.strip(b"\0"):
        raise ExportError(f"{path} cannot be read (something follows the packed data); damaged? Export it again.")
    return b"".join(parts)
