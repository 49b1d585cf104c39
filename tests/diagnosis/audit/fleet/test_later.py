"""Missions after the last one that gave a verdict."""

from __future__ import annotations

from pathlib import Path

from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.audit.fleet.leave import lists_of
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from tests import fleet_samples as samples
from tests.fleet_samples import Fault, Sample


def document(tmp_path: Path, *missions: Sample) -> FleetDocument:
    return fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", missions)))


def test_a_damaged_log_does_not_count_as_clean(tmp_path: Path) -> None:
    """What it does not show may be in what is lost of it."""
    dead = Sample("a", faults=[Fault(component="RR", side="sensor", mode="no_signal", severity="high")])
    for more, clean in (({}, 1), ({"state": "degraded", "verdict": "not_assessed"}, 0)):
        d = document(tmp_path / str(clean), dead, Sample("b", day=1.0, **more))  # type: ignore[arg-type]
        (fault,) = d["faults"]
        assert fault["clean"] == clean


def test_the_missions_that_may_be_later_are_named(tmp_path: Path) -> None:
    stuck = Sample("a", verdict="stop", faults=[Fault(mode="stuck", severity="high")])
    d = document(tmp_path, stuck, Sample("later", day=1.0, verdict="not_assessed"))
    (left,) = lists_of(d)
    assert "1 newer mission (later) did not clear the machine" in left.reason
    unread = document(tmp_path / "unread", stuck, Sample("lost", state="unreadable", day=None, verdict="stop"))
    (left,) = lists_of(unread)
    assert "1 mission that may be later (lost) was not judged" in left.reason
