"""Reduced bodies kept on disk by the content of everything that made them."""

from __future__ import annotations

import hashlib
import os
import re
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np

from fem_import.component_modes import Recipe
from fem_import.errors import ExportError, ReductionError, warn_user
from fem_import.fe_model import FEModel
from fem_import.interfaces import TiedInterface
from fem_import.reduced_body import ReducedBody
from fem_import.reduced_body_file import read_body, write_body
from fem_import.sensor_points import ObservedPoint

# Counts up when the same input makes another body: what an earlier version left is then not found any more.
_GENERATION = 1


class ReductionCache:
    """One place in a cache folder: the file of the body that these inputs make."""

    def __init__(
        self,
        folder: str | os.PathLike[str],
        part: FEModel,
        interfaces: tuple[TiedInterface, ...],
        sensors: tuple[ObservedPoint, ...],
        recipe: Recipe,
    ) -> None:
        """Find the place by a hash over all inputs; raises ReductionError if the folder cannot be one."""
        if not isinstance(folder, (str, os.PathLike)) or not os.fspath(folder) or "\0" in os.fsdecode(folder):
            raise ReductionError(f"cache must be a folder; got {folder!r}.")
        self._folder = Path(folder)
        if self._folder.exists() and not self._folder.is_dir():
            raise ReductionError(f"cache={str(folder)!r} is a file; give a folder.")
        digest = hashlib.blake2b(digest_size=16)
        _feed(digest, _GENERATION, part.source, part.positions, part.node_ids, part.dofs, part.skin)
        for matrix in (part.K, part.M, part.C):
            _feed(digest, *(() if matrix is None else (matrix.indptr, matrix.indices, matrix.data)))
        for tied in interfaces:
            _feed(digest, tied.name, tied.tie, tied.position, tied.rows, tied.matrix, tied.node_ids)
        for watched in sensors:
            _feed(digest, watched.name, watched.position, watched.rows, watched.matrix, watched.node_ids)
        _feed(digest, *astuple(recipe))
        word = re.sub(r"[^A-Za-z0-9_-]+", "_", Path(part.source).stem)[:40] or "part"
        self.path = self._folder / f"{word}-{digest.hexdigest()}.npz"

    def load(self) -> ReducedBody | None:
        """Return the body; None where there is none yet, or, with a warning, where its file is damaged."""
        if not self.path.is_file():
            return None
        try:
            return read_body(self.path)
        except (ExportError, OSError) as error:
            warn_user(f"The cached body {self.path} cannot be used and is made anew: {error}")
            return None

    def save(self, body: ReducedBody) -> None:
        """Write the body with its basis, whole or not at all; a folder that cannot be written is only warned of."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_body(body, self.path, with_basis=True)
        except OSError as error:
            warn_user(f"The reduced body could not be kept in the cache {self._folder}: {error}")


def _feed(digest: Any, *values: object) -> None:
    for value in values:
        if isinstance(value, np.ndarray):
            array = np.ascontiguousarray(value)
            digest.update(f"{array.dtype.str}{array.shape}".encode())
            digest.update(array.data if array.size else b"")
        else:
            digest.update(f"{value!r};".encode())
