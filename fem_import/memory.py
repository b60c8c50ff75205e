"""How much memory this machine has."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from pathlib import Path

_LIMIT_OF_GROUP = Path("/sys/fs/cgroup/memory.max")  # of a container


class _MemoryStatus(ctypes.Structure):
    """What Windows' GlobalMemoryStatusEx fills in."""

    _fields_ = [
        ("size", ctypes.c_ulong),
        ("load", ctypes.c_ulong),
        *[(name, ctypes.c_ulonglong) for name in ("physical", "free", "page", "page_free", "own", "own_free", "more")],
    ]


def physical_memory() -> float:
    """Return the bytes of memory that this process may have; infinity where the system does not tell."""
    found = [_of_machine()]
    with contextlib.suppress(OSError, ValueError):  # no container, or one without a limit ("max")
        found.append(float(_LIMIT_OF_GROUP.read_text()))
    return min(found)


def _of_machine() -> float:
    if sys.platform == "win32":
        status = _MemoryStatus(size=ctypes.sizeof(_MemoryStatus))
        known = ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))
        return float(status.physical) if known else float("inf")
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return float("inf")
