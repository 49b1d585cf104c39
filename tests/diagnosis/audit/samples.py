"""Missions whose work is told by their file, and an audit over them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from diagnosis.audit import engines
from diagnosis.audit.discovery.discover import Discovery
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.endings import Ending
from diagnosis.audit.engines import Engine
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.plan import AuditOptions
from diagnosis.audit.session import audit

JUDGE = "poison:judge"
COLD = "fork-cold"
LIMITS = Limits(memory_mb=150, wall_s=3.0, file_mb=20)


def missions(folder: Path, *works: str) -> Discovery:
    """A mission per work, named after it; the file says what is to happen."""
    folder.mkdir(exist_ok=True)
    found = []
    for work in works:
        path = folder / f"{work}.bag"
        if not path.exists():
            path.write_text(f"{work.partition('-')[0]} {work}", encoding="utf-8")
        status = path.stat()
        stamp, size = str(status.st_mtime_ns), status.st_size
        found.append(MissionSource(work, (str(path),), size, (stamp,), sizes=(size,)))
    return Discovery(tuple(found), roots=(str(folder),))


Made = Callable[[], AbstractContextManager[Engine]]


def asked_for(output: Path, **changes: object) -> AuditOptions:
    return AuditOptions(output, **{"limits": LIMITS, "isolation": COLD, "judge": JUDGE, "retries": 0, **changes})  # type: ignore[arg-type]


def run(
    found: Discovery, asked: AuditOptions, engine: Made | None = None, jobs: int = 2
) -> tuple[dict[str, Ending], list[tuple[str, str]]]:
    """Audit; give the missions' ends by name, and the events about missions."""
    events: list[tuple[str, str]] = []

    def tell(event: str, facts: dict[str, object]) -> None:
        if "name" in facts:
            events.append((event, str(facts["name"])))

    audited = audit(found, asked, engine or (lambda: engines.local(jobs, COLD)), tell)
    return {end.name: end for end in audited.ends}, events
