"""Which way children start: what takes the least for an audit's missions, within the memory that each may take."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from diagnosis.api.audit_request import AuditRequest
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.isolation.run import isolation_for

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="children are forked on Linux")


@pytest.mark.parametrize(
    ("missions", "memory_mb", "kind"), [(1, 4096.0, "fork-cold"), (2, 1024.0, "fork-cold"), (2, 1000.0, ""), (3, 4096.0, "")]
)  # fmt: skip
def test_a_made_up_mission_is_for_many(missions: int, memory_mb: float, kind: str) -> None:
    assert isolation_for(missions, Limits(memory_mb=memory_mb)) == kind


@pytest.mark.parametrize(("count", "kind"), [(2, "fork-cold"), (3, "")])
def test_an_audit_asks_for_its_missions(
    count: int, kind: str, make_mission: Callable[..., MissionSource], tmp_path: Path
) -> None:
    logs = [make_mission(f"m{i}", b"log %d" % i).files[0] for i in range(count)]
    request = AuditRequest(tuple(logs), tmp_path / "out", memory_mb=2000.0)
    found, asked = request.found()
    assert (len(found.missions), asked.isolation) == (count, kind)
    (clustered,) = {AuditRequest(tuple(logs), tmp_path / "out", dask="tcp://a:1").found()[1].isolation}
    assert clustered == ""
