"""What happened to the machine as a whole, as `report.json` has it."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.results.event_row import EventRow
from diagnosis.results.machine_event import MachineEvent


def event_rows(events: Sequence[MachineEvent], length_s: float) -> list[EventRow]:
    """Rows of ``report.json`` of what happened to the machine as a whole, the verdict's first.

    Parameters
    ----------
    events : Sequence[MachineEvent]
        With the machine's own words.
    length_s : float
        Length of the log [s], which no time goes beyond.
    """
    return [
        {
            "id": f"M{k}",
            "title": event.title,
            "text": event.text,
            "spans": [{"start_s": a, "stop_s": min(b, length_s)} for a, b in event.spans if a < min(b, length_s)],
        }
        for k, event in enumerate(events, 1)
    ]
