"""The audit's store: which missions there are, what is known of their files, and how each ended."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.store import records
from diagnosis.audit.store.database import Database
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.objects import Objects, attempt_name, encode
from diagnosis.audit.store.outcome import MissionState, Outcome
from diagnosis.audit.store.reason_template import ReasonTemplate, reason_template
from diagnosis.audit.store.records import FileRecord, MissionRecord, ResultObject
from diagnosis.audit.store.stored import StoredMission, StoredResult, mission_of_row, result_of_row

FILE_NAME = "fleet.sqlite"
RESULTS = "results"
_STORED = "id, log_hash, config_hash, version, state, reason, attempts, machine_id, verdict, start_ns, report, limit_option, limit_value, no_log"
_BY_KEY = "log_hash = ? AND config_hash = ? AND version = ?"


class Store:
    """Opened store; several processes may use one at the same time, and threads may share a `Store`.

    Parameters
    ----------
    path : Path
        SQLite file; its folder is the audit's output folder.
    read_only : bool
        Whether nothing is to be written.
    objects : bool
        Whether each attempt is written as a result object too, in the folder ``results`` beside the store.

    Attributes
    ----------
    run : int
        Number of the last audit that began.
    """

    def __init__(self, path: Path, *, read_only: bool = False, objects: bool = True) -> None:
        self.path = path
        self.folder = path.parent
        self._real = os.path.realpath(self.folder)
        self.database = Database(path, read_only=read_only)
        self._objects = Objects(str(self.folder / RESULTS)) if objects and not read_only else None
        self._reasons: dict[tuple[int, str], ReasonTemplate] = {}
        with self.database.decoding():
            self.run = int(self.database.rows("SELECT value FROM meta WHERE name = 'run'")[0][0])

    @classmethod
    def open(cls, path: Path, *, read_only: bool = False) -> Self:
        """Open a store, or make it.

        Raises
        ------
        OutputError
            Where it is damaged, of another schema, no store, or cannot be written.
        """
        return cls(path, read_only=read_only)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self.database.close()

    def begin_run(self, notes: Sequence[str] = ()) -> int:
        """Count this audit; its number marks the missions that it sees, and its notes replace those of the one before."""
        shown = [n.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace") for n in notes]
        with self.database.transaction() as connection:
            connection.execute("INSERT OR REPLACE INTO meta VALUES ('notes', ?)", (json.dumps(shown),))
            connection.execute("UPDATE meta SET value = CAST(value AS INTEGER) + 1 WHERE name = 'run'")
            with self.database.decoding():
                self.run = int(connection.execute("SELECT value FROM meta WHERE name = 'run'").fetchone()[0])
        return self.run

    def adopt(self, missions: Iterable[MissionSource], roots: Sequence[str] = ()) -> tuple[MissionSource, ...]:
        """Enter discovered missions, and say which known ones are gone.

        Parameters
        ----------
        missions : Iterable[MissionSource]
            From `discover`.
        roots : Sequence[str]
            Folders and URLs that were looked through: a known mission below them that is not among `missions` is gone.

        Returns
        -------
        tuple[MissionSource, ...]
            The same missions under the names they had in earlier runs; a new one whose name is taken gets another. One
            whose files changed has no result until it is audited again.
        """
        from diagnosis.audit.store.adoption import adopt

        given = [(mission, self._files(mission)) for mission in missions]
        with self.database.decoding(), self.database.transaction() as connection:
            names = adopt(connection, given, [self.relative(r) for r in roots], self.run, self._real)
        return tuple(replace(mission, name=name) for (mission, _), name in zip(given, names, strict=True))

    def known_hash(self, path: str, size: int, stamp: str) -> str | None:
        """SHA-256 of a file if it was hashed before and has not changed since."""
        query = "SELECT sha256 FROM file WHERE path = ? AND size = ? AND stamp = ?"
        found = self.database.rows(query, (self.relative(path), size, stamp))
        return found[0][0] if found else None

    def remember_hash(self, path: str, size: int, stamp: str, sha256: str) -> None:
        """Keep a file's SHA-256, so that it need not be read again."""
        with self.database.transaction() as connection:
            row = FileRecord(path=self.relative(path), size=size, stamp=stamp, sha256=sha256)
            records.write_files(connection, [row])

    def lookup(self, key: Key) -> StoredResult | None:
        """Result of a key, whatever its state."""
        query = f"SELECT {_STORED} FROM result WHERE {_BY_KEY}"
        found = self.database.rows(query, (key.log_hash, key.config_hash, key.version))
        with self.database.decoding():
            return result_of_row(found[0]) if found else None

    def record(
        self,
        mission: MissionSource,
        key: Key,
        outcome: Outcome,
        report: str | None,
        attempts: Sequence[Outcome] = (),
        *,
        machine_id: str = "",
        hashes: Sequence[str] = (),
    ) -> None:
        """Keep how an attempt ended; when this returns, it stands on the disk.

        Parameters
        ----------
        mission : MissionSource
            As `adopt` gave it.
        key : Key
            Its key.
        outcome : Outcome
            End of the attempt. A failed one does not replace the result of an earlier one that did not fail.
        report : str or None
            Folder of the report, relative to the store's folder.
        attempts : Sequence[Outcome]
            Earlier attempts of the same go that were not recorded yet, in their order.
        machine_id : str
            Machine where the report names none, or there is no report.
        hashes : Sequence[str]
            SHA-256 of each file, to be remembered; empty: what is known of them stays.

        Raises
        ------
        OutputError
            Where it cannot be written; nothing of it counts then.
        """
        for attempt in (*attempts, outcome):
            self._record(
                {
                    "mission": self._described(mission, hashes),
                    "key": key.record,
                    "made_ns": time.time_ns(),
                    "attempt": records.attempt_record(attempt),
                    "report": report if attempt is outcome else None,
                    "machine_id": machine_id,
                    "summary": attempt.summary,
                },
                key,
            )

    def _record(self, document: ResultObject, key: Key) -> None:
        query = f"SELECT coalesce(max(number), 0) FROM attempt WHERE result IN (SELECT id FROM result WHERE {_BY_KEY})"
        values = (key.log_hash, key.config_hash, key.version)
        number = int(self.database.rows(query, values)[0][0]) + 1
        if self._objects is not None:
            number = self._objects.put_attempt(key.stem, document, number)
        with self.database.transaction() as connection:
            if self._objects is None:
                number = int(connection.execute(query, values).fetchone()[0]) + 1
            numbered = records.with_number(document, number)
            records.write_document(connection, numbered, self.run)

    def reuse(self, mission: MissionSource, result: StoredResult) -> None:
        """Let a mission point to a result that is there already: of an earlier run, or of a copy.

        Raises
        ------
        OutputError
            Where it cannot be written.
        """
        described = self._described(mission)
        row = (mission.name, result.id, records.names_of(described["files"]))
        same = "SELECT 1 FROM mission WHERE name = ? AND result = ? AND files = ? AND gone IS NULL"
        if self.database.rows(same, row):
            return
        document: ResultObject = {"schema": records.SCHEMA, "mission": described, "key": result.key.record}
        mark = hashlib.sha256(encode(document)).hexdigest()[:8]
        document["made_ns"] = time.time_ns()
        if self._objects is not None:
            self._objects.put(f"{result.key.stem}-m{mark}.json", encode(document))
        with self.database.transaction() as connection:
            records.write_document(connection, document, self.run)

    def forget(self, names: Sequence[str]) -> None:
        """Leave missions out; their results stay, and a mission that is found again is entered again.

        Raises
        ------
        OutputError
            Where it cannot be written.
        """
        with self.database.transaction() as connection:
            connection.executemany("DELETE FROM mission WHERE name = ? AND gone IS NOT NULL", [(n,) for n in names])

    def reason_for(self, result: int, reason: str, files: Sequence[str]) -> str:
        """Reason of a result for one of the missions that share it: it names that mission's files, not its copies'."""
        if (result, reason) not in self._reasons:
            rows = self.database.rows("SELECT files FROM mission WHERE result = ?", (result,))
            with self.database.decoding():
                self._reasons[result, reason] = reason_template(
                    reason, (json.loads(row[0]) for row in rows), self._real
                )
        return self._reasons[result, reason].for_files(files)

    def missions(self) -> list[StoredMission]:
        """All missions in the order of their names, those that are gone too."""
        query = (
            "SELECT m.name, m.files, m.bytes, m.seen, m.gone, r.* FROM mission m LEFT JOIN result r ON r.id = m.result "
            "ORDER BY m.name"
        )
        rows = self.database.rows(query)
        with self.database.decoding():
            return [mission_of_row(row) for row in rows]

    def missions_of(self, machine_id: str) -> list[StoredMission]:
        """Missions of one machine in the order of the log's clock; copies once, under their first name."""
        query = (
            "SELECT min(m.name) AS name, m.files, m.bytes, m.seen, m.gone, r.* FROM result r JOIN mission m "
            "ON m.result = r.id AND m.gone IS NULL WHERE r.machine_id = ? GROUP BY r.id "
            "ORDER BY r.start_ns IS NULL, r.start_ns, 1"
        )
        rows = self.database.rows(query, (machine_id,))
        with self.database.decoding():
            return [mission_of_row(row) for row in rows]

    def counts(self, run: int | None = None) -> dict[MissionState, int]:
        """Number of missions per state, of those that are there and were seen in or after a run (None: in any)."""
        query = (
            "SELECT r.state, count(*) FROM mission m JOIN result r ON r.id = m.result "
            "WHERE m.gone IS NULL AND m.seen >= ? GROUP BY 1 ORDER BY 1"
        )
        rows = self.database.rows(query, (run or 0,))
        with self.database.decoding():
            return {MissionState(row[0]): row[1] for row in rows}

    def object_names(self) -> set[str]:
        """Names of the result objects of all recorded attempts."""
        query = "SELECT log_hash, config_hash, version, number FROM attempt JOIN result ON id = result"
        rows = self.database.rows(query)
        with self.database.decoding():
            return {attempt_name(Key(*row[:3]).stem, row[3]) for row in map(tuple, rows)}

    def relative(self, path: str) -> str:
        """Path as the store holds it: relative to its folder, so that both may move together; URLs stay."""
        if "://" in path:
            return path
        real = os.path.realpath(path)
        try:
            shown = Path(os.path.relpath(real, self._real)).as_posix()
        except ValueError:  # another drive
            shown = Path(real).as_posix()
        return shown.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")

    def _files(self, mission: MissionSource) -> list[FileRecord]:
        sizes = mission.sizes or (mission.bytes,) * len(mission.files)
        return [
            {"path": self.relative(path), "size": size, "stamp": stamp}
            for path, size, stamp in zip(mission.files, sizes, mission.stamps, strict=True)
        ]

    def _described(self, mission: MissionSource, hashes: Sequence[str] = ()) -> MissionRecord:
        files = self._files(mission)
        known: Sequence[str | None] = hashes or [
            self.known_hash(f, t["size"], t["stamp"]) for f, t in zip(mission.files, files, strict=True)
        ]
        for file, sha256 in zip(files, known, strict=True):
            file["sha256"] = sha256
        return {"name": mission.name, "files": files, "bytes": mission.bytes}
