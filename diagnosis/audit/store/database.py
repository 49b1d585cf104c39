"""The store's SQLite file: opened safely, written in whole transactions, its errors in plain words."""

from __future__ import annotations

import os
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from replay.errors import MfhcaError, OutputError
from replay.version import __version__

SCHEMA = "2"
_APPLICATION = 0x6D666863  # "mfhc": tells the file from other SQLite files
_BUSY_MS = 1_000
_PATIENCE_S = 120.0
_WHAT = "SELECT application_id FROM pragma_application_id UNION ALL SELECT name FROM sqlite_schema WHERE type = 'table'"
_TABLES = {"meta", "file", "mission", "result", "attempt", "fault", "component"}
#: Tables that stores of the same schema may lack, because they were made by an earlier version.
_LATER = ("repair",)
_LATER_COLUMNS = (
    ("fault", "unclear", "INTEGER NOT NULL DEFAULT 0"),
    ("result", "left_out", "INTEGER NOT NULL DEFAULT 0"),
    ("result", "limit_option", "TEXT"),
    ("result", "limit_value", "REAL"),
    ("result", "no_log", "INTEGER"),
)
_FULL = ("database or disk is full", "disk I/O error", "unable to open database file")


class Database:
    """One connection, which threads may share; each transaction is written to the disk before it counts."""

    def __init__(self, path: Path, *, read_only: bool = False, patience_s: float = _PATIENCE_S) -> None:
        self.path = path
        self._patience_s = patience_s
        self._lock = threading.RLock()
        if read_only and not path.is_file():
            raise OutputError(f"{path}: there is no store; run `mfhca audit` first")
        try:
            if not read_only:
                path.parent.mkdir(parents=True, exist_ok=True)
            self._open(read_only)
        except (sqlite3.Error, OSError, UnicodeDecodeError) as error:
            raise self.plain(error) from error

    def _open(self, read_only: bool) -> None:
        name = f"{self.path.resolve().as_uri()}?mode=ro" if read_only else str(self.path)
        self._connection = sqlite3.connect(
            name, uri=read_only, timeout=_BUSY_MS / 1000, isolation_level=None, check_same_thread=False
        )
        try:
            self._connection.row_factory = sqlite3.Row
            self._connection.execute("PRAGMA foreign_keys = ON")
            self._connection.execute("PRAGMA trusted_schema = OFF")
            self._check(empty=not read_only)
            if not read_only:
                self._patiently("PRAGMA journal_mode = WAL")
                self._connection.execute("PRAGMA synchronous = FULL")
                with self.transaction() as connection:
                    if not connection.execute("PRAGMA application_id").fetchone()[0]:
                        self._create(connection)
                    self._add_later(connection)
        except BaseException:
            self._connection.close()
            raise

    def _check(self, *, empty: bool) -> None:
        """Refuse a file that is no store of this schema; a new, empty one passes where `empty`."""
        found = self._patiently(_WHAT)  # at once: another process may just make it
        mark, names = found[0][0], {row[0] for row in found[1:]}
        if empty and not mark and not names:
            return
        if mark != _APPLICATION or "meta" not in names:
            raise OutputError(
                f"{self.path}: is not a store of `mfhca audit`; give another output folder, or move this file away"
            )
        found = self._patiently("SELECT value FROM meta WHERE name = 'schema'")
        schema = found[0][0] if found else "none"
        if schema != SCHEMA or not names >= _TABLES:
            raise OutputError(
                f"{self.path}: store of schema {schema!r:.40}, {SCHEMA!r} expected; move it away and audit again: results "
                "in the folder results/ are taken over"
            )

    def _add_later(self, connection: sqlite3.Connection) -> None:
        """Add the tables and columns that an earlier version did not know."""
        known = {row[0] for row in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}
        for name in _LATER:
            if name not in known:
                connection.execute(next(s for s in _schema() if f"CREATE TABLE {name} (" in s))
        for table, column, kind in _LATER_COLUMNS:
            if column not in {row[1] for row in connection.execute(f"PRAGMA table_info({table})")}:
                connection.execute(f"ALTER TABLE {table} ADD COLUMN {column} {kind}")

    def has_table(self, name: str) -> bool:
        """Whether the store has a table; one that is only read may be of an earlier version."""
        return bool(self.rows("SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?", (name,)))

    def has_column(self, table: str, column: str) -> bool:
        """Whether a table has a column; a store that is only read may be of an earlier version."""
        return any(row[1] == column for row in self.rows(f"PRAGMA table_info({table})"))

    def _create(self, connection: sqlite3.Connection) -> None:
        for statement in _schema():
            connection.execute(statement)
        connection.execute(f"PRAGMA application_id = {_APPLICATION}")
        rows = [("schema", SCHEMA), ("run", "0"), ("created_by", f"mfhca-replay {__version__}")]
        connection.executemany("INSERT INTO meta VALUES (?, ?)", rows)

    def _patiently(self, statement: str) -> list[sqlite3.Row]:
        """Run a statement which waits for others of its own accord nowhere."""
        end = time.monotonic() + self._patience_s
        while True:
            try:
                return self._connection.execute(statement).fetchall()
            except sqlite3.OperationalError as error:
                if not _busy(error) or time.monotonic() > end:
                    raise
                time.sleep(0.01)

    @contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """Give the connection within one transaction, which counts as a whole or not at all.

        Raises
        ------
        OutputError
            Where the store cannot be written: disk full, damaged, or locked for long.
        """
        with self._lock:
            try:
                self._patiently("BEGIN IMMEDIATE")
                try:
                    yield self._connection
                    self._patiently("COMMIT")
                except BaseException:
                    with suppress(sqlite3.Error):
                        self._connection.execute("ROLLBACK")
                    raise
            except (sqlite3.Error, UnicodeDecodeError) as error:
                raise self.plain(error) from error

    @contextmanager
    def snapshot(self) -> Iterator[None]:
        """Let the queries within it see the store at one moment, whatever others write meanwhile."""
        self.rows("BEGIN")
        try:
            yield
        finally:
            with suppress(sqlite3.Error):
                self._connection.execute("COMMIT")

    def rows(self, query: str, parameters: tuple[object, ...] = ()) -> list[sqlite3.Row]:
        """Rows of a query.

        Raises
        ------
        OutputError
            Where the store cannot be read.
        """
        with self._lock:
            try:
                return self._connection.execute(query, parameters).fetchall()
            except (sqlite3.Error, UnicodeDecodeError) as error:
                raise self.plain(error) from error

    def blocks(self, query: str, size: int) -> Iterator[list[tuple[Any, ...]]]:
        """Rows of a query as plain tuples, so many at once; no list is empty.

        Raises
        ------
        OutputError
            Where the store cannot be read.
        """
        with self._lock:
            try:
                found = self._connection.cursor()
                found.row_factory = None
                found.execute(query)
                while rows := found.fetchmany(size):
                    yield rows
            except (sqlite3.Error, UnicodeDecodeError) as error:
                raise self.plain(error) from error

    @contextmanager
    def decoding(self) -> Iterator[None]:
        """Turn what a row of damaged values leads to into the store's own error.

        Raises
        ------
        OutputError
            Where a value is none that this tool writes.
        """
        try:
            yield
        except (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError, RecursionError) as error:
            text = " ".join(str(error).split())[:120]
            raise OutputError(
                f"{self.path}: is damaged (a row holds what no audit writes: {text}); move it away and audit again: results "
                "in the folder results/ are kept"
            ) from error

    def close(self) -> None:
        """Close the connection; what was written stays."""
        with self._lock:
            self._connection.close()

    def plain(self, error: Exception) -> OutputError:
        """One sentence for an error of SQLite or of the system."""
        text = str(error)
        if isinstance(error, OSError):
            what = f"cannot be written ({error.strerror or error}); give another output folder"
        elif isinstance(error, sqlite3.OperationalError) and _busy(error):
            what = f"was locked by another process for {self._patience_s:.0f} s; end it or wait, then audit again"
        elif isinstance(error, sqlite3.OperationalError) and text.startswith(_FULL):
            free = _free(self.path)
            what = (
                f"cannot be written ({text}{free}); earlier results are kept: make room, then audit again to continue"
            )
        elif isinstance(error, sqlite3.OperationalError) and "readonly" in text:
            what = "cannot be written (read-only); give another output folder"
        elif isinstance(error, sqlite3.DatabaseError | UnicodeDecodeError) and not isinstance(
            error, sqlite3.IntegrityError
        ):
            what = f"is damaged or is not a store ({text}); move it away and audit again: results in the folder results/ are kept"
        else:
            what = f"does not take the row ({text})"
        return OutputError(f"{self.path}: {what}")


@contextmanager
def unless_damaged(path: Path) -> Iterator[None]:
    """Work on what was read from a store: where that fails, and SQLite finds the store damaged, this is the reason.

    Raises
    ------
    OutputError
        Where the work failed and the store is damaged; else the error stays as it is.
    """
    try:
        yield
    except MfhcaError:
        raise
    except Exception as error:
        with closing(Database(path, read_only=True)) as database:
            found = database.rows("PRAGMA integrity_check(1)")[0][0]
            if found != "ok":
                raise database.plain(sqlite3.DatabaseError(str(found)[:120])) from error
        raise


def _schema() -> Iterator[str]:
    return _statements(Path(__file__).with_name("schema.sql").read_text(encoding="utf-8"))


def _statements(script: str) -> Iterator[str]:
    """Statements of a script; `executescript` would end the transaction."""
    held = ""
    for line in script.splitlines(keepends=True):
        held += line
        if sqlite3.complete_statement(held):
            yield held
            held = ""


def _busy(error: sqlite3.OperationalError) -> bool:
    return (getattr(error, "sqlite_errorcode", 0) & 0xFF) in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


def _free(path: Path) -> str:
    try:
        left = os.statvfs(path.parent)
    except (AttributeError, OSError):  # not on Windows
        return ""
    return f", {left.f_bavail * left.f_frsize / 1e6:.0f} MB free"
