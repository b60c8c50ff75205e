"""Files written whole or not at all."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give the path of an empty file beside ``path`` to write to, and put it in place when all went well.

    Raises
    ------
    OSError : it cannot be written; what was there stays.
    """
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        error.filename = str(path)  # what was asked for, not the file beside it
        if not path.parent.is_dir():
            error.strerror = f"the folder {path.parent} does not exist; make it first"
        raise
    os.close(handle)
    try:
        yield Path(temporary)
        with open(temporary, "rb+") as stream:
            os.fsync(stream.fileno())
        # mkstemp makes files that only their owner can read; these are meant to be shared.
        os.chmod(temporary, stat.S_IMODE(path.stat().st_mode) if path.exists() else 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _umask() -> int:
    mask = os.umask(0o022)  # the only way to ask for it is to set it
    os.umask(mask)
    return mask
