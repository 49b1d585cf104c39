"""Whose log it may be that names no machine itself: the machine that alone has judged missions around it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

from diagnosis.audit.fleet_read import Mission, Result

Owner = tuple[str, str]


def owner_of(result: Result) -> Owner:
    """Identity of a machine; its name where it has none."""
    return result.machine_id, "" if result.machine_id else result.machine_name


def owners_by_folder(missions: Iterable[Mission]) -> dict[str, set[Owner]]:
    """Machines of the judged missions at or below each folder."""
    out: dict[str, set[Owner]] = defaultdict(set)
    for m in missions:
        if m.result is not None and m.result.judged:
            for folder in _folders(m):
                out[folder].add(owner_of(m.result))
    return out


def guess(mission: Mission, owners: dict[str, set[Owner]]) -> Owner | None:
    """The machine of the closest folder around a log that has judged missions; None where several share it."""
    found = next((owners[f] for f in _folders(mission) if f in owners), set())
    return next(iter(found)) if len(found) == 1 else None


def _folders(mission: Mission) -> Iterator[str]:
    """Folders of a mission's first file, closest first, the last without a name."""
    path = mission.files[0] if mission.files else ""
    while path:
        path = path.rpartition("/")[0]
        yield path
