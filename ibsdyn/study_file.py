"""The results file of a study: one line of JSON for every finished chunk, written through to the disk.

Lines are only ever added. A process that is killed in the middle of one leaves a torn line, which counts as not
calculated; all lines before it are whole. So does what a damaged disk or an editor has left of others.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ibsdyn.errors import StudyError

FORMAT = "ibsdyn study 1"


@dataclass(frozen=True)
class VariantResult:
    """What one variant came to.

    Attributes
    ----------
    variant : its number, from 0.
    values : one for each quantity; None where it failed.
    failures : why, by quantity; one entry "" if the variant could not be linearised at all.
    """

    variant: int
    values: tuple[float | None, ...]
    failures: Mapping[str, str]


class StudyFile:
    """Finished variants of one study on disk.

    Parameters
    ----------
    path : the file; made if it is not there.
    fingerprint : of the study's input; a file of another study is refused.
    title : of the study, for readers of the file.
    count : of its quantities.

    Raises
    ------
    StudyError : the file belongs to another study or is none.
    OSError : it cannot be read or written.
    """

    def __init__(self, path: Path, fingerprint: str, title: str, count: int) -> None:
        self._path = path
        self.finished: dict[int, VariantResult] = {}
        head = {"format": FORMAT, "fingerprint": fingerprint, "study": title}
        content = path.read_bytes() if path.exists() else b""
        lines = [entry for entry in map(_parsed, content.split(b"\n")) if entry is not None]
        if content.strip() and not (lines and lines[0].get("format") == FORMAT and "fingerprint" in lines[0]):
            # A study that was killed while it wrote the very first line has nothing else in its file.
            if not json.dumps(head).encode().startswith(content.strip()):
                raise StudyError(f"{path} is no results file of a study; it stays as it is. Name another file.")
            lines = []
        if lines and lines[0]["fingerprint"] != fingerprint:
            raise StudyError(
                f"{path} holds results of another study ({lines[0].get('study', 'unnamed')}): its model, variants or "
                "quantities differ from these. Name another file, or remove it to begin anew."
            )
        for line in lines[1:]:
            results = line.get("variants")
            for result in (_result(entry, count) for entry in (results if isinstance(results, list) else ())):
                if result is not None:
                    self.finished[result.variant] = result
        # A torn line gets its end, so that the next one stands by itself.
        self._start = b"\n" if content and not content.endswith(b"\n") else b""
        if not lines:
            self._write(head)

    def add(self, results: Iterable[VariantResult]) -> None:
        """Add finished variants; when this returns they are on the disk."""
        self._write(
            {
                "variants": [
                    {"variant": r.variant, "values": list(r.values), "failures": dict(r.failures)} for r in results
                ]
            }
        )

    def _write(self, entry: Mapping[str, object]) -> None:
        line = self._start + json.dumps(entry).encode() + b"\n"
        descriptor = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            while line:
                line = line[os.write(descriptor, line) :]
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        self._start = b""


def _parsed(line: bytes) -> dict[str, Any] | None:
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    return entry if isinstance(entry, dict) else None


def _result(entry: object, count: int) -> VariantResult | None:
    """Return what one variant came to, None where the entry is damaged."""
    if not isinstance(entry, dict):
        return None
    variant, values, failures = (entry.get(key) for key in ("variant", "values", "failures"))
    if not isinstance(variant, int) or not isinstance(values, list) or not isinstance(failures, dict):
        return None
    if len(values) != count or not all(value is None or isinstance(value, (int, float)) for value in values):
        return None
    return VariantResult(variant, tuple(values), failures)
