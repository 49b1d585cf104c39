from __future__ import annotations

import errno
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.outcome import Outcome
from diagnosis.audit.store.store import Store
from diagnosis.audit.store.summary import summarise
from replay.errors import OutputError

Report = Callable[..., dict[str, Any]]
Missions = Callable[..., MissionSource]
Keys = Callable[..., Key]
ROOT = Path(__file__).resolve().parents[4]

# records missions n, n + step, … and says which are recorded
WRITER = """
import hashlib, sys
from pathlib import Path
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.outcome import Outcome
from diagnosis.audit.store.store import Store

first, step, count, path = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4])
rows = {"result": {"machine_id": "H"}, "components": [], "faults": [
    dict(id=f"F{i}", component="FR", kind="wheel", side="sensor", mode="stuck", severity="high", start_s=1.0, stop_s=2.0,
         start_ns=1, epsilon=None, epsilon_low=None, epsilon_high=None, sat=None, sat_unit=None, probability=0.9)
    for i in range(20)]}
with Store.open(path) as store:
    store.begin_run()
    for n in range(first, count, step):
        mission = MissionSource(f"m{n}", (f"m{n}.mcap",), 1, ("1",), sizes=(1,))
        sha256 = hashlib.sha256(str(n).encode()).hexdigest()
        store.remember_hash(mission.files[0], 1, "1", sha256)
        store.record(mission, Key(sha256, "c" * 64, "1"), Outcome("ok", summary=rows), f"missions/m{n}")
        print(n, flush=True)
"""


def start(first: int, step: int, count: int, path: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-c", WRITER, str(first), str(step), str(count), str(path)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "audit" / "fleet.sqlite"


def test_a_mission_from_discovery_to_result(
    path: Path, make_mission: Missions, make_key: Keys, make_report: Report
) -> None:
    key = make_key("a")
    with Store.open(path) as store:
        assert store.begin_run() == 1
        (mission,) = store.adopt([make_mission("m1")])
        assert store.missions()[0].result is None
        assert store.lookup(key) is None
        store.record(mission, key, Outcome("ok", summary=summarise(make_report())), "missions/m1", hashes=["ab" * 32])
    with Store.open(path, read_only=True) as store:
        found = store.lookup(key)
        assert found is not None
        assert (found.state, found.attempts, found.machine_id, found.verdict) == ("ok", 1, "H-07", "watch")
        assert store.known_hash(mission.files[0], mission.bytes, mission.stamps[0]) == "ab" * 32
        assert store.known_hash(mission.files[0], mission.bytes, "later") is None
        (known,) = store.missions()
        assert known.files == ("../logs/m1.mcap",)
        assert known.result == found
        assert store.counts() == {"ok": 1}
        assert len(store.database.rows("SELECT * FROM fault")) == 1
        assert len(store.database.rows("SELECT * FROM component")) == 4
        with pytest.raises(OutputError, match="read-only"):
            store.begin_run()


def test_every_try_is_a_row_and_a_failed_one_does_not_replace_a_result(
    path: Path, make_mission: Missions, make_key: Keys, make_report: Report
) -> None:
    key, summary = make_key("a"), summarise(make_report())
    with Store.open(path) as store:
        (mission,) = store.adopt([make_mission("m1")])
        earlier = [Outcome("timeout", "stopped after 60 s", 60.0), Outcome("crashed", "signal 9")]
        store.record(mission, key, Outcome("out_of_memory", "more than 2 GB"), None, earlier, machine_id="H-07")
        found = store.lookup(key)
        assert found is not None
        assert (found.state, found.reason, found.attempts, found.verdict, found.machine_id) == (
            "out_of_memory", "more than 2 GB", 3, None, "H-07",
        )  # fmt: skip
        store.record(mission, key, Outcome("ok", summary=summary), "missions/m1")
        store.record(mission, key, Outcome("crashed", "signal 11"), None)
        found = store.lookup(key)
        assert found is not None
        assert (found.state, found.attempts, found.report) == ("ok", 5, "missions/m1")
        assert len(store.database.rows("SELECT * FROM fault")) == 1
        states = [row["state"] for row in store.database.rows("SELECT state FROM attempt ORDER BY number")]
        assert states == ["timeout", "crashed", "out_of_memory", "ok", "crashed"]
        degraded = Outcome("degraded", "1 chunk lost", summary={**summary, "faults": []})
        store.record(mission, key, degraded, "missions/m1")
        assert store.database.rows("SELECT * FROM fault") == []
        assert store.counts() == {"degraded": 1}


def test_keys_that_begin_alike_have_objects_of_their_own(path: Path, make_mission: Missions) -> None:
    with Store.open(path) as store:
        for mission, last in zip(store.adopt([make_mission("m1"), make_mission("m2")]), "ab", strict=True):
            store.record(mission, Key("0" * 63 + last, "c" * 64, "1"), Outcome("crashed", "signal 9"), None)
        assert store.counts() == {"crashed": 2}
        assert store.object_names() == {"00000000-cccccccc-1-1.json", "00000000-cccccccc-1-2.json"}


def test_copies_share_a_result_and_count_as_missions(
    path: Path, make_mission: Missions, make_key: Keys, make_report: Report
) -> None:
    key = make_key("a")
    with Store.open(path) as store:
        one, two = store.adopt([make_mission("m1"), make_mission("m2")])
        store.record(one, key, Outcome("ok", summary=summarise(make_report())), "missions/m1")
        stored = store.lookup(key)
        assert stored is not None
        store.reuse(two, stored)
        store.reuse(two, stored)
        assert [m.result for m in store.missions()] == [stored, stored]
        assert store.counts() == {"ok": 2}
        assert [m.name for m in store.missions_of("H-07")] == ["m1"]


def test_missions_of_a_machine_stand_in_the_order_of_the_log_clock(
    path: Path, make_mission: Missions, make_key: Keys, make_report: Report
) -> None:
    with Store.open(path) as store:
        starts = {"m1": 3 * 10**18, "m2": 10**18, "m3": 2 * 10**18, "m4": 10**18}
        for mission in store.adopt([make_mission(name) for name in starts]):
            report = make_report(starts[mission.name], machine_id="other" if mission.name == "m4" else "H-07")
            store.record(mission, make_key(mission.name), Outcome("ok", summary=summarise(report)), None)
        (failed,) = store.adopt([make_mission("m5")])
        store.record(failed, make_key("m5"), Outcome("crashed", "signal 9"), None, machine_id="H-07")
        assert [m.name for m in store.missions_of("H-07")] == ["m2", "m3", "m1", "m5"]


def test_missions_keep_their_names_and_others_get_free_ones(path: Path, make_mission: Missions, tmp_path: Path) -> None:
    with Store.open(path) as store:
        (mission,) = store.adopt([make_mission("m1")])
        (again,) = store.adopt([replace(mission, name="logs__m1")])
        assert again.name == "m1"
        other = tmp_path / "tuesday.mcap"
        other.write_bytes(b"x")
        (new,) = store.adopt([replace(mission, name="M1", files=(str(other),))])
        assert new.name.startswith("M1-")
        assert [m.name for m in store.missions()] == [new.name, "m1"]


def test_changed_and_removed_missions(path: Path, make_mission: Missions, make_key: Keys, make_report: Report) -> None:
    summary = summarise(make_report())
    with Store.open(path) as store:
        store.begin_run()
        given = [make_mission(f"m{i}") for i in range(3)]
        roots = [str(Path(given[0].files[0]).parent)]
        for mission in store.adopt(given, roots):
            store.remember_hash(mission.files[0], mission.bytes, mission.stamps[0], mission.name)
            store.record(mission, make_key(mission.name), Outcome("ok", summary=summary), None)
        run = store.begin_run()
        changed = replace(make_mission("m1", b"longer"), stamps=("9",))
        store.adopt([given[0], changed], roots)
        state = {m.name: (m.result is not None, m.gone, m.seen) for m in store.missions()}
        assert state == {"m0": (True, False, run), "m1": (False, False, run), "m2": (True, True, run - 1)}
        assert store.counts() == {"ok": 1}
        store.begin_run()
        store.adopt([], [roots[0] + "/elsewhere"])  # not where the missions are: nothing is known of them
        assert [m.gone for m in store.missions()] == [False, False, True]
        store.adopt(given, roots)
        assert [m.gone for m in store.missions()] == [False, False, False]
        assert store.counts(store.begin_run()) == {}


def test_logs_and_results_may_move_together(path: Path, make_mission: Missions, tmp_path: Path) -> None:
    mission = make_mission("m1")
    with Store.open(path) as store:
        store.remember_hash(mission.files[0], 3, "1", "aa")
    moved = tmp_path.with_name(f"{tmp_path.name}-moved")
    tmp_path.rename(moved)
    with Store.open(moved / "audit" / "fleet.sqlite") as store:
        assert store.known_hash(str(moved / "logs" / "m1.mcap"), 3, "1") == "aa"
        assert store.relative("s3://fleet/m.mcap") == "s3://fleet/m.mcap"
        assert store.relative(str(moved / "a\udcff.mcap")) == "../a\\xff.mcap"


@pytest.mark.parametrize("name", ["a b#?%20", "line\nbreak", "ü"])
def test_folder_names(tmp_path: Path, name: str) -> None:
    path = tmp_path / name / "fleet.sqlite"
    with Store.open(path) as store:
        assert store.begin_run() == 1
    with Store.open(path, read_only=True) as store:
        assert store.missions() == []


def test_four_processes_record_side_by_side(path: Path) -> None:
    writers = [start(i % 2, 2, 24, path) for i in range(4)]  # two at each mission
    for writer in writers:
        out, err = writer.communicate(timeout=60)
        assert writer.returncode == 0, err.decode()
        assert len(out.split()) == 12
    with Store.open(path) as store:
        assert store.counts() == {"ok": 24}
        assert len(store.database.rows("SELECT * FROM attempt")) == 48
        assert len(store.database.rows("SELECT * FROM fault")) == 24 * 20
        assert {m.result.attempts for m in store.missions() if m.result} == {2}
        assert store.run == 4
        assert store.object_names() == {p.name for p in (path.parent / "results").iterdir()}


def test_nothing_acknowledged_is_lost_by_a_kill(path: Path) -> None:
    told: set[int] = set()
    for k in range(4):
        writer = start(k, 1, 10_000, path)
        assert writer.stdout is not None
        for _ in range(3 + 5 * k):
            told.add(int(writer.stdout.readline()))
        writer.send_signal(signal.SIGKILL)
        writer.communicate(timeout=10)
        with Store.open(path) as store:
            assert store.database.rows("PRAGMA integrity_check")[0][0] == "ok"
            found = {int(m.name[1:]) for m in store.missions()}
            assert told <= found
            faults = store.database.rows("SELECT count(*) FROM fault GROUP BY result")
            assert {row[0] for row in faults} == {20}
            assert len(faults) == len(found)


def test_disk_full_costs_one_record_and_nothing_before(
    path: Path, make_mission: Missions, make_key: Keys, make_report: Report
) -> None:
    summary = summarise(make_report())
    big = Outcome("ok", summary={**summary, "result": {**summary["result"], "title": "x" * 200_000}})
    with Store(path, objects=False) as store:
        one, two = store.adopt([make_mission("m1"), make_mission("m2")])
        store.record(one, make_key("a"), Outcome("ok", summary=summary), None)
        pages = store.database.rows("PRAGMA page_count")[0][0]
        store.database.rows(f"PRAGMA max_page_count = {pages + 8}")
        with pytest.raises(OutputError, match=r"fleet.sqlite: cannot be written \(database or disk is full.*are kept"):
            store.record(two, make_key("b"), big, None)
        assert store.lookup(make_key("b")) is None
        assert store.counts() == {"ok": 1}
        store.database.rows("PRAGMA max_page_count = 100000")
        store.record(two, make_key("b"), big, None)
    with Store.open(path) as store:
        assert store.counts() == {"ok": 2}
        assert store.database.rows("PRAGMA integrity_check")[0][0] == "ok"


def test_no_room_for_files(path: Path, make_mission: Missions, make_key: Keys) -> None:
    """RLIMIT_FSIZE as a stand-in for a full disk: writes beyond it fail within SQLite and for result objects."""
    script = WRITER.replace(
        "with Store.open",
        "import resource, signal\nsignal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))\nwith Store.open",
    )
    command = [sys.executable, "-c", script, "0", "1", "10000", str(path)]
    ended = subprocess.run(command, capture_output=True, cwd=ROOT, text=True, timeout=60, check=False)
    assert "OutputError" in ended.stderr
    assert "earlier results are kept" in ended.stderr
    told = {int(n) for n in ended.stdout.split()}
    assert told
    with Store.open(path) as store:
        assert store.database.rows("PRAGMA integrity_check")[0][0] == "ok"
        assert told <= {int(m.name[1:]) for m in store.missions()}


def test_a_result_object_without_room_leaves_nothing(
    path: Path, make_mission: Missions, make_key: Keys, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with Store.open(path) as store:
        (mission,) = store.adopt([make_mission("m1")])
        monkeypatch.setattr("os.fsync", full)
        with pytest.raises(OutputError, match=r"No space left on device.*are kept"):
            store.record(mission, make_key("a"), Outcome("crashed", "signal 9"), None)
        assert store.lookup(make_key("a")) is None
    assert list((path.parent / "results").iterdir()) == []


def test_files_that_are_no_store(tmp_path: Path) -> None:
    path = tmp_path / "fleet.sqlite"
    path.write_bytes(b"no database at all, but long enough to look at" * 40)
    with pytest.raises(OutputError, match="is damaged or is not a store"):
        Store.open(path)
    path.unlink()
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE photos (id INTEGER)")
    other.close()
    with pytest.raises(OutputError, match="is not a store of `mfhca audit`"):
        Store.open(path)
    with pytest.raises(OutputError, match="there is no store"):
        Store.open(tmp_path / "none.sqlite", read_only=True)
    with pytest.raises(OutputError, match="cannot be written"):
        Store.open(path / "below" / "fleet.sqlite")


def test_store_of_another_schema(path: Path) -> None:
    with Store.open(path) as store:
        store.database.rows("UPDATE meta SET value = '99' WHERE name = 'schema'")
    with pytest.raises(OutputError, match=r"store of schema '99', '2' expected.*results/ are taken over"):
        Store.open(path)


def test_damaged_store(path: Path, make_mission: Missions) -> None:
    with Store.open(path) as store:
        store.adopt([make_mission(f"m{i}") for i in range(200)])
        store.database.rows("PRAGMA wal_checkpoint(TRUNCATE)")
    raw = bytearray(path.read_bytes())
    raw[4096:] = b"\xa5" * (len(raw) - 4096)
    path.write_bytes(raw)
    with pytest.raises(OutputError, match=r"is damaged or is not a store .*move it away"), Store.open(path) as store:
        store.missions()


def test_a_store_locked_for_long(path: Path) -> None:
    from diagnosis.audit.store.database import Database

    with Store.open(path):
        blocker = sqlite3.connect(path, isolation_level=None)
        blocker.execute("BEGIN IMMEDIATE")
        with pytest.raises(OutputError, match="was locked by another process"):
            Database(path, patience_s=0.0)
        blocker.execute("ROLLBACK")
        blocker.close()
        Database(path, patience_s=0.0).close()
