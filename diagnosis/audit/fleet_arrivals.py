"""When an audit first looked at a mission, by the clock of the computer that audits: a log was there by then.

The result objects beside the store say it; the clocks of logs and files do not count. A log that was there before another
mission began is the older of the two, even where nothing in it can be read.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import orjson

from diagnosis.audit.fleet_read import Mission
from diagnosis.audit.objects import Objects
from diagnosis.audit.store import RESULTS
from replay.errors import OutputError

Came = Callable[[str], int | None]
_HASH = 8


def arrivals(folder: Path, missions: Iterable[Mission]) -> Came:
    """Function that gives the first look at a mission by its name [ns since 1970]; None where that is not known.

    Parameters
    ----------
    folder : Path
        Folder of the store.
    missions : Iterable[Mission]
        From `diagnosis.audit.fleet_read.read_missions`.
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
    def came(mission: str) -> int | None:
        if mission not in hashes:
            return None
        made = [looked_at(objects, name, mission) for name in stored().get(hashes[mission], ())]
        return min((m for m in made if m is not None), default=None)

    return came


def last_made(folder: Path, missions: Iterable[Mission]) -> int | None:
    """When the newest result of a store was made [ns since 1970]; None where its objects do not say.

    Parameters
    ----------
    folder : Path
        Folder of the store.
    missions : Iterable[Mission]
        From `diagnosis.audit.fleet_read.read_missions`.
    """
    results = [m.result for m in missions if m.result is not None]
    if not results:
        return None
    start, objects = max(results, key=lambda r: r.id).log_hash[:_HASH], Objects(str(folder / RESULTS))
    try:
        made = [looked_at(objects, name) for name in objects.names() if name.startswith(start)]
    except OutputError:
        return None
    return max((m for m in made if m is not None), default=None)


def looked_at(objects: Objects, name: str, mission: str | None = None) -> int | None:
    """When a result object was made; None where it cannot be read, or is of another mission than the one asked for."""
    try:
        document = orjson.loads(objects.read(name))
        made = document["made_ns"]
        asked = mission is None or document["mission"]["name"] == mission
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return made if asked and isinstance(made, int) and not isinstance(made, bool) else None
