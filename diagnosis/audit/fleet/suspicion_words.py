"""What earlier missions held against a machine's parts, to stand beside whether it may go out."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.audit.fleet.fleet_types import MachineRow, MissionRow
from diagnosis.audit.fleet.words import count
from diagnosis.pages.labels import utc

_NAMED = 2


def with_suspicions(reason: str, m: MachineRow, missions: Sequence[MissionRow]) -> str:
    """A reason with what earlier missions held against parts, each with its day: a healthy mission since does not settle it.

    Parameters
    ----------
    reason : str
        Why a machine may go out, or not.
    m : MachineRow
        The machine.
    missions : Sequence[MissionRow]
        Of the fleet.
    """
    every = [s for s in m.get("suspicions", ()) if s["text"] not in reason]
    if not every:
        return reason
    said = []
    for s in every[:_NAMED]:
        start = missions[s["mission"]].get("start_ns")
        when = f"on {utc(start)[:10]}" if start is not None else f"in {missions[s['mission']]['name']}"
        again = f" (and in {count(s['again'], 'mission')} before)" if s["again"] else ""
        said.append(f"{s['text']}, {when}{again}")
    more = f"; and {count(len(every) - _NAMED, 'more point')}" if len(every) > _NAMED else ""
    return f"{reason}; not settled since: {'; '.join(said)}{more}"
