"""The file of a history: SQLite, one transaction a revision."""

from __future__ import annotations

import hashlib
import json
import math
import os
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from fem_import.names import ReadOnlyMapping
from ibsdyn.errors import HistoryError
from ibsdyn.history.revision import RecordedResult, Revision

# "ibsH": what SQLite keeps in the header for programs to know their files by.
APPLICATION_ID = 0x69627348
FORMAT = 1
# How long a writer waits for another one [s]; a transaction takes milliseconds.
PATIENCE = 30.0

_TABLES = (
    """CREATE TABLE revisions (
        number INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, date TEXT NOT NULL, note TEXT NOT NULL,
        model TEXT NOT NULL, fidelity TEXT NOT NULL, input_hash TEXT NOT NULL, parameters TEXT NOT NULL,
        versions TEXT NOT NULL, model_file TEXT, no_model_file TEXT NOT NULL)""",
    """CREATE TABLE results (
        revision INTEGER NOT NULL REFERENCES revisions(number), place INTEGER NOT NULL, name TEXT NOT NULL,
        quantity TEXT NOT NULL, value REAL, "limit" REAL NOT NULL, sense TEXT NOT NULL, unit TEXT NOT NULL,
        met INTEGER NOT NULL, problem TEXT NOT NULL, PRIMARY KEY (revision, place))""",
    # What a model file refers to, as reduced bodies; kept once however many revisions use it.
    "CREATE TABLE contents (sha256 TEXT PRIMARY KEY, content BLOB NOT NULL)",
    """CREATE TABLE files (
        revision INTEGER NOT NULL REFERENCES revisions(number), path TEXT NOT NULL,
        sha256 TEXT NOT NULL REFERENCES contents(sha256), PRIMARY KEY (revision, path))""",
)
_FIELDS = "number, name, date, note, model, fidelity, input_hash, parameters, versions, model_file, no_model_file"


@dataclass(frozen=True)
class NewRevision:
    """A revision before it has its place: ``name`` None takes its number for a name."""

    name: str | None
    date: datetime
    note: str
    model: str
    fidelity: str
    input_hash: str
    parameters: Mapping[str, float]
    versions: Mapping[str, str]
    results: tuple[RecordedResult, ...]
    model_file: str | None
    no_model_file: str
    files: Mapping[str, bytes]


class Store:
    """Reads and appends revisions; keeps no connection open in between.

    Parameters
    ----------
    path : of the file, which need not exist yet; its folder must.

    Raises
    ------
    HistoryError : a file that is no history, is damaged or was written by a newer version.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        if not isinstance(path, (str, os.PathLike)):
            raise HistoryError(f"History: path must be that of a file, as 'module.history', got {path!r}.")
        self.path = Path(path)
        if self.path.is_dir():
            raise HistoryError(f"{self.path} is a folder; a history is one file, as {self.path / 'history.db'}.")
        if not self.path.parent.is_dir():
            raise HistoryError(f"{self.path}: the folder {self.path.parent} does not exist; make it first.")
        if self._exists():
            with self._reading() as connection:
                (verdict,) = connection.execute("PRAGMA quick_check(1)").fetchone()
                if verdict != "ok":
                    raise HistoryError(f"{self.path} is damaged ({verdict}); restore it from a copy.")

    def revisions(self) -> tuple[Revision, ...]:
        """Return all revisions in the order in which they were recorded; none where there is no file yet."""
        if not self._exists():
            return ()
        with self._reading() as connection:
            results: dict[int, list[RecordedResult]] = {}
            rows = connection.execute(
                'SELECT revision, name, quantity, value, "limit", sense, unit, met, problem FROM results '
                "ORDER BY revision, place"
            )
            for number, name, quantity, value, limit, sense, unit, met, problem in rows:
                known = math.nan if value is None else value
                results.setdefault(number, []).append(
                    RecordedResult(name, quantity, known, limit, sense, unit, bool(met), problem)
                )
            found = connection.execute(f"SELECT {_FIELDS} FROM revisions ORDER BY number").fetchall()
        return tuple(_revision(row, tuple(results.get(row[0], ()))) for row in found)

    def files(self, number: int) -> dict[str, bytes]:
        """Return the files that belong to the model file of a revision, by path beside it."""
        with self._reading() as connection:
            rows = connection.execute(
                "SELECT path, content FROM files JOIN contents USING (sha256) WHERE revision = ?", (number,)
            ).fetchall()
        return {path: bytes(content) for path, content in rows}

    def append(self, new: NewRevision) -> int:
        """Write a revision, whole or not at all, and return its number.

        Raises
        ------
        HistoryError : the name is taken, or the file cannot be written.
        """
        with self._writing() as connection:
            (last,) = connection.execute("SELECT COALESCE(MAX(number), 0) FROM revisions").fetchone()
            number = int(last) + 1
            taken = dict(connection.execute("SELECT name, date FROM revisions").fetchall())
            name = _free_name(number, taken) if new.name is None else new.name
            if name in taken:
                raise HistoryError(
                    f"{self.path}: revision {name!r} was recorded on {taken[name][:16]} UTC, and a history keeps what "
                    "it has; give this one another name, or none to number it."
                )
            row = (
                number, name, new.date.isoformat(), new.note, new.model, new.fidelity, new.input_hash,
                _numbers_as_text(new.parameters), json.dumps(dict(new.versions)), new.model_file, new.no_model_file,
            )  # fmt: skip
            connection.execute(f"INSERT INTO revisions ({_FIELDS}) VALUES ({', '.join('?' * len(row))})", row)
            connection.executemany(
                "INSERT INTO results VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    (number, place, r.name, r.quantity, r.value, r.limit, r.sense, r.unit, int(r.met), r.problem)
                    for place, r in enumerate(new.results)
                ],
            )
            for path, content in new.files.items():
                digest = hashlib.sha256(content).hexdigest()
                connection.execute("INSERT OR IGNORE INTO contents VALUES (?, ?)", (digest, content))
                connection.execute("INSERT INTO files VALUES (?, ?, ?)", (number, path, digest))
        return number

    def _exists(self) -> bool:
        # A writer that was killed before its first transaction leaves a file of nothing.
        return self.path.exists() and self.path.stat().st_size > 0

    @contextmanager
    def _reading(self) -> Iterator[sqlite3.Connection]:
        # "rw", so that what a killed writer left half done can be rolled back; SQLite falls back to reading alone.
        with self._connection("rw") as connection:
            self._check(connection)
            connection.execute("BEGIN")  # all statements of one reading see the same state
            yield connection
            connection.execute("ROLLBACK")

    @contextmanager
    def _writing(self) -> Iterator[sqlite3.Connection]:
        with self._connection("rwc") as connection:
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute("BEGIN IMMEDIATE")  # one writer at a time from here on
            try:
                if not connection.execute("SELECT 1 FROM sqlite_master").fetchone():
                    for table in _TABLES:
                        connection.execute(table)
                    connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                    connection.execute(f"PRAGMA user_version = {FORMAT}")
                self._check(connection)
                yield connection
            except BaseException:
                connection.execute("ROLLBACK")
                raise
            connection.execute("COMMIT")

    @contextmanager
    def _connection(self, mode: str) -> Iterator[sqlite3.Connection]:
        try:
            connection = sqlite3.connect(
                f"{self.path.resolve().as_uri()}?mode={mode}", uri=True, timeout=PATIENCE, isolation_level=None
            )
        except sqlite3.Error as error:
            raise HistoryError(f"{self.path} cannot be opened: {error}.") from error
        try:
            yield connection
        except sqlite3.OperationalError as error:
            locked = "locked" in str(error)
            reason = f"another process has been writing to it for {PATIENCE:g} s" if locked else str(error)
            raise HistoryError(f"{self.path}: {reason}; nothing was recorded or lost.") from error
        except sqlite3.DatabaseError as error:
            no_sqlite = "not a database" in str(error)
            reason = "is no history of ibsdyn" if no_sqlite else f"is damaged ({error}); restore it from a copy"
            raise HistoryError(f"{self.path} {reason}.") from error
        finally:
            connection.close()

    def _check(self, connection: sqlite3.Connection) -> None:
        (identity,) = connection.execute("PRAGMA application_id").fetchone()
        (version,) = connection.execute("PRAGMA user_version").fetchone()
        if identity != APPLICATION_ID:
            raise HistoryError(f"{self.path} is an SQLite file, but no history of ibsdyn; choose another path.")
        if version > FORMAT:
            raise HistoryError(
                f"{self.path} was written by a newer ibsdyn (format {version}, this one knows {FORMAT}); update ibsdyn."
            )


def _revision(row: tuple[object, ...], results: tuple[RecordedResult, ...]) -> Revision:
    number, name, date, note, model, fidelity, input_hash, parameters, versions, model_file, no_model_file = row
    assert isinstance(number, int)
    return Revision(
        name=str(name),
        number=number,
        date=datetime.fromisoformat(str(date)),
        note=str(note),
        model=str(model),
        fidelity=str(fidelity),
        input_hash=str(input_hash),
        parameters=ReadOnlyMapping({key: float(value) for key, value in json.loads(str(parameters)).items()}),
        versions=ReadOnlyMapping(json.loads(str(versions))),
        results=results,
        model_file=None if model_file is None else str(model_file),
        no_model_file=str(no_model_file),
    )


def _numbers_as_text(values: Mapping[str, float]) -> str:
    """JSON has no infinity, which locks a direction: it is written as text."""
    return json.dumps({key: value if math.isfinite(value) else repr(value) for key, value in values.items()})


def _free_name(number: int, taken: Mapping[str, str]) -> str:
    while str(number) in taken:
        number += 1
    return str(number)
