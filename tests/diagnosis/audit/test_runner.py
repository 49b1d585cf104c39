from __future__ import annotations

import json
import threading
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from diagnosis.audit import engines
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.discovery.staging import Staged
from diagnosis.audit.endings import Ending, command, exit_code, quoted
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.plan import Planned
from diagnosis.audit.session import audit, overview
from diagnosis.audit.store.folders import publish, run_folders
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.locks import lock_mission
from diagnosis.audit.store.store import Store
from diagnosis.audit.task import named
from replay.errors import OutputError
from replay.machine.config import haulotte
from tests.diagnosis.audit.samples import COLD, asked_for, missions, run


def test_a_bad_mission_costs_no_other_one_and_a_second_run_does_nothing(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine-1", "raise", "broken", "damaged", "fine-2")
    asked = asked_for(tmp_path / "out")
    ends, _ = run(found, asked)
    assert {n: e.state for n, e in ends.items()} == {
        "fine-1": "ok", "raise": "crashed", "broken": "unreadable", "damaged": "degraded", "fine-2": "ok",
    }  # fmt: skip
    assert (tmp_path / "out" / "missions" / "fine-2" / "report.json").is_file()
    assert sorted(p.name for p in (tmp_path / "out" / ".work").iterdir()) == ["claims"]
    failures = (tmp_path / "out" / "failures.txt").read_text(encoding="utf-8")
    assert "broken: unreadable: x.bag ends at byte 12\n  mfhca diagnose -v " in failures
    assert failures.count("mfhca diagnose") == 2
    again, events = run(found, asked)
    assert again == ends
    assert {kind for kind, _ in events} == {"skipped"}


def test_only_what_changed_is_audited_again(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine-1", "fine-2")
    asked = asked_for(tmp_path / "out")
    run(found, asked)
    (tmp_path / "logs" / "fine-2.bag").write_text("fine, changed", encoding="utf-8")
    changed = missions(tmp_path / "logs", "fine-1", "fine-2")
    assert [state for _, state in overview(changed, asked)] == ["ok", "to do"]
    _, events = run(changed, asked)
    assert events == [("skipped", "fine-1"), ("mission", "fine-2")]
    _, events = run(changed, asked_for(tmp_path / "out", resume=False))
    assert sorted(events) == [("mission", "fine-1"), ("mission", "fine-2")]


def test_a_report_that_another_configuration_has_replaced_is_made_again(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine-1")
    for name in ("A", "B", "A"):
        asked = asked_for(tmp_path / "out", machine_id=name)
        assert [state for _, state in overview(found, asked)] == ["to do"]
        ends, events = run(found, asked)
        assert (events, ends["fine-1"].report) == ([("mission", "fine-1")], "missions/fine-1")
    assert [state for _, state in overview(found, asked)] == ["ok"]


def test_attempts_are_counted_and_more_retries_go_on(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "leave", "once", "broken")
    ends, events = run(found, asked_for(tmp_path / "out", retries=1))
    assert [(n, e.state, e.attempts) for n, e in sorted(ends.items())] == [
        ("broken", "unreadable", 1), ("leave", "crashed", 2), ("once", "ok", 2),
    ]  # fmt: skip
    assert Counter(kind for kind, _ in events) == {"mission": 3, "retry": 2}
    _, events = run(found, asked_for(tmp_path / "out", retries=1))
    assert {kind for kind, _ in events} == {"skipped"}
    ends, events = run(found, asked_for(tmp_path / "out", retries=2))
    assert ends["leave"].attempts == 3
    assert [kind for kind, name in events if name == "leave"] == ["mission"]


def test_a_failed_audit_of_a_changed_log_leaves_the_earlier_report(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine-1")
    run(found, asked_for(tmp_path / "out"))
    before = (tmp_path / "out" / "missions" / "fine-1" / "report.json").read_bytes()
    (tmp_path / "logs" / "fine-1.bag").write_text("kill", encoding="utf-8")
    ends, _ = run(missions(tmp_path / "logs", "fine-1"), asked_for(tmp_path / "out"))
    assert (ends["fine-1"].state, ends["fine-1"].report) == ("unreadable", None)
    assert (tmp_path / "out" / "missions" / "fine-1" / "report.json").read_bytes() == before


def test_a_log_changed_while_it_is_read_has_no_report(tmp_path: Path) -> None:
    ends, _ = run(missions(tmp_path / "logs", "changed"), asked_for(tmp_path / "out"))
    assert ends["changed"].state == "unreadable"
    assert "was changed or removed while it was read" in ends["changed"].reason
    assert not (tmp_path / "out" / "missions" / "changed").exists()


@pytest.mark.parametrize("work", ["touched", "away", "dropped"])
def test_what_kept_a_log_from_being_read_counts_in_that_audit_alone(tmp_path: Path, work: str) -> None:
    asked, states = asked_for(tmp_path / "out"), []
    for _ in range(3):
        ends, events = run(missions(tmp_path / "logs", work), asked)
        states.append((ends[work].state, events[0][0]))
    assert states == [("unreadable", "mission"), ("ok", "mission"), ("ok", "skipped")]


def test_a_log_that_is_gone_is_unreadable(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine-1")
    (tmp_path / "logs" / "fine-1.bag").unlink()
    ends, _ = run(found, asked_for(tmp_path / "out"))
    assert ends["fine-1"].state == "unreadable"


def test_a_report_without_room_ends_the_audit_and_keeps_what_is_done(tmp_path: Path) -> None:
    run(missions(tmp_path / "logs", "fine-1"), asked_for(tmp_path / "out"))
    found = missions(tmp_path / "logs", "fine-1", "unwritten", "fine-2")
    with pytest.raises(OutputError, match="No space left on device"):
        run(found, asked_for(tmp_path / "out"))
    assert (tmp_path / "out" / "missions" / "fine-1" / "report.json").is_file()
    assert [p.name for p in (tmp_path / "out" / ".work").iterdir()] == ["claims"]
    with Store.open(tmp_path / "out" / "fleet.sqlite") as store:
        assert store.counts()["ok"] >= 1


def test_two_audits_of_one_folder_share_the_work(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", *(f"slow-{i}" for i in range(6)))
    results: list[tuple[dict[str, Ending], list[tuple[str, str]]]] = []
    threads = [
        threading.Thread(target=lambda: results.append(run(found, asked_for(tmp_path / "out"), jobs=1)))
        for _ in range(2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    done = [name for _, events in results for kind, name in events if kind == "mission"]
    assert sorted(done) == sorted(m.name for m in found.missions)
    assert all(e.state == "ok" and e.attempts == 1 for ends, _ in results for e in ends.values())


def test_a_claim_is_for_one(tmp_path: Path) -> None:
    first = lock_mission(tmp_path, "a")
    assert first is not None
    assert lock_mission(tmp_path, "a") is None
    other = lock_mission(tmp_path, "b")
    assert other is not None
    first.release()
    again = lock_mission(tmp_path, "a")
    assert again is not None
    other.release()
    again.release()


def test_a_report_takes_the_place_of_an_earlier_one(tmp_path: Path) -> None:
    for text in ("first", "second"):
        made = tmp_path / "made"
        made.mkdir(exist_ok=True)
        (made / "report.json").write_text(text, encoding="utf-8")
        publish(made, tmp_path / "missions" / "a", Key("1", "2", "3"))
        assert (tmp_path / "missions" / "a" / "report.json").read_text(encoding="utf-8") == text


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path: Path) -> None:
    left = tmp_path / ".work" / "1-abc"
    left.mkdir(parents=True)
    (tmp_path / ".work" / "1-abc.lock").touch()
    with run_folders(tmp_path) as place:
        assert not left.exists()
        with run_folders(tmp_path) as beside:  # one at work is left alone
            assert place.folder.is_dir()
            assert beside.folder != place.folder
    assert not place.temporary.exists()


def test_read_only_output_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file", encoding="utf-8")
    with pytest.raises(OutputError, match="out"):
        run(missions(tmp_path / "logs", "fine-1"), asked_for(tmp_path / "out"))


def ending(state: str, verdict: str | None = None, severity: str = "") -> Ending:
    return Ending("m", state, "", 1, "M1", "", verdict, "", None, int(bool(severity)), severity)


@pytest.mark.parametrize(
    ("ends", "fail_on", "code"),
    [
        ([], "low", 0),
        ([ending("ok", "ready")], "low", 0),
        ([ending("ok", "watch", "low"), ending("ok", "ready")], "low", 1),
        ([ending("ok", "watch", "low")], "high", 0),
        ([ending("ok", "stop", "high"), ending("degraded", "not_assessed")], "low", 3),
        ([ending("degraded", "not_assessed"), ending("ok", "stop", "high")], "never", 0),
        ([ending("timeout")], "never", 3),
        ([ending("unreadable"), ending("crashed")], "low", 70),
    ],
)
def test_the_exit_code_is_that_of_the_worst_mission(ends: list[Ending], fail_on: str, code: int) -> None:
    assert exit_code(ends, fail_on) == code


@pytest.mark.parametrize(
    ("files", "start"),
    [
        (("/logs/a b.bag", "/logs/plc.csv"), "mfhca diagnose -v '/logs/a b.bag' /logs/plc.csv -o m-report"),
        (("s3://fleet/a.bag",), "mfhca audit -v s3://fleet/a.bag -o m-report"),
        (("/logs/a_0.bag", "/logs/a_1.bag"), "mfhca audit -v /logs/a_0.bag /logs/a_1.bag -o m-report"),
        (("/logs/a_0.bag",), "mfhca diagnose -v /logs/a_0.bag -o m-report"),
    ],
)
def test_a_failure_has_the_command_that_shows_it_again(files: tuple[str, ...], start: str) -> None:
    mission = MissionSource("m", files, 1, ("1",) * len(files))
    assert command(Planned(mission, haulotte(), "", "", ""), None) == start


@pytest.mark.parametrize(
    ("word", "shown"),
    [
        ("a b.bag", "'a b.bag'"),
        ("it's", "'it'\"'\"'s'"),
        ("a\nb'", r"$'a\x0ab\x27'"),
        ("\udcff", r"$'\xff'"),
        ("a\u202eb", r"$'a\xe2\x80\xaeb'"),
    ],
)
def test_words_are_quoted_for_a_shell(word: str, shown: str) -> None:
    assert quoted(word) == shown


def test_a_lost_store_is_made_again_from_the_result_objects(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine-1", "broken")
    before, _ = run(found, asked_for(tmp_path / "out"))
    for file in (tmp_path / "out").glob("fleet.sqlite*"):
        file.unlink()
    after, events = run(found, asked_for(tmp_path / "out"))
    assert after == before
    assert {kind for kind, _ in events} == {"skipped"}


def test_a_page_that_fails_on_the_way_costs_no_mission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tries = []

    def write_fleet(*_: object, **__: object) -> object:
        tries.append(1)
        if len(tries) == 1:
            raise KeyError("machine")
        return SimpleNamespace(html=tmp_path)

    monkeypatch.setattr("diagnosis.audit.fleet_page.PAGE_S", 0.0)
    monkeypatch.setattr("diagnosis.audit.fleet_files.write_fleet", write_fleet)
    ends, _ = run(missions(tmp_path / "logs", "fine-1", "fine-2"), asked_for(tmp_path / "out"))
    assert [e.state for e in ends.values()] == ["ok", "ok"]
    assert len(tries) > 1


def test_a_reason_names_the_log_and_not_its_copy(tmp_path: Path) -> None:
    mission = missions(tmp_path / "logs", "fine-1").missions[0]
    copy = tmp_path / "tmp" / "files" / "0" / "x.bag"
    there = replace(mission, files=("s3://fleet/x.bag",))
    assert named(f"{copy}: ends at byte 12", Staged((copy,), ("",)), there, tmp_path / "tmp") == (
        "s3://fleet/x.bag: ends at byte 12"
    )


def test_a_larger_limit_tries_again_what_met_it(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "hang", "exhaust")
    tight = Limits(memory_mb=150, wall_s=2.0, file_mb=20)
    ends, _ = run(found, asked_for(tmp_path / "out", limits=tight))
    assert {n: e.state for n, e in ends.items()} == {"exhaust": "out_of_memory", "hang": "timeout"}
    failures = (tmp_path / "out" / "failures.txt").read_text(encoding="utf-8")
    for log, words in (("hang", "--timeout 4"), ("exhaust", "--memory 300")):
        assert f"mfhca audit {tmp_path}/logs/{log}.bag --no-resume {words} -o {tmp_path}/out\n" in failures
    _, events = run(found, asked_for(tmp_path / "out", limits=replace(tight, memory_mb=151)))
    assert {kind for kind, _ in events} == {"skipped"}
    _, events = run(found, asked_for(tmp_path / "out", limits=replace(tight, wall_s=2.1)))
    assert sorted(events) == [("mission", "hang"), ("skipped", "exhaust")]
    ends, events = run(found, asked_for(tmp_path / "out", limits=replace(tight, memory_mb=170)))
    assert sorted(events) == [("mission", "exhaust"), ("skipped", "hang")]
    assert "170 MB" in ends["exhaust"].reason


def test_what_killed_runs_left_is_removed_also_where_nothing_is_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    found = missions(tmp_path / "logs", "fine-1")
    run(found, asked_for(tmp_path / "out"))
    work = tmp_path / "out" / ".work"
    for folder in (work / "7-ab", work / "8-cd", tmp_path / "mfhca-audit-1", tmp_path / "mfhca-audit-2"):
        folder.mkdir()
        (folder / "data").write_bytes(b"1")
    (work / "7-ab.lock").write_text(str(tmp_path / "mfhca-audit-1"), encoding="utf-8")
    (tmp_path / "mfhca-audit-2" / ".held").touch()
    with run_folders(tmp_path / "other") as live:
        _, events = run(found, asked_for(tmp_path / "out"))
        assert live.folder.is_dir()
        assert [p.name for p in tmp_path.glob("mfhca-audit-*")] == [live.temporary.name]
    assert {kind for kind, _ in events} == {"skipped"}
    assert [p.name for p in work.iterdir()] == ["claims"]


def test_an_interrupted_audit_begins_no_other_mission(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "hang", "once")  # the second waits for the first

    def tell(event: str, facts: dict[str, object]) -> None:
        if event == "tick":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        audit(found, asked_for(tmp_path / "out"), lambda: engines.local(1, COLD), tell)
    assert not (tmp_path / "logs" / "once.bag.mark").exists()


def test_a_page_stands_until_trends_are_wanted_over_something_else(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine")
    pages: list[str] = []

    def tell(event: str, facts: dict[str, object]) -> None:
        if event == "page":
            pages.append(json.loads((tmp_path / "out" / "fleet.json").read_bytes())["axis"])

    for axis in ("hours", "hours", "days", "days", "hours"):
        audit(found, asked_for(tmp_path / "out"), lambda: engines.local(1, COLD), tell, axis=axis)
    assert pages == ["hours", "hours", "days", "hours"]  # the first time before and after the mission


def states(output: Path) -> dict[str, str]:
    return {m["name"]: m["state"] for m in json.loads((output / "fleet.json").read_bytes())["missions"]}


def test_the_page_of_an_interrupted_audit_tells_what_was_found_and_what_is_to_do(tmp_path: Path) -> None:
    asked = asked_for(tmp_path / "out")
    run(missions(tmp_path / "logs", "fine-1"), asked)
    found = missions(tmp_path / "logs", "fine-1", "damaged", "hang")
    seen: list[dict[str, str]] = []

    def stop(event: str, facts: dict[str, object]) -> None:
        if event == "mission":
            seen.append(states(tmp_path / "out"))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        audit(found, asked, lambda: engines.local(1, COLD), stop)
    assert seen == [{"damaged": "pending", "fine-1": "ok", "hang": "pending"}]
    assert states(tmp_path / "out") == {"damaged": "degraded", "fine-1": "ok", "hang": "pending"}


def test_a_page_that_was_left_behind_is_written_anew(tmp_path: Path) -> None:
    asked = asked_for(tmp_path / "out")
    run(missions(tmp_path / "logs", "fine-1"), asked)
    before = (tmp_path / "out" / "fleet.json").read_bytes()
    found = missions(tmp_path / "logs", "fine-1", "damaged")
    run(found, asked)
    (tmp_path / "out" / "fleet.json").write_bytes(before)  # as where the audit was ended by force
    _, events = run(found, asked)
    assert {kind for kind, _ in events} == {"skipped"}
    assert sorted(states(tmp_path / "out")) == ["damaged", "fine-1"]


def test_a_page_shows_which_result_counts_now(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine-1", "fine-2")
    run(found, asked_for(tmp_path / "out"))
    (tmp_path / "logs" / "fine-2.bag").unlink()
    run(missions(tmp_path / "logs", "fine-1"), asked_for(tmp_path / "out"))
    document = json.loads((tmp_path / "out" / "fleet.json").read_bytes())
    assert [m["gone"] for m in document["missions"]] == [False, True]
    run(found, asked_for(tmp_path / "out"))  # it is back
    document = json.loads((tmp_path / "out" / "fleet.json").read_bytes())
    assert [m["gone"] for m in document["missions"]] == [False, False]


def test_a_baseline_that_cannot_be_read_is_said_before_any_work(tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", "fine-1")
    with pytest.raises(OutputError, match="there is no store"):
        audit(
            found,
            asked_for(tmp_path / "out"),
            lambda: engines.local(1, COLD),
            lambda *_: None,
            baseline=tmp_path / "typo",
        )
    assert not (tmp_path / "out" / "fleet.sqlite").exists()
