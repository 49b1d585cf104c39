"""No machine is ready whose newest mission was not judged; the headline names what must not go out."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from diagnosis.audit.fleet.listed import listed_machines
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.page.figures import of_faults
from diagnosis.audit.fleet.page.matrix import matrix
from diagnosis.audit.fleet.page.page import build_fleet_page
from diagnosis.audit.fleet.words import found_in, headline
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.results.vocabulary import Verdict
from tests import fleet_samples as samples
from tests.fleet_samples import DAY_NS, START_NS, Fault, Sample

READY = [Sample("d0"), Sample("d1", day=1.0)]
EMPTY = Sample("d2", "", state="unreadable", reason="d2.csv: is empty.")
BLIND = Sample("d1", day=1.0, verdict="not_assessed")


def document(tmp_path: Path, *missions: Sample) -> dict[str, Any]:
    return fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", missions)))


def write_object(folder: Path, k: int, mission: str, day: float) -> None:
    """Result object that says when an audit looked at the k-th mission."""
    place = folder / "results" / f"{k:064x}"[:8]
    place.parent.mkdir(parents=True, exist_ok=True)
    made = int(START_NS + day * DAY_NS)
    text = json.dumps({"made_ns": made, "mission": {"name": mission}})
    place.with_name(f"{place.name}-cccccccc-1.0-{k}.json").write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("missions", "standing"),
    [
        ([*READY, EMPTY], "Not assessed since 2026-10-27: last judged ready"),
        ([Sample("d0"), BLIND], "No fault found, not cleared; last judged ready on 2026-10-26"),
        ([Sample("d0"), Sample("d1", state="crashed")], "Not assessed since 2026-10-26: last judged ready"),
        ([Sample("d0"), Sample("d1", state=None)], "Not assessed since 2026-10-26: last judged ready"),
        (
            [Sample("d0"), Sample("d1", day=None, verdict="not_assessed")],
            "Not assessed since 2026-10-26: last judged ready",
        ),
        ([Sample("d0", day=None), EMPTY], "Not assessed: last judged ready"),
        ([BLIND], "Not assessed"),
        ([EMPTY, Sample("d0", verdict="not_assessed")], "Not assessed"),
    ],
)
def test_a_newest_mission_that_was_not_judged_is_no_leave(
    tmp_path: Path, missions: list[Sample], standing: str
) -> None:
    d = document(tmp_path, *missions)
    (m,) = d["machines"]
    assert (m["verdict"], m["standing"]) == ("not_assessed", standing)
    assert d["verdict"]["status"] == "not_assessed"
    page = build_fleet_page(d)
    assert "machines are ready" not in page
    assert "machine is ready" not in page
    assert 'class="card verdict not_assessed"' in page
    assert standing in page


@pytest.mark.parametrize(("late", "words"), [(1, "its last mission"), (2, "its last 2 missions")])
def test_a_note_counts_the_missions_that_were_not_judged(tmp_path: Path, late: int, words: str) -> None:
    blind = [Sample(f"d{k + 1}", day=k + 1.0, verdict="not_assessed") for k in range(late)]
    (m,) = document(tmp_path, Sample("d0"), *blind)["machines"]
    assert m["note"].startswith(f"{words} showed no fault, but did not clear the machine")


def test_an_earlier_mission_that_was_not_judged_takes_nothing_away(tmp_path: Path) -> None:
    d = document(tmp_path, Sample("d0", verdict="not_assessed"), *READY[1:])
    assert d["verdict"]["title"] == "The machine may go out"


@pytest.mark.parametrize(("day", "verdict"), [(0.9, "ready"), (1.1, "not_assessed")])
def test_a_log_that_was_there_before_the_last_mission_began_is_older(tmp_path: Path, day: float, verdict: str) -> None:
    write_object(tmp_path, 2, "d1", 1.5)
    write_object(tmp_path, 3, "d2", day)
    assert document(tmp_path, *READY, EMPTY)["machines"][0]["verdict"] == verdict


def test_an_empty_log_is_as_new_as_its_own_name_though_an_older_one_was_empty_too(tmp_path: Path) -> None:
    write_object(tmp_path, 2, "d1", 1.5)
    write_object(tmp_path, 3, "another", 0.1)
    assert document(tmp_path, *READY, EMPTY)["machines"][0]["verdict"] == "not_assessed"


def test_a_log_whose_clock_runs_ahead_makes_no_other_one_older(tmp_path: Path) -> None:
    write_object(tmp_path, 2, "d1", 0.5)
    write_object(tmp_path, 3, "d2", 0.9)
    assert document(tmp_path, *READY, EMPTY)["machines"][0]["verdict"] == "not_assessed"


@pytest.mark.parametrize(
    ("verdict", "severity", "standing"),
    [
        ("stop", "high", "Stop and repair, and its newest mission did not clear the machine"),
        ("watch", "low", "Faults to watch, and its newest mission did not clear the machine"),
    ],
)
def test_a_finding_stays_though_later_missions_gave_no_verdict(
    tmp_path: Path, verdict: str, severity: str, standing: str
) -> None:
    d = document(tmp_path, Sample("d0", verdict=verdict, faults=[Fault(severity=severity)]), BLIND)
    assert (d["machines"][0]["verdict"], d["machines"][0]["standing"]) == (verdict, standing)


@pytest.mark.parametrize(
    ("verdict", "cleared", "shown", "standing"),
    [
        ("watch", True, "watch", "Ready, with faults to watch"),
        ("watch", False, "watch", "Faults to watch, not cleared"),
        ("watch", None, "watch", "Faults to watch"),
        ("ready", True, "ready", "Ready"),
        ("ready", False, "not_assessed", "Not assessed since 2026-10-26: last judged ready, but not cleared"),
    ],
)
def test_what_is_not_cleared_is_not_worded_as_ready(
    tmp_path: Path, verdict: str, cleared: bool | None, shown: str, standing: str
) -> None:
    samples.write_report(tmp_path, "d0", cleared)
    d = document(tmp_path, Sample("d0", verdict=verdict, faults=[Fault()] if verdict == "watch" else ()))
    assert (d["machines"][0]["verdict"], d["machines"][0]["standing"]) == (shown, standing)


NO_SIGNAL = Sample("z", "", state="degraded", verdict="not_assessed", day=None, parts=(), reason="no wheel speed")


def test_a_clock_that_is_ahead_hides_no_stop(tmp_path: Path) -> None:
    write_object(tmp_path, 1, "ahead", 0.5)
    write_object(tmp_path, 2, "real", 1.5)
    ahead, real = Sample("ahead", day=365.0 * 70), Sample("real", day=1.0, verdict="stop")
    d = document(tmp_path, ahead, real)
    (m,) = d["machines"]
    assert (m["standing"], m["note"]) == ("Stop and repair", "1 mission of unknown order")
    assert d["counts"]["last_ns"] == START_NS + DAY_NS
    assert "2096" not in build_fleet_page(d)


@pytest.mark.parametrize(("day", "undated"), [(1.4, 0), (1.6, 1)])
def test_a_clock_may_say_another_time_zone(tmp_path: Path, day: float, undated: int) -> None:
    write_object(tmp_path, 1, "a", 0.5)
    assert document(tmp_path, Sample("a", day=day))["counts"]["undated"] == undated


@pytest.mark.parametrize(
    ("verdict", "cleared", "standing"),
    [
        ("watch", True, "Ready, with faults to watch"),
        ("watch", False, "Faults to watch, not cleared"),
        ("watch", None, "Faults to watch"),
        ("ready", False, "Not assessed since 2026-10-26: last judged ready, but not cleared"),
    ],
)
def test_a_mission_that_may_be_the_last_is_cleared_too(
    tmp_path: Path, verdict: str, cleared: bool | None, standing: str
) -> None:
    samples.write_report(tmp_path, "a", True)
    samples.write_report(tmp_path, "b", cleared)
    found = [Fault()] if verdict == "watch" else []
    d = document(tmp_path, *(Sample(n, day=t, verdict=verdict, faults=found) for n, t in (("a", 0.0), ("b", None))))
    assert d["machines"][0]["standing"] == standing


@pytest.mark.parametrize(
    ("between", "severity", "verdict"), [("....", "medium", "stop"), (".", "medium", "stop"), ("b", "high", "stop")]
)
def test_a_fault_that_comes_back_is_as_severe_as_it_is_now(
    tmp_path: Path, between: str, severity: str, verdict: str
) -> None:
    part = ("FR", "sensor")
    old, new = (Fault(*part, "stuck", s) for s in ("high", "medium"))
    middle = [Sample(f"m{k}", day=k, blind=[part] if b == "b" else []) for k, b in enumerate(between, 1)]
    last = Sample("m9", day=9.0, verdict="watch", faults=[new])
    d = document(tmp_path, Sample("m0", verdict="stop", faults=[old]), *middle, last)
    assert (d["faults"][0]["severity"], d["machines"][0]["verdict"]) == (severity, verdict)


@pytest.mark.parametrize(
    ("missions", "told"),
    [
        ([Sample("a")], "every part judged long enough in the last mission"),
        ([Sample("a"), Sample("b", day=None)], "every part judged long enough in the last mission"),
        ([Sample("a", blind=[("FR", "sensor")])], "1 part not judged long enough in the last mission"),
        ([NO_SIGNAL], "nothing judged"),
        (
            [Sample("a", day=None, verdict="not_assessed", blind=samples.PARTS)],
            "which parts the last mission of HX-1 judged is not known",
        ),
        (
            [Sample("a"), Sample("b", "HX-2", state="crashed")],
            "which parts the last mission of HX-2 judged is not known",
        ),
        ([Sample("a"), Sample("b", state="crashed")], "which parts the last mission of HX-1 judged is not known"),
    ],
)
def test_every_part_is_assessed_only_where_that_is_known(tmp_path: Path, missions: list[Sample], told: str) -> None:
    page = build_fleet_page(document(tmp_path, *missions))
    assert re.findall('of driving time judged</dt>.*?class="more">([^<]*)', page) == [told]


def test_logs_not_read_and_missions_not_assessed_are_both_counted(tmp_path: Path) -> None:
    bad = [Sample(f"u{k}", state="unreadable") for k in range(2)]
    open_ = [Sample(f"n{k}", day=k + 1.0, verdict="not_assessed") for k in range(2)]
    text = document(tmp_path, Sample("a"), *bad, *open_)["verdict"]["text"]
    assert "2 logs could not be read; 2 missions found no fault, but did not clear their machine." in text


@pytest.mark.parametrize(("n", "more"), [(5, ""), (12, ""), (15, " and 3 more: listed below")])
def test_all_machines_that_must_not_go_out_are_named(tmp_path: Path, n: int, more: str) -> None:
    stuck = [Fault(mode="stuck", severity="high")]
    text = document(tmp_path, *(Sample(f"{k}", f"M{k:02d}", verdict="stop", faults=stuck) for k in range(n)))
    named = ", ".join(f"M{k:02d}" for k in range(min(n, 12)))
    assert f"Must not go out ({n}): {named}{more}." in text["verdict"]["text"]


def test_what_must_not_go_out_is_told_before_what_was_not_assessed(tmp_path: Path) -> None:
    stuck = Sample("a", "HX-1", verdict="stop", faults=[Fault(mode="stuck", severity="high")])
    blind = Sample("b", "HX-2", verdict="not_assessed")
    text = document(tmp_path, stuck, blind)["verdict"]["text"]
    assert text[:3] == [
        "HX-1 – stop and repair: RL drive valve stuck.",
        "HX-2 – not assessed: check it before it goes out.",
        "1 mission found no fault, but did not clear its machine.",
    ]


def test_a_machine_without_any_part_that_was_assessed_shows_so(tmp_path: Path) -> None:
    d = document(tmp_path, Sample("a", faults=[Fault()]), Sample("b", "HX-2", verdict="not_assessed", parts=[]))
    rows = {label: cells for label, cells, _ in matrix(d["machines"]).rows}
    assert len(rows["HX-2"]) == 12
    assert all("never judged long enough" in c for c in rows["HX-2"])


def test_a_damaged_log_is_no_work_to_do(tmp_path: Path) -> None:
    d = document(
        tmp_path,
        Sample("a", "M1", verdict="watch"),
        Sample("b", "M2"),
        Sample("c", "M3", verdict="stop", faults=[Fault()]),
    )
    assert d["verdict"]["title"] == "1 of 3 machines must not go out, 1 may go out, 1 must be checked first"
    standing = {m["id"]: m["standing"] for m in d["machines"]}
    assert standing["M1"] == "No fault found, but its last log is damaged"
    d = document(tmp_path / "two", Sample("a", "M1", verdict="watch"), Sample("b", "M2"))
    assert d["verdict"]["title"] == "1 of 2 machines may go out, 1 must be checked first"
    assert (d["verdict"]["status"], d["verdict"]["tag"]) == ("watch", "1 machine: damaged logs")
    d = document(tmp_path / "one", Sample("a", "M1", verdict="watch"))
    assert d["verdict"]["title"] == "The machine must be checked before it goes out"


@pytest.mark.parametrize(
    ("verdicts", "title"),
    [
        (["ready"], "The machine may go out"),
        (["stop"], "The machine must not go out"),
        (["ready", "ready", "ready"], "All 3 machines may go out"),
        (["stop", "stop"], "Both machines must not go out"),
        (["stop", "ready", "not_assessed"], "1 of 3 machines must not go out, 1 may go out, 1 must be checked first"),
        (["not_assessed", "not_assessed"], "Both machines must be checked before they go out"),
    ],
)
def test_the_headline_counts_machines_as_the_lists_do(tmp_path: Path, verdicts: list[str], title: str) -> None:
    stuck = [Fault(mode="stuck", severity="high")]
    d = document(
        tmp_path,
        *(Sample(f"{k}", f"M{k}", verdict=v, faults=stuck if v == "stop" else []) for k, v in enumerate(verdicts)),
    )
    assert d["verdict"]["title"] == title


@pytest.mark.parametrize(
    ("verdicts", "sure", "tag"),
    [
        (["watch", "ready", "ready"], True, "1 machine: faults to watch"),
        (["watch", "not_assessed"], False, "2 machines to check"),
        (["watch", "not_assessed"], True, "1 machine to check"),
        (["stop", "not_assessed"], False, "1 machine: stop and repair"),
    ],
)
def test_the_few_words_above_the_headline_count_as_it_does(verdicts: list[str], sure: bool, tag: str) -> None:
    apart = {"unjudged": False, "newest": [], "faults": [SimpleNamespace(standing=True)]}
    machines = [cast(Machine, SimpleNamespace(verdict=Verdict(v), cleared=sure, **apart)) for v in verdicts]
    assert headline(machines)[1] == tag


def test_missions_that_count_are_told_from_all(tmp_path: Path) -> None:
    d = document(
        tmp_path,
        Sample("a", copies=["copy"]),
        Sample("b", day=1.0),
        Sample("c", state="unreadable"),
        Sample("d", state=None),
    )
    assert (d["counts"]["missions"], d["counts"]["counted"]) == (5, 2)
    assert "2 missions, of 5 logs" in build_fleet_page(d)


def test_a_copy_adds_nothing_to_what_was_not_assessed_and_the_figures_add_up(tmp_path: Path) -> None:
    fault = [Fault(mode="stuck", severity="high")]
    d = document(
        tmp_path,
        Sample("a", copies=["copy"], verdict="not_assessed"),
        Sample("b", day=1.0, verdict="stop", faults=fault),
    )
    assert d["counts"]["not_assessed"] == 1
    assert any("1 mission found no fault, but did not clear its machine." in line for line in d["verdict"]["text"])
    assert "2 with a report, 1 copy; 1 not assessed or not cleared" in build_fleet_page(d)


def test_parts_that_the_last_mission_did_not_assess_are_named(tmp_path: Path) -> None:
    d = document(tmp_path, Sample("a"), Sample("b", day=1.0, blind=[("rear", "sensor"), ("RL", "actuator")]))
    assert "RL drive valve and rear steering sensor – <a" in build_fleet_page(d)


def test_a_file_that_was_left_out_is_no_damage(tmp_path: Path) -> None:
    reason = "plc.csv was left out: its clock could not be compared with a.mcap: nothing in common"
    apart = Sample("a", "M1", state="degraded", verdict="watch", reason=reason, left_out=True)
    d = document(tmp_path, apart, Sample("b", "M2"))
    standing = {m["id"]: m["standing"] for m in d["machines"]}
    assert standing["M1"] == "No fault found, but a file of its last log was left out"
    assert d["verdict"]["title"] == "1 of 2 machines may go out, 1 must be checked first"
    assert d["verdict"]["tag"] == "1 machine: files left out"


def test_the_terminal_says_why_a_machine_is_not_assessed(tmp_path: Path) -> None:
    cut = Sample("cut", day=0.0, verdict="not_assessed", state="degraded", reason="cut off")
    d = document(tmp_path, Sample("d0"), cut, Sample("d1", day=1.0))
    (m,) = listed_machines(d)  # type: ignore[arg-type]
    assert m.words.startswith("Not assessed since")
    assert m.words.endswith("(2 missions of unknown order)")


def test_counts_add_up_and_are_said_once() -> None:
    """*In 1 of the 1 mission*, and *5 faults that stand: …, 1 repaired*, which add to six."""
    assert found_in(1, 1) == "in the one mission that judged the part"
    assert found_in(4, 4) == "in all 4 missions that judged the part"
    assert found_in(1, 3) == "in 1 of the 3 missions that judged the part"
    none = dict.fromkeys(("new", "recurring", "once", "past", "repaired"), 0)
    assert of_faults({**none, "new": 1, "once": 3, "repaired": 1}) == "1 new, 3 found once; beside them 1 repaired"
    assert of_faults({**none, "past": 2}) == "none, 2 past"
    assert of_faults(none) == "none was ever found"
