"""A short form of `tests/benchmarks/all_clear.py`: faults that no machine may be cleared with, by every level of evidence."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from tests.campaigns import campaign

BENCHMARKS = Path(__file__).parent / "benchmarks"
DEAD = "FR valve dead, whole"
TIERS = ("base", "spool", "direct")
KINDS = (
    DEAD,
    "FL valve loses .5, whole",
    "RL sensor reads 1.35, whole",
    "front steering valve dead, whole",
    "front steering valve biased .1, whole",
    "both steering valves dead, whole",
    "RR sensor late by .4 s",
    "FR and RL speeds swapped",
)


@pytest.fixture(scope="module")
def all_clear() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import all_clear

    yield all_clear
    sys.path.remove(str(BENCHMARKS))


@pytest.mark.turns("tier")
@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("kind", KINDS)
def test_no_machine_is_cleared_with_a_fault(all_clear: ModuleType, kind: str, tier: str) -> None:
    assert all_clear.TIERS == TIERS
    names = [t.name for t in all_clear.troubles(60.0)]
    found = all_clear.run(all_clear.Task("default", names.index(kind), 11, 60.0, (tier,)))
    assert [o.tier for o in found] == [tier]
    assert [(o.tier, o.words) for o in found if o.outcome == "cleared"] == []


def test_a_wheel_that_stands_out_is_named_and_stays_open(all_clear: ModuleType) -> None:
    """Its checks alone name it: which part fails is not known, and another wheel's faults may look like it."""
    names = [t.name for t in all_clear.troubles(75.0)]
    kind = names.index("FR sensor reads 1.35, first third")
    (found,) = all_clear.run(all_clear.Task("default", kind, 326, 75.0, ("base",)))
    assert (found.outcome, found.status) == ("named", "watch")
    assert "FR excess" in found.words


def test_what_slowly_grows_beside_the_other_wheels_is_not_cleared(all_clear: ModuleType) -> None:
    names = [t.name for t in all_clear.troubles(75.0)]
    kind = names.index("RR valve comes to open 1.4, whole")
    (found,) = all_clear.run(all_clear.Task("default", kind, 1207, 75.0, ("base",)))
    assert found.outcome == "abstained"
    assert "RR change" in found.words


def test_a_sensor_that_the_mission_hardly_shows_to_be_wrong_does_not_count(all_clear: ModuleType) -> None:
    """It reads nothing while its wheel is slow, which that hardly is in 20 s."""
    kind = [t.name for t in all_clear.troubles(20.0)].index("RL sensor deaf to small values")
    assert all_clear.run(all_clear.Task("default", kind, 11, 20.0, ("base",))) == []


@pytest.mark.parametrize("seeds", campaign([(21,), (21, 22)]), ids=len)
def test_healthy_machines_are_not_stopped_and_mostly_cleared(all_clear: ModuleType, seeds: tuple[int, ...]) -> None:
    found = [o for seed in seeds for o in all_clear.run(all_clear.Task("default", None, seed, 60.0, all_clear.TIERS))]
    assert not any(o.status == "stop" for o in found)
    assert sum(o.status == "ready" for o in found) >= len(found) / 2


@pytest.mark.turns("tier")
@pytest.mark.parametrize("tier", ["direct", "base"])
@pytest.mark.parametrize("kind", [None, DEAD])
def test_a_machine_of_other_physics_is_judged_alike(all_clear: ModuleType, kind: str | None, tier: str) -> None:
    """Its steering valves answer behind a lag, in a log slower than its controller."""
    names = [t.name for t in all_clear.troubles(60.0)]
    (found,) = all_clear.run(all_clear.Task("hydrostatic", kind and names.index(kind), 509, 60.0, (tier,)))
    assert found.wrong_high == 0
    assert found.outcome != "cleared"


def test_a_machine_of_elastic_tyres_and_overlapping_valves_is_driven_soundly(all_clear: ModuleType) -> None:
    """Its wheels and axles follow what is asked of them."""
    physics = all_clear.electrohydraulic
    for seed in (502, 515):
        ref, true, read, *_ = physics.driven(seed, (), 40.0)
        top = physics.build(seed)[0].top
        assert np.abs(read[:, :4] - ref[:, :4]).mean() < 0.03 * top
        assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.02 * top
        assert np.abs(read[:, 4:] - ref[:, 4:]).mean() < 0.02


@pytest.mark.parametrize("tier", campaign(["base", "direct"]))
def test_a_dead_valve_among_elastic_tyres_and_overlapping_valves_is_no_all_clear(
    all_clear: ModuleType, tier: str
) -> None:
    names = [t.name for t in all_clear.troubles(60.0)]
    (found,) = all_clear.run(all_clear.Task("electrohydraulic", names.index(DEAD), 502, 60.0, (tier,)))
    assert found.tier == tier
    assert found.outcome not in ("cleared", "crashed")


def test_nobody_is_blamed_where_a_speed_loop_hunts(all_clear: ModuleType) -> None:
    made = all_clear.hydrostatic.build(1002, hunting=True)
    signals = all_clear.hydrostatic.signals(1002, (), 75.0, "base", hunting=True)
    report = all_clear.diagnose_signals(signals, all_clear.hydrostatic.machine_of(made)).report
    assert [f["id"] for f in report["intervals"] if f["severity"] != "info"] == []
    assert report["verdict"]["title"] == "The wheels swing together"


def test_the_calibration_error_of_a_campaign_is_that_of_its_bins(all_clear: ModuleType) -> None:
    import campaign_tables

    p, right = np.array([0.55, 0.58, 0.95, 0.93, 1.0]), np.array([True, False, True, True, True])
    expected = (abs(0.55 + 0.58 - 1) + abs(0.95 + 0.93 + 1.0 - 3)) / 5
    assert campaign_tables.ece(p, right) == pytest.approx(expected)
    usual, most = campaign_tables.ece_of_calibrated(np.full(100, 0.6))
    assert usual == pytest.approx(np.sqrt(0.6 * 0.4 / 100 * 2 / np.pi), rel=0.05)  # mean size of a normal error
    assert most > usual
    names = [t.name for t in all_clear.troubles(60.0)]
    (found,) = all_clear.run(all_clear.Task("default", names.index(DEAD), 11, 60.0, ("spool",)))
    assert found.claims
    assert all(0.0 < probability <= 1.0 for probability, _ in found.claims)
    lines = list(campaign_tables.claims_table([found], TIERS))
    assert len(lines) == 2
    assert lines[1].startswith("spool")
    assert f"of {len(found.claims)} (" in lines[1]
