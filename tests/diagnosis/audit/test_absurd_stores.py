"""Stores whose rows hold absurd values: a page, or one sentence."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from diagnosis.audit.fleet_files import write_fleet
from diagnosis.audit.store.store import FILE_NAME
from replay.errors import OutputError
from tests import fleet_samples

COLUMNS = (
    ("result", ("attempts", "start_ns", "duration_s", "driving_s", "decided_s", "distance_m", "open_loop")),
    ("fault", ("start_s", "stop_s", "start_ns", "epsilon", "epsilon_low", "sat", "probability")),
    ("component", ("driving_s", "decided_s", "healthy_s", "faulty_s", "epsilon", "epsilon_high", "epsilon_s", "epsilon_relative")),
    ("mission", ("bytes", "seen", "gone")),
)  # fmt: skip
VALUES = ("9223372036854775807", "-9223372036854775808", "1e300", "-1e300", "1e-300", "9e999", "-1", "0", "NULL")
TEXTS = (
    ("result", "machine_id"),
    ("result", "report"),
    ("fault", "component"),
    ("fault", "side"),
    ("fault", "mode"),
    ("component", "side"),
    ("mission", "files"),
)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = fleet_samples.write_store(tmp_path_factory.mktemp("sound") / FILE_NAME, fleet_samples.few()[::6])
    with closing(sqlite3.connect(path)) as link:
        link.execute("pragma journal_mode = delete")
    return path


def written(sound: Path, folder: Path, statement: str) -> str:
    """Change a copy of the store, and make its page; the refusal, or nothing."""
    path = folder / FILE_NAME
    shutil.copyfile(sound, path)
    with closing(sqlite3.connect(path, isolation_level=None)) as link:
        try:
            link.execute(statement)
        except sqlite3.Error:
            return "not a value of the schema"
    try:
        write_fleet(folder, folder)
    except OutputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("table", "columns"), COLUMNS, ids=lambda v: v if isinstance(v, str) else "")
def test_numbers(sound: Path, tmp_path: Path, table: str, columns: tuple[str, ...]) -> None:
    for column in columns:
        for value in VALUES:
            said = written(sound, tmp_path, f"update {table} set {column} = {value} where rowid % 2 = 0")
            assert not said or FILE_NAME in said or "schema" in said, (column, value, said)


@pytest.mark.parametrize(
    "text", ["''", "'\x1b[31m<b>'", "'[1, {}]'", "'[]'", "cast(x'ff' as text)", "'" + "[" * 3000 + "'", "'../../x'"]
)
def test_texts(sound: Path, tmp_path: Path, text: str) -> None:
    for table, column in TEXTS:
        said = written(sound, tmp_path, f"update {table} set {column} = {text} where rowid % 2 = 0")
        assert not said or FILE_NAME in said or "schema" in said, (column, said)
