"""A text file of a user, read with suspicion and written whole or not at all."""

from __future__ import annotations

import os
import stat
from difflib import get_close_matches
from pathlib import Path

from fem_import.whole_file import whole_file
from ibsdyn.errors import MissingFileError, ModelFileError

# A model of ten thousand components has 2 MB.
MAX_BYTES = 8 * 2**20
_BOMS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}


def checked_path(path: str | os.PathLike[str], what: str) -> Path:
    """Return a path that can be one; ModelFileError otherwise."""
    try:
        checked = Path(path)
    except TypeError:
        raise ModelFileError(f"{what}: the path must be a text or a Path, got {path!r}.") from None
    if "\0" in str(checked):
        raise ModelFileError(f"{what}: {str(checked)!r} is no path; it has a null character.")
    return checked


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """Return the content of a regular file of at most ``limit`` bytes.

    Raises
    ------
    MissingFileError : it is not there.
    ModelFileError : no regular file, too large, not to be read.
    """
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise ModelFileError(f"{path} is no file but a {'folder' if path.is_dir() else 'device'}.")
        if found.st_size > limit:
            raise ModelFileError(f"{path} has {found.st_size} bytes; at most {limit} are read. Is it the right file?")
        return path.read_bytes()
    except FileNotFoundError:
        raise MissingFileError(f"{path} does not exist.{_similar(path)}") from None
    except OSError as error:
        raise ModelFileError(f"{path} cannot be read: {error.strerror or error}.") from None


def read_text(path: Path, limit: int = MAX_BYTES) -> str:
    """Return the content of a UTF-8 file, without byte order mark.

    Raises
    ------
    MissingFileError : it is not there.
    ModelFileError : not to be read, or in another encoding.
    """
    content = read_bytes(path, limit)
    if content[:2] in _BOMS or b"\0" in content[:100]:
        kind = _BOMS.get(content[:2], "UTF-16 or no text at all")
        raise ModelFileError(f"{path.name} is in {kind}; save it as UTF-8.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise ModelFileError(
            f"{path.name}: line {line} has the byte 0x{content[error.start]:02x}, which is not UTF-8; save the file as "
            "UTF-8 (it is probably in Latin-1 or Windows-1252)."
        ) from None


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 file to a temporary one beside it, then put it in place.

    Raises
    ------
    ModelFileError : it cannot be written; what was there stays.
    """
    try:
        content = text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise ModelFileError(f"{path.name}: {text[error.start]!r} in a name cannot be written as UTF-8.") from None
    try:
        with whole_file(path) as temporary:
            temporary.write_bytes(content)
    except OSError as error:
        raise ModelFileError(f"{path} cannot be written: {error.strerror or error}.") from None


def _similar(path: Path) -> str:
    try:
        names = sorted(entry.name for entry in path.parent.iterdir())
    except OSError:
        return f" There is no folder {path.parent} either."
    beside = get_close_matches(path.name, names, n=5) or [name for name in names if Path(name).suffix == path.suffix]
    return f" Beside it: {', '.join(beside[:5])}." if beside else ""
