"""A hash of what goes into a calculation, the same in every process and run: content only, to the last digit."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Set
from dataclasses import fields, is_dataclass

import numpy as np


def fingerprint(*values: object) -> str:
    """Return a hash of values made of numbers, texts, arrays, sequences, mappings and objects with fields.

    Raises
    ------
    TypeError : a value whose content cannot be seen, as a function or an open file.
    """
    digest = hashlib.sha256()
    for piece in _pieces(values):
        digest.update(len(piece).to_bytes(8, "little"))  # ("ab", "c") is not ("a", "bc")
        digest.update(piece)
    return digest.hexdigest()


def _pieces(value: object) -> Iterator[bytes]:
    if value is None or isinstance(value, (bool, int, str, bytes)):
        yield f"{type(value).__name__} {value!r}".encode()
    elif isinstance(value, (float, complex, np.generic)):
        yield repr(complex(value) if isinstance(value, complex) else float(value)).encode()
    elif isinstance(value, np.ndarray):
        yield f"array {value.dtype.str} {value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, Mapping):
        yield f"mapping {len(value)}".encode()
        for key, entry in value.items():
            yield from _pieces(key)
            yield from _pieces(entry)
    elif isinstance(value, (list, tuple)):
        yield f"sequence {len(value)}".encode()
        for entry in value:
            yield from _pieces(entry)
    elif isinstance(value, Set):
        yield from _pieces(sorted(value, key=repr))
    elif is_dataclass(value) and not isinstance(value, type):
        yield type(value).__qualname__.encode()
        for field in fields(value):
            yield from _pieces(getattr(value, field.name))
    elif hasattr(value, "__dict__") and not callable(value) and not isinstance(value, type):
        yield type(value).__qualname__.encode()
        # What a cached property keeps is no content, but comes under a name that the class has too.
        own = {key: entry for key, entry in vars(value).items() if not hasattr(type(value), key)}
        yield from _pieces(own)
    else:
        raise TypeError(f"{value!r} has no content that a fingerprint could be taken of.")
