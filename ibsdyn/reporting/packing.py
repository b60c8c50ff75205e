"""Numbers as the page's scripts read them."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

_TYPES = {"f4": "<f4", "i2": "<i2", "u4": "<u4"}


def packed(values: ArrayLike, kind: str) -> dict[str, str]:
    """Return an array as base64 of 32-bit floats ("f4"), 16-bit integers ("i2") or 32-bit counts ("u4")."""
    array = np.ascontiguousarray(values, dtype=_TYPES[kind])
    return {kind: base64.b64encode(array.tobytes()).decode("ascii")}


def json_for_script(data: Any) -> str:
    """Return JSON that no text in it can break out of: nothing that HTML reads inside a script element is left."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
