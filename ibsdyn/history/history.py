"""Predicted performance as the design progresses."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING

from ibsdyn.errors import (
    HistoryError,
    HistoryWarning,
    IbsdynError,
    UnknownNameError,
    known_keywords,
    nearest,
    warn_user,
)
from ibsdyn.history.difference import Difference, difference
from ibsdyn.history.revision import RecordedResult, Revision, recorded_results
from ibsdyn.history.store import NewRevision, Store
from ibsdyn.model import Model
from ibsdyn.provenance import fidelity_of, input_hash, versions

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.axes import Axes

MODEL_FILE = "model.toml"
# A model whose files are larger is recorded without them: a history is passed around by mail.
MOST_BYTES = 64 * 2**20


class History:
    """A file that keeps what each revision of a model predicts against each requirement.

    Parameters
    ----------
    path : of the file (SQLite); made by the first ``record``.

    Raises
    ------
    HistoryError : a file that is no history, is damaged or was written by a newer ibsdyn.
    """

    @known_keywords
    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._store = Store(path)

    @property
    def path(self) -> Path:
        """The file."""
        return self._store.path

    @property
    def revisions(self) -> tuple[Revision, ...]:
        """All revisions, in the order in which they were recorded."""
        return self._store.revisions()

    def __len__(self) -> int:
        """Return the number of revisions."""
        return len(self.revisions)

    def __getitem__(self, revision: str) -> Revision:
        """Return a revision by name; UnknownNameError if there is none."""
        found = {each.name: each for each in self.revisions}
        if revision not in found:
            raise UnknownNameError(f"{self.path} has no revision {revision!r}. {nearest(str(revision), found)}")
        return found[revision]

    def __repr__(self) -> str:
        """Name the file and count the revisions."""
        return f"History({str(self.path)!r}, {len(self)} revisions)"

    def __str__(self) -> str:
        """Return the revisions, a line for each of their requirements."""
        return "\n".join(str(revision) for revision in self.revisions) or f"{self.path}: no revision yet"

    @known_keywords
    def record(
        self, model: Model, note: str = "", revision: str | None = None, fidelity: str | None = None
    ) -> Revision:
        """Evaluate the requirements of a model and keep the result.

        Parameters
        ----------
        model : with its requirements (``model.add_requirement``).
        note : what changed, for those who read the history.
        revision : its name; its number if None.
        fidelity : "1-D", "3-D" or "hybrid", found from the model if None; or a word of your own.

        Returns
        -------
        The revision as recorded.

        Raises
        ------
        HistoryError : a name that is taken, or a file that cannot be written.
        ModelError, EngineError, AnalysisError : the model cannot be calculated.

        Warns
        -----
        HistoryWarning : no requirements, a requirement without a value, or a model that cannot be rebuilt later.
        """
        for value, what in ((note, "note"), (revision, "revision"), (fidelity, "fidelity")):
            if not isinstance(value, str) and not (value is None and what != "note"):
                raise HistoryError(f"{what} must be a text, got {value!r}.")
        if not isinstance(model, Model):
            raise HistoryError(f"record takes an ibs.Model, got {model!r}.")
        if revision is not None and not revision.strip():
            raise HistoryError("revision must be a text that is not empty; leave it out to number the revision.")
        results = _results(model)
        if not results:
            warn_user(
                f"model {model.name!r} has no requirements; its parameters are recorded, and nothing to hold against a "
                "limit. Add some by model.add_requirement(...).",
                HistoryWarning,
            )
        text, files, why_not = _written(model)
        if why_not:
            warn_user(
                f"model {model.name!r} is recorded by its numbers only and cannot be rebuilt later: {why_not}",
                HistoryWarning,
            )
        new = NewRevision(
            name=revision,
            date=datetime.now(timezone.utc).replace(microsecond=0),
            note=note,
            model=model.name,
            fidelity=fidelity_of(model) if fidelity is None else fidelity,
            input_hash=input_hash(model),
            parameters=model.parameters(),
            versions=versions(),
            results=results,
            model_file=text,
            no_model_file=why_not,
            files=files,
        )
        number = self._store.append(new)
        return next(each for each in self.revisions if each.number == number)

    def model(self, revision: str) -> Model:
        """Return the model of a revision, built anew from what was recorded.

        Parameters
        ----------
        revision : its name.

        Raises
        ------
        UnknownNameError : no such revision.
        HistoryError : the model could not be written as a file when it was recorded.
        ModelFileError : this ibsdyn no longer reads that file.
        """
        found = self[revision]
        if found.model_file is None:
            raise HistoryError(f"revision {revision!r} cannot be rebuilt: {found.no_model_file}")
        with tempfile.TemporaryDirectory(prefix="ibsdyn-history-") as folder:
            for path, content in self._store.files(found.number).items():
                target = (Path(folder) / path).resolve()
                if not target.is_relative_to(Path(folder).resolve()):
                    raise HistoryError(f"revision {revision!r} keeps a file outside its folder: {path!r}.")
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(content)
            main = Path(folder) / MODEL_FILE
            main.write_text(found.model_file, encoding="utf-8")
            return Model.from_toml(main)

    def diff(self, before: str, after: str) -> Difference:
        """Return which parameters changed between two revisions and what that did to each requirement.

        Parameters
        ----------
        before, after : names of the revisions.

        Returns
        -------
        Difference. Where the first model can be rebuilt, each change is also made by itself.

        Raises
        ------
        UnknownNameError : no such revision.
        """
        one, other = self[before], self[after]
        try:
            return difference(one, other, self.model(before), "")
        except IbsdynError as error:
            return difference(one, other, None, str(error))

    def plot(self, axes: Sequence[Axes] | np.ndarray | None = None) -> np.ndarray:
        """Draw predicted performance against revision, a panel a requirement, with the requirement's limit.

        Parameters
        ----------
        axes : one a requirement; a new figure if None.

        Returns
        -------
        (n_requirements,) array of matplotlib Axes.

        Raises
        ------
        HistoryError : nothing recorded yet.
        """
        from ibsdyn.plotting.history import plot_history

        return plot_history(self.revisions, axes, self.path.name)


def _results(model: Model) -> tuple[RecordedResult, ...]:
    results = recorded_results(model, model.linearize())
    for result in results:
        if result.problem:
            warn_user(f"requirement {result.name!r} is recorded without a value: {result.problem}", HistoryWarning)
    return results


def _written(model: Model) -> tuple[str | None, dict[str, bytes], str]:
    """Return the model file's text and the files beside it, or why there are none."""
    with tempfile.TemporaryDirectory(prefix="ibsdyn-history-") as name:
        folder = Path(name)
        try:
            model.to_toml(folder / MODEL_FILE)
        except (IbsdynError, ValueError) as error:
            return None, {}, str(error)
        beside = {
            file.relative_to(folder).as_posix(): file.read_bytes()
            for file in sorted(folder.rglob("*"))
            if file.is_file() and file != folder / MODEL_FILE
        }
        size = sum(len(content) for content in beside.values())
        if size > MOST_BYTES:
            return None, {}, f"its flexible bodies take {size / 2**20:.0f} MB, more than a history keeps of a revision."
        return (folder / MODEL_FILE).read_text(encoding="utf-8"), beside, ""
