"""Parts in columns say the same as the store's rows, in whatever order those stand, and refuse what no audit writes."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from diagnosis.audit.fleet.parts import NO_PARTS, columns_of, read_parts
from diagnosis.audit.fleet.read import read_missions
from diagnosis.audit.store.database import Database
from replay.errors import OutputError
from tests import fleet_samples as samples
from tests.fleet_samples import Sample, bounds

VALVE, PICKUP = ("RL", "actuator"), ("front", "sensor")


def stored(path: Path) -> Path:
    return samples.write_store(
        path / "fleet.sqlite",
        [
            Sample("a", epsilon={VALVE: bounds(0.1)}, blind=[PICKUP]),
            Sample("b", epsilon={VALVE: bounds(0.2)}, parts=[VALVE, ("RR", "sensor")]),
            Sample("c", state="unreadable", reason="c.mcap: ends after 12 bytes."),
        ],
    )


def test_each_part_has_a_row_in_each_mission_that_has_it(tmp_path: Path) -> None:
    results = [m.result for m in read_missions(stored(tmp_path)) if m.result is not None]
    table, columns = columns_of([r.parts for r in results])
    assert tuple(columns) == samples.PARTS
    assert (columns[VALVE] >= 0).tolist() == [True, True, False]
    assert (columns[PICKUP] >= 0).tolist() == [True, False, False]
    assert table.value[columns[VALVE][:2]].tolist() == [0.1, 0.2]
    assert np.isnan(table.value[columns[PICKUP][:1]]).all()
    assert table.assessed(columns[VALVE], 10.0).tolist() == [True, True, False]
    assert table.assessed(columns[PICKUP], 10.0).tolist() == [False, False, False]
    assert table.assessed(columns[VALVE], 1e6).tolist() == [False, False, False]


def test_missions_without_any_part_have_no_columns() -> None:
    assert columns_of([])[1] == {}
    assert columns_of([NO_PARTS, NO_PARTS])[1] == {}


def test_the_order_of_the_rows_does_not_count(tmp_path: Path) -> None:
    path = stored(tmp_path)
    with closing(Database(path, read_only=True)) as db:
        before = {k: p.rows() for k, p in read_parts(db).items()}
    with closing(sqlite3.connect(path)) as db, db:
        rows = db.execute("SELECT * FROM component ORDER BY side, component, result").fetchall()
        db.execute("DELETE FROM component")
        db.executemany(f"INSERT INTO component VALUES ({','.join('?' * len(rows[0]))})", rows)
    with closing(Database(path, read_only=True)) as db:
        found = read_parts(db)
    assert {k: set(p.rows()) for k, p in found.items()} == {k: set(rows) for k, rows in before.items()}
    assert [float(p.table.value[p.rows()[VALVE]]) for p in found.values()] == [0.1, 0.2]


@pytest.mark.parametrize(
    "what", ["epsilon = 1e7", "epsilon_low = -9e999", "driving_s = 1e16", "decided_s = 9e999", "side = 'both'"]
)
def test_what_no_audit_writes_is_damage(tmp_path: Path, what: str) -> None:
    path = stored(tmp_path)
    with closing(sqlite3.connect(path)) as db, db:
        db.execute(f"UPDATE component SET {what} WHERE result = 2 AND component = 'RR'")
    with pytest.raises(OutputError, match="is damaged"):
        read_missions(path)


@pytest.mark.parametrize("value", ["'fast'", "NULL", "x'00'"])
def test_a_text_in_the_place_of_a_number_is_damage(tmp_path: Path, value: str) -> None:
    path = stored(tmp_path)
    with closing(sqlite3.connect(path)) as db, db:  # what flipped bytes make of a strict table
        db.execute("CREATE TABLE loose AS SELECT * FROM component")
        db.execute("DROP TABLE component")
        db.execute("ALTER TABLE loose RENAME TO component")
        db.execute(f"UPDATE component SET driving_s = {value} WHERE result = 2 AND component = 'RR'")
    with pytest.raises(OutputError, match="is damaged"):
        read_missions(path)


def test_a_file_whose_name_is_no_unicode_is_read(tmp_path: Path) -> None:
    path = stored(tmp_path)
    with closing(sqlite3.connect(path)) as db, db:
        db.execute(r"""UPDATE mission SET files = '["logs/\udce9.mcap"]' WHERE name = 'a'""")
    assert read_missions(path)[0].files == ("logs/\udce9.mcap",)
