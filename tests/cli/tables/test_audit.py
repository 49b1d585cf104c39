from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from cli.tables.audit import document, summary_parts
from diagnosis.audit.discovery.discover import Discovery
from diagnosis.audit.endings import Ending
from diagnosis.audit.fleet.listed import ListedMachine
from diagnosis.audit.session import Audited
from diagnosis.audit.store.outcome import MissionState
from diagnosis.results.vocabulary import Verdict


def ending(name: str, state: str, verdict: str | None = None, machine: str = "M1", report: str | None = None) -> Ending:
    return Ending(
        name,
        MissionState(state),
        "[/] why" if state != "ok" else "",
        1,
        machine,
        "Haulotte",
        verdict,
        "",
        report,
        0,
        "",
    )


M2 = ListedMachine("M2", Verdict.STOP, "Stop and repair", ("FR speed sensor stuck", "b", "c"), 2, 9)
M1 = ListedMachine("M1", Verdict.READY, "Ready", (), 0, 4)


def printed(*ends: Ending, machines: tuple[ListedMachine, ...] = (M2, M1)) -> list[str]:
    console = Console(file=io.StringIO(), width=100, markup=False)
    for part in summary_parts(
        Audited(ends, 2, sum(e.state == "crashed" for e in ends), 0, machines), Discovery(()), Path("out")
    ):
        console.print(part)
    assert isinstance(console.file, io.StringIO)
    return [line.rstrip() for line in console.file.getvalue().splitlines() if line.strip()]


def test_failures_stand_first_then_machines_then_counts_and_the_page() -> None:
    ends = (
        ending("a", "unreadable"), ending("b", "crashed"), ending("c", "ok", "stop", "M2"), ending("d", "ok", "watch"),
        ending("e", "degraded", "not_assessed"), ending("f", "ok", "ready"),
    )  # fmt: skip
    assert printed(*ends) == [
        "Failed",
        "• crashed  b  [/] why",
        "• unreadable  a  [/] why",
        "Machines, worst first",
        "machine  now              faults                       missions with faults",
        "M2       Stop and repair  FR speed sensor stuck; b +1                2 of 9",
        "M1       Ready            –                                          0 of 4",
        "Missions",
        "stop and repair: 1 · faults to watch: 1 · ready: 1 · not assessed or not cleared: 1 · unreadable: 1",
        "· crashed: 1",
        "6 in all, 2 of them from an earlier run, 1 with damage, or in part left out",
        "damaged, or in part left out: e",
        "fleet page  out/fleet.html",
        "failures    out/failures.txt",
    ]


def test_missions_of_which_drives_were_not_judged_are_named_too() -> None:
    some = replace(M1, in_part=("e", "f", "gone"))
    lines = printed(ending("e", "degraded", "not_assessed"), ending("f", "ok", "not_assessed"), machines=(some,))
    assert "damaged, or in part left out: e" in lines
    assert "not every part of a wheel judged long enough: f" in lines


def test_of_many_failures_some_are_shown() -> None:
    lines = printed(*(ending(f"m{i:02d}", "crashed") for i in range(30)))
    assert lines[11] == "… and 20 more"


def test_copies_are_named() -> None:
    lines = printed(*(ending(n, "ok", "ready", report=f"missions/{n[0]}") for n in ("a", "b", "b (1)")))
    assert "copies of one log, which count once: b, b (1)" in lines


def test_copies_in_the_folders_of_two_machines_are_told_though_each_has_a_report() -> None:
    ends = (ending("M1__a", "ok", "ready", "M1", report="1"), ending("M2__a", "ok", "ready", "M2", report="2"))
    lines = printed(*ends, machines=(M2, replace(M1, copies=(("M2__a", "M1__a"),))))
    assert "copies of one log, which count once: M1__a, M2__a" in lines
    assert not any("copies" in line for line in printed(*ends))


def test_missions_that_are_gone_are_told() -> None:
    console = Console(file=io.StringIO(), width=100, markup=False)
    for part in summary_parts(Audited((ending("a", "ok", "ready"),), 0, 0, 2), Discovery(()), Path("out")):
        console.print(part)
    assert isinstance(console.file, io.StringIO)
    assert "the fleet page also counts 2 missions that are no longer there" in console.file.getvalue()


def test_the_document_counts_states_and_verdicts() -> None:
    audited = Audited((ending("a", "ok", "ready"), ending("b", "timeout")), 1, 1)
    found = document(audited, Discovery((), ("nowhere: no such file",)), Path("out"), 3)
    assert found["counts"] == {"ok": 1, "timeout": 1}
    assert found["verdicts"] == {"ready": 1}
    assert found["problems"] == ["nowhere: no such file"]
    assert [m["name"] for m in found["missions"]] == ["a", "b"]


def test_a_report_from_before_a_repair_is_said_to_be_so_beside_its_mission() -> None:
    gone_out = replace(
        M1, leave="may go out", reason="no fault in its last mission", mission="M1/b", note="from before"
    )
    kept_in = replace(M2, leave="must not go out", reason="FR stuck", mission="M2/a", lead="– fault found in")
    lines = printed(machines=(kept_in, gone_out))
    assert "• M2 – FR stuck  – fault found in M2/a" in lines
    assert "• M1 – no fault in its last mission  M1/b (from before)" in lines
