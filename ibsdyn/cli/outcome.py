"""What a command has to say: to a person, to a program, and to the shell."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

FINE, REMARKS, WRONG = 0, 1, 2
"""Exit codes: done; done, but a requirement is missed or something is remarked; not done, the input is wrong."""


@dataclass(frozen=True)
class Outcome:
    """The end of a command.

    text : for a person; data : the same for ``--json``; status : FINE or REMARKS.
    """

    text: str
    data: Mapping[str, Any]
    status: int = FINE

    def to_json(self) -> str:
        """Return the data as JSON; what is not finite becomes text, as JSON knows no infinity."""
        return json.dumps(_plain(self.data), indent=2, ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else str(float(value))
    if isinstance(value, complex):
        return {"real": _plain(value.real), "imag": _plain(value.imag)}
    return value if value is None or isinstance(value, str) else str(value)
