"""What a result came from: the content of the model as a hash, its fidelity, the versions that calculated it."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib.metadata import PackageNotFoundError, version
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from fem_import import ReducedBody
from ibsdyn.components import FlexibleBody

if TYPE_CHECKING:
    from ibsdyn.model import Model

PACKAGES = ("ibsdyn", "exudyn", "numpy", "scipy")


def fidelity_of(model: Model) -> str:
    """Return "1-D", "3-D" (rigid bodies only) or "hybrid" (with flexible bodies)."""
    if model.axis is not None:
        return "1-D"
    return "hybrid" if any(isinstance(item, FlexibleBody) for item in model.items.values()) else "3-D"


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that calculate."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def input_hash(model: Model) -> str:
    """Return the SHA-256 of all that a model's predictions depend on, its requirements included.

    Notes
    -----
    The model's own name is left out: a copy under another name is the same input. Numbers enter to their last digit,
    so a flexible body reduced anew on another machine is another input.
    """
    registered = (model.items, model.connections, model.inputs, model.sensors, model.disturbances, model.requirements)
    digest = hashlib.sha256()
    for part in _content((model.axis, *(list(each.values()) for each in registered))):
        digest.update(len(part).to_bytes(8, "little") + part)  # lengths first: no two contents run into each other
    return digest.hexdigest()


def _content(value: object) -> Iterator[bytes]:
    """Walk through a value down to its numbers and texts."""
    if value is None or isinstance(value, (bool, str)):
        yield f"{type(value).__name__}:{value}".encode()
    elif isinstance(value, ReducedBody):
        yield value.checksum.encode()
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype.str}{value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, Real):
        yield float(value).hex().encode()
    elif isinstance(value, Mapping):
        yield f"mapping {len(value)}".encode()
        for key, entry in value.items():
            yield from _content(key)
            yield from _content(entry)
    elif isinstance(value, (list, tuple)):
        yield f"sequence {len(value)}".encode()
        for entry in value:
            yield from _content(entry)
    else:
        # A quantity may be a class of the user's own: what it carries is what it is.
        known = [field.name for field in fields(value)] if is_dataclass(value) else list(vars(value))
        yield f"{type(value).__module__}.{type(value).__qualname__}".encode()
        for name in known:
            yield name.encode()
            yield from _content(getattr(value, name))
