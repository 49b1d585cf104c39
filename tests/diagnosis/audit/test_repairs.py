"""Repairs: what they close, what stays open without one, and that they are kept as facts of the store."""

from __future__ import annotations

import html
import json
import re
import shlex
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from diagnosis.audit.fleet.leave import lists_of
from diagnosis.audit.fleet.listed import listed_machines
from diagnosis.audit.fleet.page.page import build_fleet_page
from diagnosis.audit.fleet_files import fleet_json, load_fleet, write_fleet
from diagnosis.audit.repairs import record_repairs
from diagnosis.audit.store.ingest import ingest
from diagnosis.audit.store.repairs import Repair, read_repairs, record_repair, repaired_at
from diagnosis.audit.store.store import Store
from diagnosis.pages.labels import utc_moment
from diagnosis.results.vocabulary import Leave
from replay.errors import ConfigError, OutputError
from tests import fleet_samples as samples
from tests.fleet_samples import DAY_NS, START_NS, Fault, Sample

PART = ("FR", "sensor")
SILENT = Fault(*PART, "no_signal", "high")


def at(day: float) -> int:
    return START_NS + int(day * DAY_NS)


def course(days: str, severity: str = "high") -> list[Sample]:
    """A mission a day: ``x`` with the fault, ``.`` clean, ``b`` without assessing the part, ``?`` not judged."""
    found = [Fault(*PART, "no_signal", severity)]
    verdict = {"x": "stop" if severity == "high" else "watch", "?": "not_assessed"}
    return [
        Sample(
            f"m{k:02d}", day=float(k), verdict=verdict.get(d, "ready"), faults=found if d == "x" else (),
            blind=[PART] if d in "b?" else (),
        )
        for k, d in enumerate(days)
    ]  # fmt: skip


def stored(folder: Path, missions: list[Sample]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return samples.write_store(folder / "fleet.sqlite", missions)


def document(folder: Path) -> dict[str, Any]:
    return fleet_json(load_fleet(folder / "fleet.sqlite"))


def standing(folder: Path) -> tuple[str, str, str]:
    """Verdict of the one machine, its words, and the status of its one fault."""
    d = document(folder)
    return d["machines"][0]["verdict"], d["machines"][0]["standing"], d["faults"][0]["status"]


def repair(folder: Path, words: str, day: float, **more: bool) -> Any:
    return record_repairs(folder, [words], at(day), lambda event, facts: None, **more)


@pytest.mark.parametrize(
    ("days", "severity", "verdict", "status"),
    [
        ("..x....x...", "high", "stop", "recurring"),  # twice in ten missions: a loose contact
        ("x.", "high", "stop", "once"),
        ("x.........", "high", "stop", "once"),  # nine clean ones
        ("x..........", "high", "ready", "past"),  # ten
        ("x.........b", "high", "stop", "once"),  # what did not assess the part counts for nothing
        ("x..........x...", "high", "stop", "recurring"),
        ("x..", "medium", "ready", "once"),
        ("x...", "medium", "ready", "past"),
    ],
)
def test_a_severe_fault_stays_open_until_ten_missions_are_clean(
    tmp_path: Path, days: str, severity: str, verdict: str, status: str
) -> None:
    stored(tmp_path, course(days, severity))
    found, words, state = standing(tmp_path)
    assert (found, state) == (verdict, status)
    if severity == "high" and verdict == "stop" and words != "Stop and repair":
        assert words == "Fault open, no repair recorded"


def test_a_lesser_fault_of_the_same_row_does_not_end_the_severe_one_s_ten(tmp_path: Path) -> None:
    missions = course("x....x....")
    missions[5] = Sample("m05", day=5.0, verdict="watch", faults=[Fault(*PART, "no_signal", "low")])
    stored(tmp_path, missions)
    (fault,) = document(tmp_path)["faults"]
    assert (fault["severity"], fault["open"], fault["needed"], fault["clean"]) == ("low", True, 10, 4)
    missions = course("x..........x...")
    missions[11] = Sample("m11", day=11.0, verdict="watch", faults=[Fault(*PART, "no_signal", "low")])
    stored(tmp_path / "two", missions)
    (fault,) = document(tmp_path / "two")["faults"]
    assert (fault["open"], fault["status"]) == (False, "past")


@pytest.mark.parametrize(("share", "verdict"), [(0.4, "stop"), (0.6, "ready")])
def test_only_missions_count_that_would_have_shown_it(tmp_path: Path, share: float, verdict: str) -> None:
    missions = course("x..........")
    for m in missions:
        samples.write_report(tmp_path, m.name, True)
        path = tmp_path / "missions" / m.name / "report.json"
        report = json.loads(path.read_text(encoding="utf-8"))
        row = {"component": "FR", "side": "sensor", "deviation": "no_signal"}
        rows = [{**row, "for_s": 2.0, "share": 0.0}, {**row, "for_s": 10.0, "share": share}]
        path.write_text(json.dumps({**report, "detectability": {"rows": rows}}), encoding="utf-8")
    stored(tmp_path, missions)
    assert standing(tmp_path)[0] == verdict
    page = build_fleet_page(document(tmp_path))
    assert ("open, for no mission since that was read whole would have shown it" in page) == (verdict == "stop")


def test_a_machine_that_may_go_out_says_what_was_repaired(tmp_path: Path) -> None:
    stored(tmp_path, course(".x.."))
    repair(tmp_path, "HX-1 FR sensor", 1.5)
    (one,) = lists_of(document(tmp_path))  # type: ignore[arg-type]
    assert one.leave is Leave.MAY
    said = f"FR speed sensor no signal, repaired {utc_moment(at(1.5))} and not found since"
    assert one.reason == f"no fault in its last mission; {said}"


def test_an_open_fault_is_on_the_page_and_on_the_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stored(tmp_path, [*course("..x....x..."), Sample("z", "HX-2")])
    page = build_fleet_page(document(tmp_path))
    assert "Fault open, no repair recorded" in page
    assert "open, clean in 3 of the 10 missions that it takes to close it" in page
    assert document(tmp_path)["verdict"]["text"][0] == (
        "HX-1 – fault open, no repair recorded: FR speed sensor no signal in 2 of the 11 missions that judged the part, "
        "clean in 3 of the 10 missions that it takes to close it."
    )
    listed = listed_machines(document(tmp_path))  # type: ignore[arg-type]
    assert [(m.label, m.words) for m in listed] == [("HX-1", "Fault open, no repair recorded"), ("HX-2", "Ready")]
    assert page.index(">HX-1<") < page.index(">HX-2<")


def test_a_repair_closes_what_was_found_before_it(tmp_path: Path) -> None:
    stored(tmp_path, course("..x....x..."))
    done = repair(tmp_path, "HX-1 FR sensor", 7.5)
    assert done.told[0].closes == ("FR speed sensor no signal",)
    assert standing(tmp_path) == ("ready", "Ready", "repaired")
    day = utc_moment(at(7.5))
    assert f"repaired on {day}" in (tmp_path / "fleet.html").read_text(encoding="utf-8")
    assert "Repaired" in (tmp_path / "fleet.html").read_text(encoding="utf-8")
    assert [m.words for m in done.machines] == ["Ready"]
    assert document(tmp_path)["counts"]["faults"]["repaired"] == 1


def test_what_was_repaired_and_not_driven_since_is_not_ready(tmp_path: Path) -> None:
    stored(tmp_path, course("..x"))
    repair(tmp_path, "hx-1 fr", 3.0)
    verdict, words, status = standing(tmp_path)
    assert (verdict, status) == ("not_assessed", "repaired")
    assert words == f"Not assessed since the repair on {utc_moment(at(3.0))}"
    assert "The machine is ready" not in document(tmp_path)["verdict"]["title"]


@pytest.mark.parametrize("days", ["..xb", "..x?"])
def test_nor_is_one_whose_part_no_later_mission_assessed(tmp_path: Path, days: str) -> None:
    stored(tmp_path, course(days))
    assert standing(tmp_path)[0] == "stop"
    repair(tmp_path, "HX-1 FR", 2.5)
    assert standing(tmp_path)[2] == "repaired"


def test_each_repair_is_told_with_its_own_date(tmp_path: Path) -> None:
    """The part that was repaired early was clean since; the one that was repaired after the last mission waits."""
    valve = Fault("RL", "actuator", "stuck", "high")
    days = [([SILENT], "stop"), ([], "ready"), ([], "ready"), ([valve], "stop")]
    stored(tmp_path, [Sample(f"m{k}", day=float(k), verdict=v, faults=f) for k, (f, v) in enumerate(days)])
    repair(tmp_path, "HX-1 FR sensor", 0.5)
    repair(tmp_path, "HX-1 RL actuator", 3.5)
    early, late = utc_moment(at(0.5)), utc_moment(at(3.5))
    repair(tmp_path, "HX-1 FR actuator", 3.5)  # of which nothing was found: no part of the list
    words = (
        f"FR speed sensor not found by 3 missions since the repair on {early}; "
        f"RL drive valve not judged since the repair on {late}"
    )
    assert standing(tmp_path)[:2] == ("not_assessed", words)
    fleet: Any = document(tmp_path)
    (left,) = lists_of(fleet)
    assert (left.leave, left.label) == (Leave.CHECK, "HX-1")
    assert words in left.reason


def test_missions_before_a_repair_say_nothing_of_it(tmp_path: Path) -> None:
    """Clean missions between the fault and its repair are not told as clean since the repair."""
    valve = Fault("RL", "actuator", "stuck", "high")
    days = [([SILENT], "stop"), ([], "ready"), ([valve], "stop")]
    stored(tmp_path, [Sample(f"m{k}", day=float(k), verdict=v, faults=f) for k, (f, v) in enumerate(days)])
    repair(tmp_path, "HX-1 FR sensor", 2.5)
    repair(tmp_path, "HX-1 RL actuator", 2.5)
    assert standing(tmp_path)[:2] == ("not_assessed", f"Not assessed since the repair on {utc_moment(at(2.5))}")


def test_a_fault_that_comes_back_is_open_again(tmp_path: Path) -> None:
    stored(tmp_path, course("..x..x"))
    repair(tmp_path, "HX-1 FR sensor", 3.5)
    verdict, _, status = standing(tmp_path)
    assert (verdict, status) == ("stop", "recurring")
    page = build_fleet_page(document(tmp_path))
    assert f"found again since the repair on {utc_moment(at(3.5))}" in page


def test_other_parts_stay_as_they_are(tmp_path: Path) -> None:
    both = [SILENT, Fault("RL", "actuator", "stuck", "high")]
    stored(tmp_path, [Sample("a", verdict="stop", faults=both)])
    repair(tmp_path, "HX-1 FR sensor", 1.0)
    d = document(tmp_path)
    assert {f["component"]: f["status"] for f in d["faults"]} == {"FR": "repaired", "RL": "once"}
    assert d["machines"][0]["verdict"] == "stop"


@pytest.mark.parametrize(
    ("repairs", "when"),
    [
        ([("sensor", 3)], None),
        ([("", 3)], 3),
        ([("sensor", 3), ("actuator", 5)], 3),
        ([("", 2), ("sensor", 9), ("actuator", 5)], 5),
    ],
)
def test_a_fault_of_either_side_needs_both(repairs: list[tuple[str, int]], when: int | None) -> None:
    own = [Repair(("HX-1", ""), "FR", side, day) for side, day in repairs]
    assert repaired_at(own, "FR", "sensor_or_actuator") == when
    assert repaired_at(own, "FL", "sensor") is None


def test_a_mission_without_a_date_is_older_where_an_audit_saw_it_before(tmp_path: Path) -> None:
    stored(tmp_path, [Sample("a", day=None, verdict="stop", faults=[SILENT])])
    repair(tmp_path, "HX-1 FR", 5.0)
    assert standing(tmp_path)[2] == "once"  # nobody knows what was first
    place = tmp_path / "results" / "00000000-cccccccc-1.0-1.json"
    place.write_text(json.dumps({"made_ns": at(1.0), "mission": {"name": "a"}}), encoding="utf-8")
    assert standing(tmp_path)[2] == "repaired"


def test_a_repair_can_be_taken_back(tmp_path: Path) -> None:
    stored(tmp_path, course("..x"))
    repair(tmp_path, "HX-1 FR sensor", 3.0)
    repair(tmp_path, "HX-1 FR sensor", 3.0, withdrawn=True)
    assert standing(tmp_path)[::2] == ("stop", "new")
    with pytest.raises(ConfigError, match="no repair of it"):
        repair(tmp_path, "HX-1 FR sensor", 3.0, withdrawn=True)
    repair(tmp_path, "HX-1 FR sensor", 3.0)
    assert standing(tmp_path)[2] == "repaired"


def test_a_lost_store_keeps_its_repairs(tmp_path: Path) -> None:
    stored(tmp_path / "a", course("..x"))
    repair(tmp_path / "a", "HX-1 FR sensor", 3.0)
    stored(tmp_path / "b", course("..x"))
    shutil.copytree(tmp_path / "a" / "results", tmp_path / "b" / "results")
    (tmp_path / "b" / "results" / "repair-0123456789abcdef.json").write_text("{}", encoding="utf-8")
    for _ in range(2):
        with Store.open(tmp_path / "b" / "fleet.sqlite") as store:
            taken = ingest(store)
            assert len(read_repairs(store.database)) == 1
        assert len(taken.problems) == 1
        assert "is not a repair that this tool recorded" in taken.problems[0]
    assert standing(tmp_path / "b")[2] == "repaired"


def test_a_store_of_an_earlier_version_is_read_and_gets_its_table(tmp_path: Path) -> None:
    path = stored(tmp_path, course("..x"))
    with closing(sqlite3.connect(path)) as db:
        db.execute("DROP TABLE repair")
        db.commit()
    assert standing(tmp_path)[2] == "new"
    repair(tmp_path, "HX-1 FR", 3.0)
    assert standing(tmp_path)[2] == "repaired"


def test_a_repair_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = stored(tmp_path, course("..x"))
    with Store.open(path) as store:
        monkeypatch.setattr("diagnosis.audit.store.objects._put_file", _full)
        with pytest.raises(OutputError, match="No space left"):
            record_repair(store, Repair(("HX-1", ""), "FR", "", at(3.0)))
        assert read_repairs(store.database) == []


def _full(*_: object) -> bool:
    raise OSError(28, "No space left on device")


def test_the_page_of_before_is_out_of_date(tmp_path: Path) -> None:
    path = stored(tmp_path, course("..x"))
    write_fleet(path, tmp_path)
    before = json.loads((tmp_path / "fleet.json").read_text(encoding="utf-8"))["mark"]
    repair(tmp_path, "HX-1 FR", 3.0)
    assert json.loads((tmp_path / "fleet.json").read_text(encoding="utf-8"))["mark"] != before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("HX-1", 'expected "MACHINE PART"'),
        ("HX-9 FR sensor", "no such machine; the audit has HX-1"),
        ("HX-1 XX sensor", "has no part XX; it has FR, FL, RR, RL, front, rear"),
    ],
)
def test_a_part_that_is_not_known_is_refused(tmp_path: Path, words: str, said: str) -> None:
    stored(tmp_path, course("..x"))
    with pytest.raises(ConfigError, match=said):
        repair(tmp_path, words, 3.0)
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("words", "part"),
    [
        ("HX-1 FR speed sensor", "FR sensor"),
        ("HX-1 fr Drive  Valve", "FR actuator"),
        ("HX-1 FR motor", "FR actuator"),
        ("HX-1 front steering sensor", "front sensor"),
        ("HX-1 front steering valve", "front actuator"),
        ("HX-1 FR speed sensor or drive valve", "FR"),
        ("HX-1 FR", "FR"),
    ],
)
def test_sides_have_the_names_that_reports_give_them(tmp_path: Path, words: str, part: str) -> None:
    stored(tmp_path, course("..x"))
    assert repair(tmp_path, words, 3.0).told[0].part == part


def test_what_stays_open_is_said(tmp_path: Path) -> None:
    either = Fault("FR", "sensor_or_actuator", "no_signal", "high")
    stored(tmp_path, [Sample("m", day=0.0, verdict="stop", faults=(SILENT, either))])
    first = repair(tmp_path, "HX-1 FR sensor", 3.0).told[0]
    assert [w.split(":")[0] for w in first.closes] == ["FR speed sensor no signal"]
    (stays,) = first.stays
    assert stays.startswith("FR speed sensor or drive valve no signal: the repair of one side")
    second = repair(tmp_path, "HX-1 FR drive valve", 4.0).told[0]
    assert (len(second.closes), second.stays) == (1, ())
    stored(tmp_path / "later", course("..x"))
    assert "found again on" in repair(tmp_path / "later", "HX-1 FR", 1.5).told[0].stays[0]


def test_a_day_on_which_the_fault_was_found_needs_a_time(tmp_path: Path) -> None:
    stored(tmp_path, course("..x"))
    day = utc_moment(at(2.0))[:10]
    with pytest.raises(ConfigError, match=f"after that mission it is --on {day}T"):
        record_repairs(tmp_path, ["HX-1 FR"], at(2.0) // DAY_NS * DAY_NS, lambda *_: None)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.fleet_samples.START_NS", 1_760_000_000 * 10**9)
    stored(tmp_path, course("..x"))
    words = ["audit", "-o", str(tmp_path), "--repaired", "HX-1 FR sensor", "--on", "2025-10-20"]
    assert run(words) == 0
    shown = capsys.readouterr().out
    assert "Repair recorded: HX-1 FR sensor on 2025-10-20 00:00:00 UTC" in shown
    assert "closes: FR speed sensor no signal" in shown
    assert "Not assessed since the repair" in " ".join(shown.split())
    assert run([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["machines"][0]["verdict"] == "not_assessed"
    assert run(["audit", "-o", str(tmp_path), "--not-repaired", "HX-1 FR sensor", "--on", "2025-10-20"]) == 0
    assert "Stop and repair" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "no PATH is given"),
        (["--on", "2026-10-05"], "give it with --repaired"),
        (["--repaired", "HX-1 FR"], "give the date of the repair with --on"),
        (["logs", "--repaired", "HX-1 FR", "--on", "2026-10-05"], "leave out logs"),
        (["--repaired", "HX-1 FR", "--on", "2025-10-05"], "there is no store"),
        (["--repaired", "HX-1 FR", "--on", "monday"], "is no date"),
        (["--repaired", "HX-1 FR", "--on", "2099-10-05"], "lies ahead"),
        (["--repaired", "HX-1 FR", "--on", "1999-01-01"], "lies before 2000"),
    ],
)
def test_what_the_command_refuses(
    tmp_path: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["audit", "-o", str(tmp_path / "out"), *words]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_command_that_the_page_shows_records_the_repair(tmp_path: Path) -> None:
    """For a machine with a space in its name, and of a fault that may be either side's."""
    missions = [
        Sample("one", "Lift 7", verdict="stop", faults=[SILENT, Fault("front", "sensor_or_actuator", "stuck", "high")])
    ]
    stored(tmp_path, missions)
    page = html.unescape(build_fleet_page(document(tmp_path)))
    commands = re.findall(r"<code>(mfhca audit .*?)</code>", page)
    assert commands == [
        "mfhca audit -o . --repaired 'Lift 7 FR sensor' --on DATE",
        "mfhca audit -o . --repaired 'Lift 7 front' --on DATE",
    ]
    for command in commands:
        repair(tmp_path, shlex.split(command)[5], 1.0)
    assert {f["status"] for f in document(tmp_path)["faults"]} == {"repaired"}
    assert "<code>mfhca audit" not in build_fleet_page(document(tmp_path))


@pytest.mark.parametrize(
    ("blind", "words"),
    [
        ([], "nor a fault of another part, and not cleared by it"),
        ([("RL", "actuator")], "RL drive valve not judged"),
        ([(c, s) for c, s in samples.PARTS if (c, s) != PART], "other parts not judged"),
    ],
)
def test_parts_that_were_judged_since_a_repair_are_not_said_to_be_unjudged(
    tmp_path: Path, blind: list[tuple[str, str]], words: str
) -> None:
    stored(tmp_path, [*course("..x"), Sample("m03", day=3.0, verdict="not_assessed", blind=blind)])
    repair(tmp_path, "HX-1 FR sensor", 2.5)
    since = f"FR speed sensor not found by 1 mission since the repair on {utc_moment(at(2.5))}"
    assert standing(tmp_path)[:2] == ("not_assessed", f"{since}, {words}")


def test_a_machine_with_an_open_fault_is_not_cleared_whatever_its_last_report_says(tmp_path: Path) -> None:
    stored(tmp_path, course("x.."))
    found = document(tmp_path)
    (machine,) = found["machines"]
    assert (machine["leave"], machine["cleared"], machine["verdict"]) == (Leave.MUST_NOT, False, "stop")
    for machine, left in zip(found["machines"], lists_of(found), strict=True):  # type: ignore[arg-type]
        assert machine["cleared"] == (left.leave is Leave.MAY)
    stored(tmp_path / "clean", course("..."))
    (machine,) = document(tmp_path / "clean")["machines"]
    assert (machine["leave"], machine["cleared"]) == (Leave.MAY, True)
