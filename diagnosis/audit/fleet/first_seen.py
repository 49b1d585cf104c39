"""When an audit first saw a mission, by the clock of the computer that audits: a log was there by then.

The result objects beside the store say it; the clocks of logs and files do not count. A log that was there before another
mission began is the older of the two, even where nothing in it can be read.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import orjson

from diagnosis.audit.fleet.read import Mission
from diagnosis.audit.store.objects import Objects
from diagnosis.audit.store.store import RESULTS
from replay.errors import OutputError

FirstSeen = Callable[[str], int | None]
_HASH = 8
_ZONES_NS = 86_400 * 10**9  # a log's clock may say local time


def first_seen_times(folder: Path, missions: Iterable[Mission]) -> FirstSeen:
    """Function that gives the time at which a mission was first seen, by its name [ns since 1970]; None where that is not known.

    Parameters
    ----------
    folder : Path
        Folder of the store.
    missions : Iterable[Mission]
        From `diagnosis.audit.fleet.read.read_missions`.
    """
    hashes = {m.name: m.result.log_hash[:_HASH] for m in missions if m.result is not None}
    objects = Objects(str(folder / RESULTS))

    @cache
    def stored() -> dict[str, list[str]]:
        out: dict[str, list[str]] = defaultdict(list)
        try:
            for name in objects.names():
                out[name[:_HASH]].append(name)
        except OutputError:
            return {}
        return out

    @cache
    def first_made(start: str) -> dict[str, int]:
        out: dict[str, int] = {}
        for name in stored().get(start, ()):
            mission, made = _mission_and_time(objects, name)
            if made is not None:
                out[mission] = min(made, out.get(mission, made))
        return out

    def first_seen(mission: str) -> int | None:
        return first_made(hashes[mission]).get(mission) if mission in hashes else None

    return first_seen


def without_false_dates(missions: Sequence[Mission], first_seen: FirstSeen) -> list[Mission]:
    """Missions without the starts that lie more than a day after an audit first saw the log: its clock is wrong.

    Parameters
    ----------
    missions : Sequence[Mission]
        From `diagnosis.audit.fleet.read.read_missions`.
    first_seen : callable
        From `first_seen_times`.
    """
    false = set()
    for m in missions:
        if m.result is not None and m.result.start_ns is not None and m.result.id not in false:
            seen = first_seen(m.name)
            if seen is not None and m.result.start_ns > seen + _ZONES_NS:
                false.add(m.result.id)
    return [
        replace(m, result=replace(m.result, start_ns=None)) if m.result is not None and m.result.id in false else m
        for m in missions
    ]


def newest_result_ns(folder: Path, missions: Iterable[Mission]) -> int | None:
    """When the newest result of a store was made [ns since 1970]; None where its objects do not say.

    Parameters
    ----------
    folder : Path
        Folder of the store.
    missions : Iterable[Mission]
        From `diagnosis.audit.fleet.read.read_missions`.
    """
    results = [m.result for m in missions if m.result is not None]
    if not results:
        return None
    start, objects = max(results, key=lambda r: r.id).log_hash[:_HASH], Objects(str(folder / RESULTS))
    try:
        made = [_mission_and_time(objects, name)[1] for name in objects.names() if name.startswith(start)]
    except OutputError:
        return None
    return max((m for m in made if m is not None), default=None)


def _mission_and_time(objects: Objects, name: str) -> tuple[str, int | None]:
    """Mission of a result object and when this was made; None where it cannot be read."""
    try:
        document = orjson.loads(objects.read(name))
        mission, made = str(document["mission"]["name"]), document["made_ns"]
    except (OSError, ValueError, KeyError, TypeError):
        return "", None
    return mission, made if isinstance(made, int) and not isinstance(made, bool) else None
