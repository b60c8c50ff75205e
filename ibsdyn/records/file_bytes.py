"""The bytes of a record's file, or why they cannot be had."""

from __future__ import annotations

from pathlib import Path

from ibsdyn.errors import MissingRecordError, RecordError

# What a packed file may unpack to: a GiB, or what no packing of measured noise reaches.
_HARMLESS = 1 << 30
_RATIO = 100


def existing(path: Path) -> Path:
    """Return the path of a file that is there.

    Raises
    ------
    MissingRecordError, RecordError : it is not, or it is no file.
    """
    if not path.exists():
        raise MissingRecordError(f"{path} does not exist.")
    if not path.is_file():
        raise RecordError(f"{path} is not a file.")
    return path


def read_bytes(path: Path) -> bytes:
    """Return the content of a file.

    Raises
    ------
    MissingRecordError, RecordError : it does not exist or cannot be read.
    """
    try:
        return existing(path).read_bytes()
    except OSError as error:
        raise RecordError(f"{path} cannot be read ({error}).") from None


def unpacked_limit(path: Path) -> int:
    """Return the number of bytes that the arrays of a packed file may have."""
    return max(_HARMLESS, _RATIO * path.stat().st_size)


def text_of(content: bytes) -> str:
    """Return the text of a file, in whatever encoding its program wrote it."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")
