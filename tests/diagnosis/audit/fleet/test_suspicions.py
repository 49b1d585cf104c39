"""What an earlier mission held against a part stands beside the leave until something settles it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from diagnosis.audit.fleet.leave import Left, lists_of
from diagnosis.audit.fleet.listed import listed_machines
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.audit.store.repairs import Repair, record_repair
from diagnosis.audit.store.store import Store
from diagnosis.results.vocabulary import Leave
from tests import fleet_samples as samples
from tests.fleet_contradictions import fleet_contradictions
from tests.fleet_samples import Fault, Sample

SAID = "The speed of RR per opening is 33 % below the other wheels' over the mission."
TOLD = "RR speed sensor and drive valve: the speed of RR per opening is 33 % below the other wheels' over the mission, on 2026-10-2"


def left_open(text: str = SAID, *, worst: float | None = 0.39, start_s: float | None = None) -> dict[str, Any]:
    """What a report leaves open of RR."""
    parts = [{"component": "RR", "side": side} for side in ("sensor", "actuator")]
    point = {"reason": text, "act": "look at it", "parts": parts, "fault": "", "why": ""}
    row = {
        "component": "RR",
        "passed": False,
        "worst": worst,
        "limit": 0.36,
        "start_s": start_s,
        "text": text.rstrip("."),
    }
    return {"verdict": {"cleared": False, "to_clear": [point]}, "clearing": [row]}


def audited(
    tmp_path: Path, more: dict[str, Any], healthy: int = 1, repair_day: float | None = None, after: Sample | None = None
) -> tuple[Left, str]:
    """A machine of one mission that left RR open and some healthy ones: its place in the lists, and where it stands."""
    open_one = Sample("a/0", "a", verdict="not_assessed")
    later = [Sample(f"a/{k}", "a", day=float(k)) for k in range(1, healthy + 1)]
    store = samples.write_store(tmp_path / "fleet.sqlite", [open_one, *later, *([after] if after else [])])
    samples.write_report(tmp_path, "a/0", more=more)
    for m in later:
        samples.write_report(tmp_path, m.name, cleared=True)
    if repair_day is not None:
        at = int(samples.START_NS + repair_day * samples.DAY_NS)
        with Store.open(tmp_path / "fleet.sqlite") as kept:
            record_repair(kept, Repair(("a", ""), "RR", "", at))
    document = fleet_json(load_fleet(store))
    assert fleet_contradictions(document) == []
    return lists_of(document)[0], listed_machines(document)[0].words


def test_a_healthy_mission_does_not_settle_what_one_before_it_saw(tmp_path: Path) -> None:
    one, words = audited(tmp_path, left_open())
    assert one.leave is Leave.MAY
    assert f"; not settled since: {TOLD}" in one.reason
    assert words == "Ready, but not settled what an earlier mission saw"


@pytest.mark.parametrize("how", ["repaired", "over", "a fault of it"])
def test_it_is_told_until_something_settles_it(tmp_path: Path, how: str) -> None:
    watch = Sample("a/z", "a", day=5.5, verdict="watch", faults=[Fault("RR", "sensor", "inefficient", "low")])
    one, _ = audited(
        tmp_path,
        left_open(),
        10 if how == "over" else 1,
        0.5 if how == "repaired" else None,
        watch if how == "a fault of it" else None,
    )
    assert "not settled" not in one.reason


def test_what_was_not_shown_or_hardly_off_is_held_against_no_part(tmp_path: Path) -> None:
    brief = "The speed of RR per opening is 33 % below the other wheels' at 75.0–78.0 s."
    unshown = left_open("RR: this mission leaves the check “speed per opening” open.", worst=None)
    for k, (more, told) in enumerate(
        [(left_open(brief, start_s=75.0), False), (left_open(brief, worst=0.6, start_s=75.0), True), (unshown, False)]
    ):
        one, _ = audited(tmp_path / str(k), more)
        assert ("not settled" in one.reason) is told
