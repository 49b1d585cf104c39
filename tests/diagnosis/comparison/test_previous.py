"""A report that keeps what became of the faults of the machine's other mission."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.comparison.previous import with_previous
from diagnosis.results.document import ReportDocument
from replay.errors import ConfigError
from tests.page_contradictions import of_losses
from tests.whole_documents import whole_report


def fault(mode: str, epsilon: float | None = None, component: str = "FR", name: str = "F1") -> dict[str, Any]:
    return {
        "id": name,
        "component": component,
        "kind": "wheel",
        "side": "sensor",
        "mode": mode,
        "start_s": 10.0,
        "stop_s": 15.0,
        "epsilon": epsilon and {"value": epsilon, "low": epsilon - 0.02, "high": epsilon + 0.02},
        "probability": 0.99,
        "severity": "high" if mode == "stuck" else "medium",
        "tier": "direct",
    }


def document(
    *faults: dict[str, Any], start_ns: int = 10**18, decided_s: float = 55.0, machine: str = "HX4-07", **more: Any
) -> ReportDocument:
    coverage = [
        {
            "component": component,
            "side": "sensor",
            "seconds": {"healthy": decided_s, "not_assessed": 60.0 - decided_s},
            "decided_driving_s": decided_s,
            "driving_s": 60.0,
            "tier": "direct" if decided_s else "none",
        }
        for component in ("FR", "FL")
    ]
    given = {
        "log": {"files": [{"path": "a.mcap", "sha256": f"{start_ns:x}"}], "start_ns": start_ns, "duration_s": 60.0},
        "machine": {"id": machine, "name": "Haulotte", "wheels": ["FR", "FL"], "axles": []},
        "verdict": {"status": "stop", "title": "1 fault to repair"},
        "intervals": list(faults),
        "coverage": coverage,
        **more,
    }
    return whole_report(given)


LATER = 10**18 + 10**12


def outcomes(report: ReportDocument) -> list[tuple[str, str]]:
    return [(c["trend"] or c["status"], c["component"]) for c in report["previous"]["faults"]]


def test_new_resolved_and_changed() -> None:
    older = document(fault("stuck"), fault("inefficient", 0.3, "FL", "F2"))
    newer = document(fault("inefficient", 0.6, "FL"), start_ns=LATER)
    got = with_previous(newer, older)
    assert got["previous"]["order"] == "earlier"
    assert outcomes(got) == [("worse", "FL"), ("resolved", "FR")]
    assert got["previous"]["counts"] == {"worse": 1, "resolved": 1}
    assert got["previous"]["worse"] is True
    assert got["previous"]["mission"]["machine_id"] == "HX4-07"
    assert "previous" not in newer


def test_what_is_no_longer_assessed_is_never_resolved() -> None:
    newer = document(start_ns=LATER, decided_s=0.0)
    got = with_previous(newer, document(fault("stuck")))["previous"]
    assert got["counts"] == {"not_seen_again": 1}
    assert [c["change"] for c in got["coverage"]] == ["lost", "lost"]


def test_order_goes_by_the_logs_clocks() -> None:
    got = with_previous(document(), document(fault("stuck"), start_ns=LATER))
    assert got["previous"]["order"] == "later"
    assert outcomes(got) == [("new", "FR")]


def test_losses_of_both() -> None:
    def loss(component: str, value: float) -> dict[str, Any]:
        epsilon = {"value": value, "low": value - 0.01, "high": value + 0.01}
        return {"component": component, "side": "actuator", "epsilon": epsilon, "seconds": 40.0, "relative": False}

    newer = document(start_ns=LATER, loss=[loss("FR", 0.2), loss("FL", 0.0)])
    got = with_previous(newer, document(loss=[loss("FR", 0.1)]))["previous"]["loss"]
    assert [(x["component"], x["older"]["value"], x["newer"]["value"]) for x in got] == [("FR", 0.1, 0.2)]
    assert with_previous(newer, document())["previous"]["loss"] == []


@pytest.mark.parametrize(
    ("now", "outcome"), [(0.44, "worse"), (0.26, "better"), (0.39, "unchanged"), (0.36, "unchanged")]
)
def test_a_loss_that_grows_is_told_of_its_fault(now: float, outcome: str) -> None:
    def mission(value: float, start_ns: int) -> ReportDocument:
        wide = fault("inefficient", value) | {"epsilon": {"value": value, "low": value - 0.2, "high": value + 0.2}}
        epsilon = {"value": value, "low": value - 0.002, "high": value + 0.002}
        row = {"component": "FR", "side": "sensor", "epsilon": epsilon, "seconds": 40.0, "relative": False}
        return document(wide, start_ns=start_ns, loss=[row])

    got = with_previous(mission(now, LATER), mission(0.35, 10**18))
    assert outcomes(got) == [(outcome, "FR")]
    assert not list(of_losses(got))
    if outcome != "unchanged":
        got["previous"]["faults"][0]["status"] = "unchanged"
        assert list(of_losses(got))


def test_another_machine_is_refused() -> None:
    with pytest.raises(
        ConfigError, match=r"^--previous monday: is of machine HX4-09, this mission of machine HX4-07; "
    ):
        with_previous(document(start_ns=LATER), document(machine="HX4-09"), "monday")
    other = document()
    other["machine"]["wheels"] = ["left", "right"]
    with pytest.raises(ConfigError, match="wheels left, right, this mission of one with FR, FL"):
        with_previous(document(start_ns=LATER), other, "monday")
