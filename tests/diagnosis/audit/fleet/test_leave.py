"""Every machine stands in one of three lists, with why and the mission that says so."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from diagnosis.audit.fleet.leave import Left, lists_of
from diagnosis.audit.fleet.listed import listed_machines
from diagnosis.audit.fleet.page.page import build_fleet_page
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.audit.store.database import Database
from diagnosis.audit.store.repairs import Repair, record_repair
from diagnosis.audit.store.store import Store
from diagnosis.results.vocabulary import Leave
from tests import fleet_samples as samples
from tests.fleet_contradictions import fleet_contradictions
from tests.fleet_samples import Fault, Sample


def listed(tmp_path: Path, *missions: Sample) -> dict[str, Left]:
    document = fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", missions)))
    assert len(lists_of(document)) == len(document["machines"])
    return {x.label: x for x in lists_of(document)}


def test_every_machine_of_a_fleet_stands_in_one_list(tmp_path: Path) -> None:
    found = listed(tmp_path, *samples.few())
    assert found["HX4-07"].leave is Leave.MUST_NOT
    assert found["HX4-07"].reason.startswith("front steering sensor stuck")
    assert found["HX4-07"].name == "HX4-07/2026-11-14"
    assert found["HX4-02"].leave is Leave.MAY
    assert found["HX4-08"].leave is Leave.CHECK
    assert (found["HX4-08"].name, found["HX4-08"].reason) == (
        "HX4-08/broken",
        "FL speed sensor noisy; ends after 12 bytes",
    )


def test_a_fault_that_was_not_seen_again_is_said_of_an_earlier_mission(tmp_path: Path) -> None:
    slight = Sample("a", verdict="watch", faults=[Fault("FR", "sensor", "noisy", "low")])
    (one,) = listed(tmp_path, slight, Sample("b", day=1.0)).values()
    assert one.leave is Leave.MAY
    assert one.reason == "no fault in its last mission; seen before: FR speed sensor noisy"
    assert one.name == "b"


def test_a_table_that_is_no_log_blocks_no_machine(tmp_path: Path) -> None:
    for reason, leave in (
        ("HX-1/oil.csv: no log of a machine: no column (iron_ppm) is called like a signal", Leave.MAY),
        ("HX-1/b.csv: no wheel signal: no column (a) is called like a signal of a machine", Leave.CHECK),
    ):
        other = Sample("HX-1/oil", "HX-1", None, "unreadable", None, reason=reason)
        document = fleet_json(
            load_fleet(samples.write_store(tmp_path / leave.value / "fleet.sqlite", [Sample("HX-1/a"), other]))
        )
        (one,) = lists_of(document)
        assert one.leave is leave
        assert "oil" in build_fleet_page(document)


def test_the_page_shows_as_many_machines_as_the_lists_hold(tmp_path: Path) -> None:
    document = fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", samples.few())))
    page = build_fleet_page(document)
    for leave in Leave:
        count = sum(x.leave is leave for x in lists_of(document))
        assert f"{leave.value[:1].upper()}{leave.value[1:]} ({count})" in page


def test_an_open_fault_and_a_rising_loss_are_said(tmp_path: Path) -> None:
    stuck = Sample("a/1", "a", day=0.0, verdict="stop", faults=[Fault("FR", "sensor", "stuck", "high")])
    valve = ("RL", "actuator")
    worn = [
        Sample(
            f"b/{k}",
            "b",
            day=float(k),
            verdict="watch",
            faults=[Fault()],
            epsilon={valve: samples.bounds(0.2 + 0.1 * k)},
        )
        for k in range(6)
    ]
    found = listed(tmp_path, stuck, Sample("a/2", "a", day=1.0), *worn)
    assert found["a"].reason == (
        "FR speed sensor stuck, no repair recorded, clean in 1 of the 10 missions that it takes to close it; its newest report "
        "(a/2) finds no fault, but judges its own mission alone"
    )
    assert (found["a"].name, found["a"].lead) == ("a/1", "– fault found in")
    assert "RL drive valve inefficient, rising" in found["b"].reason or found["b"].leave is not Leave.MAY


def test_a_reason_names_its_log_without_the_folders(tmp_path: Path) -> None:
    broken = Sample("x/y/z", "x", state="unreadable", reason="/data/x/y/z.mcap ends after 12 bytes; copy it again")
    (one,) = listed(tmp_path, Sample("x/y/a", "x"), broken).values()
    assert (one.leave, one.reason) == (Leave.CHECK, "z.mcap ends after 12 bytes")


def test_a_reason_says_that_a_log_is_no_longer_there_and_how_to_leave_it_out(tmp_path: Path) -> None:
    torn = Sample("x/z z", "x", state="unreadable", reason="/data/x/z.mcap ends after 12 bytes", gone=True)
    (one,) = listed(tmp_path, Sample("x/a", "x"), torn).values()
    assert one.leave is Leave.CHECK
    assert one.reason.endswith("it is no longer there: put it back, or leave it out with mfhca audit --forget 'x/z z'")


def test_parts_that_were_not_assessed_stand_beside_the_leave(tmp_path: Path) -> None:
    document = fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", samples.few())))
    (k,) = (k for k, m in enumerate(document["machines"]) if m["label"] == "HX4-02")
    for part in document["machines"][k]["parts"][-1:]:
        part["assessed_last"] = False
        words = f"{part['component']} {'steering' if part['kind'] == 'steer' else ''}".strip()
    found = lists_of(document)[k]
    assert found.leave is Leave.MAY
    assert f"; not judged long enough: {words}" in found.reason
    for part in document["machines"][k]["parts"]:
        part["assessed_last"] = False
    assert found.reason != lists_of(document)[k].reason
    assert f" and {len(document['machines'][k]['parts']) - 4} more parts" in lists_of(document)[k].reason


def worn(tmp_path: Path, low: float) -> tuple[Left, str, str]:
    """A machine whose reports are ready and whose RL valve has lost .2 with a lower bound: its place, its words, the headline."""
    missions = [Sample(f"a/{k}", "a", day=float(k), epsilon={("RL", "actuator"): (0.2, low, 0.3)}) for k in range(3)]
    store = samples.write_store(tmp_path / "fleet.sqlite", missions)
    for m in missions:
        samples.write_report(tmp_path, m.name, cleared=True)
    document = fleet_json(load_fleet(store))
    (one,), (listed_one,) = lists_of(document), listed_machines(document)
    assert one.leave.value == listed_one.leave
    return one, listed_one.words, document["verdict"]["title"]


def test_a_loss_beyond_its_limit_that_no_report_states_gives_no_leave(tmp_path: Path) -> None:
    one, words, title = worn(tmp_path, 0.15)
    assert one.leave is Leave.CHECK
    assert one.reason == (
        "RL drive valve lost 20 % over the whole of its last mission, beyond the limit of 10 %, though no fault was stated in it: check "
        "the part"
    )
    assert words == "Ready by its last report, but a loss is beyond its limit"
    assert title == "The machine must be checked before it goes out"


def test_a_loss_that_may_be_within_its_limit_is_told_beside_the_leave(tmp_path: Path) -> None:
    one, words, title = worn(tmp_path, 0.05)
    assert one.leave is Leave.MAY
    assert one.reason.endswith(
        "; RL drive valve lost 20 % over the whole of its last mission, beyond the limit of 10 %, which its bounds of 5 to 30 % leave open"
    )
    assert words == "Ready"
    assert title == "The machine may go out"


def said_by(folder: Path, name: str, **more: object) -> None:
    """Let a mission's report say more than what the fleet's samples have."""
    path = folder / "missions" / name / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    report["verdict"] |= more.pop("verdict", {})
    path.write_text(json.dumps(report | more), encoding="utf-8")


def test_what_must_be_checked_first_says_why(tmp_path: Path) -> None:
    """A part that may have lost half is the reason, not the parts that were judged too briefly."""
    lost = Sample("a", verdict="watch", faults=[Fault("RR", "actuator", epsilon=(0.34, 0.14, 0.54))])
    store = samples.write_store(tmp_path / "fleet.sqlite", [lost])
    samples.write_report(tmp_path, "a", cleared=False)
    said_by(tmp_path, "a", verdict={"not_cleared": "the RR drive valve may have lost up to 54 %; more below"})
    (one,) = lists_of(fleet_json(load_fleet(store)))
    assert one.leave is Leave.CHECK
    assert one.reason.endswith(
        "not cleared, because the RR drive valve may have lost up to 54 % (a part that may have lost half or more is checked first)"
    )


def test_a_report_from_before_the_repair_is_said_to_be_so(tmp_path: Path) -> None:
    silent = Fault("FR", "sensor", "no_signal", "high")
    missions = [Sample("a", verdict="stop", faults=[silent]), Sample("b", day=2.0)]
    store = samples.write_store(tmp_path / "fleet.sqlite", missions)
    for mission in missions:
        samples.write_report(tmp_path, mission.name, cleared=True)
    said_by(tmp_path, "b", previous={"open_faults": ["FR speed sensor no signal, no repair recorded"]})
    (one,) = lists_of(fleet_json(load_fleet(store)))
    assert (one.leave, one.note) == (Leave.MUST_NOT, "")  # it is open still, as the report says
    with Store.open(store) as opened:
        record_repair(opened, Repair(("HX-1", ""), "FR", "", samples.START_NS + samples.DAY_NS))
    document = fleet_json(load_fleet(store))
    (one,) = lists_of(document)
    assert (one.leave, one.name) == (Leave.MAY, "b")
    assert one.note.startswith("this report was written before the repair was recorded")
    assert f"({one.note})" in build_fleet_page(document)


def test_a_report_is_not_said_to_tell_what_it_does_not(tmp_path: Path) -> None:
    """That of a machine that is ready says why a part of an axle was not judged, and asks for nothing."""
    for verdict, says in (("ready", "why"), ("not_assessed", "why, and what would have them judged")):
        one = Sample("a", verdict=verdict, blind=[("front", "actuator")])
        page = build_fleet_page(fleet_json(load_fleet(samples.write_store(tmp_path / verdict / "fleet.sqlite", [one]))))
        assert f"its report</a> says {says}{'</li>' if verdict == 'ready' else '. <b>To the driver:</b> steer'}" in page


def test_each_fault_of_a_row_names_its_mission_where_they_are_several(tmp_path: Path) -> None:
    one, other = Fault("FR", "sensor", "stuck", "high"), Fault("RL", "actuator", "stuck", "high")
    (both,) = listed(tmp_path, Sample("a", faults=[one]), Sample("b", day=1.0, faults=[other])).values()
    assert "FR speed sensor stuck in a" in both.reason
    assert "RL drive valve stuck in b" in both.reason


def test_a_kind_that_its_report_calls_unclear_is_unclear_in_the_lists(tmp_path: Path) -> None:
    store = samples.write_store(
        tmp_path / "fleet.sqlite",
        [Sample("a", faults=[Fault("FR", "actuator", "inefficient", "high", (1.0, 0.9, 1.0))])],
    )
    with closing(Database(store)) as db, db.transaction() as c:
        c.execute("UPDATE fault SET unclear = 1")
    document = fleet_json(load_fleet(store))
    (one,) = lists_of(document)
    assert one.reason.startswith("FR drive valve faulty, kind unclear")
    page = build_fleet_page(document)
    assert "faulty, kind unclear" in page
    assert "lost in the fault" not in page


def test_a_store_of_an_earlier_version_is_read_and_written_on(tmp_path: Path) -> None:
    store = samples.write_store(
        tmp_path / "fleet.sqlite", [Sample("a", faults=[Fault("FR", "sensor", "stuck", "high")])]
    )
    with closing(sqlite3.connect(store)) as plain:
        plain.execute("ALTER TABLE fault DROP COLUMN unclear")
        plain.execute("ALTER TABLE result DROP COLUMN left_out")
    for write in (False, True):
        if write:
            Database(store).close()
        (one,) = lists_of(fleet_json(load_fleet(store)))
        assert one.reason.startswith("FR speed sensor stuck")


def test_parts_that_were_judged_too_briefly_are_named_once(tmp_path: Path) -> None:
    blind = Sample("b", day=1.0, verdict="not_assessed", blind=[("FR", "sensor")], reason="Not judged long enough")
    (one,) = listed(tmp_path, Sample("a"), blind).values()
    assert one.leave is Leave.CHECK
    assert one.reason == "Not judged long enough: FR speed sensor"


def test_no_machine_that_must_not_go_out_is_no_all_clear(tmp_path: Path) -> None:
    half = Sample("a", verdict="watch", faults=[Fault("RR", "actuator", epsilon=(0.65, 0.64, 0.66))])
    page = build_fleet_page(fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", [half]))))
    assert "Must not go out (0)" in page
    assert "None for certain, but 1 machine must be checked first." in page
    assert "Check before it goes out (1)" in page


def test_of_faults_that_are_not_named_the_newest_is(tmp_path: Path) -> None:
    parts = (("FR", "sensor"), ("FL", "sensor"), ("RR", "actuator"))
    missions = [
        Sample(f"a{k}", day=float(k), verdict="stop", faults=[Fault(*part, "stuck", "high")])
        for k, part in enumerate(parts)
    ]
    missions.append(Sample("b", day=3.0, verdict="watch", faults=[Fault("RL", "actuator", "inefficient", "medium")]))
    (one,) = listed(tmp_path, *missions).values()
    assert "and 2 more, the newest RL drive valve inefficient" in one.reason


def growing(tmp_path: Path, losses: list[float], repaired: bool = False, half: float = 0.01) -> tuple[Left, str, str]:
    """A machine whose RL valve loses so much in its missions, each of which may go out alone: its place, words and sentence."""
    valve = ("RL", "actuator")
    missions = [
        Sample(
            f"a/{k}",
            "a",
            day=float(k),
            verdict="watch",
            faults=[Fault("RL", "actuator", "inefficient", "medium", epsilon=(x, x - half, x + half))],
            epsilon={valve: (x, x - half, x + half)},
        )
        for k, x in enumerate(losses)
    ]
    store = samples.write_store(tmp_path / "fleet.sqlite", missions)
    for m in missions:
        samples.write_report(tmp_path, m.name, cleared=True)
    if repaired:
        with Store.open(store) as opened:
            record_repair(opened, Repair(("a", ""), "RL", "actuator", samples.START_NS + len(losses) * samples.DAY_NS))
    document = fleet_json(load_fleet(store))
    (one,), (row,) = lists_of(document), listed_machines(document)
    assert one.leave.value == row.leave
    assert row.words in build_fleet_page(document)
    assert [*fleet_contradictions(document)] == []
    return one, row.words, document["verdict"]["title"]


@pytest.mark.parametrize(
    "losses", [[0.12, 0.2, 0.28, 0.35, 0.42], [0.12, 0.27, 0.42], [0.1, 0.1, 0.1, 0.2, 0.31, 0.42]]
)
def test_a_loss_that_grows_towards_a_half_is_checked_first(tmp_path: Path, losses: list[float]) -> None:
    one, words, title = growing(tmp_path, losses)
    assert one.leave is Leave.CHECK
    assert one.reason.startswith("RL drive valve lost 42 % over its last mission (")
    assert "half may be lost before two more are over: check the part" in one.reason
    assert words == "Faults to watch, and a loss that grows fast"
    assert title == "The machine must be checked before it goes out"


@pytest.mark.parametrize("losses", [[0.42] * 6, [0.1, 0.12, 0.13, 0.15, 0.16], [0.42, 0.38, 0.35, 0.3, 0.27], [0.42]])
def test_a_loss_that_does_not_gives_leave_as_its_reports_do(tmp_path: Path, losses: list[float]) -> None:
    one, words, _ = growing(tmp_path, losses)
    assert one.leave is Leave.MAY
    assert "grows" not in one.reason + words


def test_a_repair_ends_the_growth(tmp_path: Path) -> None:
    one, words, _ = growing(tmp_path, [0.12, 0.27, 0.42], repaired=True)
    assert "grows" not in one.reason + words


def test_the_course_of_a_part_that_is_silent_says_what_it_leaves_out(tmp_path: Path) -> None:
    part = ("FR", "sensor")
    silent = [Fault(*part, "no_signal", "high")]
    missions = [
        Sample(f"a/{k}", "a", day=float(k), verdict="stop" if k == 5 else "ready", faults=silent if k == 5 else (),
               epsilon={part: samples.bounds(0.01)})
        for k in range(6)
    ]  # fmt: skip
    page = build_fleet_page(fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", missions))))
    assert "not counting the time found as no signal, in which nothing was left of it: the dots are of the rest" in page


def test_the_report_of_a_mission_before_the_repair_is_said_to_be_so(tmp_path: Path) -> None:
    missions = [Sample("a", verdict="stop", faults=[Fault("FR", "sensor", "no_signal", "high")])]
    store = samples.write_store(tmp_path / "fleet.sqlite", missions)
    (one,) = lists_of(fleet_json(load_fleet(store)))
    assert (one.leave, one.note) == (Leave.MUST_NOT, "")
    with Store.open(store) as opened:
        record_repair(opened, Repair(("HX-1", ""), "FR", "", samples.START_NS + samples.DAY_NS))
    document = fleet_json(load_fleet(store))
    (one,), (row,) = lists_of(document), listed_machines(document)
    assert (one.leave, one.name) == (Leave.CHECK, "a")
    assert one.note == row.note
    assert one.note.startswith("this report is of a mission before the repair")
    assert f"({one.note})" in build_fleet_page(document)


def test_what_the_newest_mission_leaves_open_is_named_with_its_part(tmp_path: Path) -> None:
    """A machine with an older fault to watch is held by what its newest report does not clear, which is another part's."""
    loss = Fault("RR", "sensor", epsilon=(0.25, 0.24, 0.26))
    missions = [
        Sample("a"),
        Sample("b", day=1.0, verdict="watch", faults=[loss]),
        Sample("c", day=2.0, verdict="not_assessed"),
    ]
    store = samples.write_store(tmp_path / "fleet.sqlite", missions)
    for mission in missions:
        samples.write_report(tmp_path, mission.name, cleared=mission.name != "c")
    fault, brief = {"component": "RL", "side": "sensor"}, {"component": "front", "side": "actuator"}
    sides = [{"component": "FR", "side": side} for side in ("sensor", "actuator")]
    points = [
        {
            "reason": "F1: the RL speed sensor may have lost half.",
            "act": "",
            "parts": [fault],
            "fault": "F1",
            "why": "",
        },
        {
            "reason": "The speed of FR per opening is 38 % below the other wheels'.",
            "act": "",
            "parts": sides,
            "fault": "",
            "why": "",
        },
        {
            "reason": "front steering valve: judged for 9 s of driving.",
            "act": "",
            "parts": [brief],
            "fault": "",
            "why": "not steered",
        },
    ]
    said_by(tmp_path, "c", verdict={"to_clear": points})
    document = fleet_json(load_fleet(store))
    (one,) = lists_of(document)
    assert (one.leave, one.name) == (Leave.CHECK, "c")
    assert one.reason.endswith(
        "and its newest mission did not clear the machine – FR speed sensor and drive valve: the speed of FR per opening is 38 % below the "
        "other wheels'"
    )
    assert "FR speed sensor and drive valve: the speed of FR" in build_fleet_page(document)
