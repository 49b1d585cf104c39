"""What an audit's fleet knows of a machine beyond one mission, as the newest report of the machine keeps it."""

from __future__ import annotations

from typing import TypedDict

from diagnosis.results.vocabulary import Leave


class RepairNoteRow(TypedDict):
    """A repair that was recorded after the mission: ids of the faults that were found before it, their part, and when [ns since 1970]."""

    faults: list[str]
    part: str
    repaired_ns: int


class FleetNoteRow(TypedDict):
    """Where the fleet page has the machine, while that is not what the mission says by itself.

    `leave` and `reason` are the machine's list there and why; `repairs` those of parts that this mission found faulty; `page` the fleet
    page as seen from the report's folder; `asof_ns` when this was written [ns since 1970].
    """

    leave: Leave
    reason: str
    repairs: list[RepairNoteRow]
    page: str
    asof_ns: int
