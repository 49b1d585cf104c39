"""An audit against an earlier one: nothing that is no longer judged counts as resolved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from diagnosis.audit.fleet.page.changes import changes_of
from diagnosis.audit.fleet_files import fleet_json, load_fleet, write_fleet
from replay.errors import ConfigError
from tests import fleet_samples as samples
from tests.fleet_samples import Fault, Sample, bounds

VALVE = ("RL", "actuator")


def compared(tmp_path: Path, older: list[Sample], newer: list[Sample]) -> dict[str, Any]:
    before = samples.write_store(tmp_path / "before/fleet.sqlite", older)
    now = samples.write_store(tmp_path / "now/fleet.sqlite", newer)
    found: dict[str, Any] = fleet_json(load_fleet(now), before)["baseline"]
    return found


def outcomes(found: dict[str, Any]) -> list[str]:
    return [f["outcome"] for f in found["faults"]]


BAD = Sample("a", verdict="watch", faults=[Fault(epsilon=bounds(0.2))])


def test_an_audit_against_itself_changes_nothing(tmp_path: Path) -> None:
    found = compared(tmp_path, samples.few(), samples.few())
    assert set(outcomes(found)) == {"unchanged"}
    assert not found["worse"]
    assert found["coverage"] == []
    assert found["machines"] == {"new": [], "missing": [], "changed": []}


@pytest.mark.parametrize(
    ("later", "outcome", "words"),
    [
        ([Sample("b", day=1.0)], "unchanged", ""),  # one sound mission refutes nothing that comes and goes
        ([Sample(f"{k}", day=k + 1.0) for k in range(3)], "resolved", "3 missions"),
        ([Sample(f"{k}", day=k + 1.0, blind=[VALVE]) for k in range(3)], "unchanged", ""),
    ],
)
def test_a_growing_store(tmp_path: Path, later: list[Sample], outcome: str, words: str) -> None:
    found = compared(tmp_path, [BAD], [BAD, *later])
    assert outcomes(found) == [outcome]
    assert words in found["faults"][0]["note"]


@pytest.mark.parametrize(
    ("newer", "outcome", "words"),
    [
        ([Sample("b", day=1.0)], "resolved", "later mission"),
        ([Sample("b", day=1.0, blind=[VALVE])], "not_seen_again", "no longer judged long enough"),
        ([Sample("b", day=1.0, parts=[("FR", "sensor")])], "not_seen_again", "no longer judged long enough"),
        ([Sample("b", day=-1.0)], "not_seen_again", "no mission is later"),
        ([Sample("a")], "not_seen_again", "judged differently"),
        ([Sample("b", "HX-2", day=1.0)], "not_seen_again", "no judged mission"),
        ([Sample("b", day=1.0, state="crashed")], "not_seen_again", "no judged mission"),
    ],
)
def test_another_period(tmp_path: Path, newer: list[Sample], outcome: str, words: str) -> None:
    found = compared(tmp_path, [BAD], newer)
    assert outcomes(found) == [outcome]
    assert words in found["faults"][0]["note"]


@pytest.mark.parametrize(
    ("fault", "outcome", "changes"),
    [
        (Fault(epsilon=bounds(0.35)), "worse", ["epsilon"]),
        (Fault(epsilon=bounds(0.12)), "better", ["epsilon"]),
        (Fault(epsilon=bounds(0.24)), "unchanged", []),
        (Fault(epsilon=bounds(0.35, 0.3)), "unchanged", []),
        (Fault(severity="high", epsilon=bounds(0.12)), "worse", ["severity", "epsilon"]),
        (Fault(side="sensor_or_actuator", epsilon=bounds(0.2)), "unchanged", []),
    ],
)
def test_a_fault_of_both(tmp_path: Path, fault: Fault, outcome: str, changes: list[str]) -> None:
    found = compared(tmp_path, [BAD], [Sample("b", day=1.0, verdict="watch", faults=[fault])])
    assert outcomes(found) == [outcome]
    assert found["faults"][0]["changes"] == changes
    assert found["worse"] == (outcome == "worse")


def test_more_often_is_worse(tmp_path: Path) -> None:
    older = [Sample(f"{k}", day=float(k), faults=[Fault()] if k == 9 else []) for k in range(10)]
    newer = [Sample(f"n{k}", day=20.0 + k, faults=[Fault()] if k % 2 else []) for k in range(10)]
    found = compared(tmp_path, older, newer)
    assert outcomes(found) == ["worse"]
    assert found["faults"][0]["changes"] == ["frequency"]


@pytest.mark.parametrize(
    ("older", "words"),
    [
        ([Sample("a", blind=[VALVE])], "may be older"),
        ([Sample("a", "HX-2")], "no judged mission"),
        ([Sample("a")], ""),
    ],
)
def test_a_new_fault_says_whether_it_could_be_seen_before(tmp_path: Path, older: list[Sample], words: str) -> None:
    found = compared(tmp_path, older, [Sample("b", day=1.0, faults=[Fault()])])
    assert outcomes(found) == ["new"]
    assert found["worse"]
    assert words in found["faults"][0]["note"]


def test_coverage_and_machines(tmp_path: Path) -> None:
    older = [Sample("a"), Sample("x", "gone", day=1.0)]
    newer = [Sample("b", day=1.0, blind=[VALVE], verdict="stop"), Sample("y", "new", day=1.0)]
    found = compared(tmp_path, older, newer)
    assert [(c["machine"], c["component"], c["side"], c["change"]) for c in found["coverage"]] == [
        ("HX-1", *VALVE, "lost")
    ]
    assert found["machines"]["new"] == ["new"]
    assert found["machines"]["missing"] == ["gone"]
    assert found["worse"]
    assert found["machines"]["changed"] == [{"machine": "HX-1", "older": "ready", "newer": "stop"}]


def test_missing_machines_and_missions_are_worse_and_told(tmp_path: Path) -> None:
    older = [Sample(f"{m}/{k}", m, float(k)) for m in ("HX-1", "HX-2", "HX-3") for k in range(3)]
    found = compared(tmp_path, older, older[:2])
    assert found["worse"]
    assert found["machines"]["missing"] == ["HX-2", "HX-3"]
    assert len(found["missions"]["missing"]) == 7
    changes = changes_of(found, {})
    assert changes
    assert changes["headline"].startswith("2 machines and 7 missions of the earlier audit are missing. ")
    assert changes["notes"][-1].startswith("Missions missing: HX-1/2, HX-2/0, ")


def test_missions_of_another_period_are_not_missing(tmp_path: Path) -> None:
    found = compared(tmp_path, [Sample("a")], [Sample("b", day=1.0)])
    assert not found["worse"]
    assert found["missions"]["missing"] == []


@pytest.mark.parametrize("baseline", ["", "fleet.sqlite", "../now"])
def test_the_own_store_is_no_baseline(tmp_path: Path, baseline: str) -> None:
    store = samples.write_store(tmp_path / "now/fleet.sqlite", [Sample("a")])
    with pytest.raises(ConfigError, match="is the store of this audit itself"):
        write_fleet(store, store.parent, baseline=store.parent / baseline)


def test_a_log_that_could_not_be_read_is_new_and_does_not_count(tmp_path: Path) -> None:
    """As the headline has it, which counts missions with a report."""
    found = compared(tmp_path, [Sample("a")], [Sample("a"), Sample("b", day=1.0), Sample("c", state="crashed")])
    told = changes_of(found, {})
    assert told
    assert told["missions"] == "3 missions now, 1 mission then; 2 missions new, 1 of them with a report"
    told = changes_of(compared(tmp_path / "all", [Sample("a")], [Sample("a"), Sample("b", day=1.0)]), {})
    assert told
    assert told["missions"] == "2 missions now, 1 mission then; 1 mission new"
