"""When something happened to the machine as a whole: the times that its sentence states, or all those that its finder knows."""

from __future__ import annotations

import re
from collections.abc import Sequence

from diagnosis.results.event_row import EventRow
from diagnosis.results.machine_event import MachineEvent

_NUMBER = r"(\d+(?:\.\d+)?)"
#: Forms of a time in a sentence; what is not stated begins with the log, or ends with it.
_FORMS = (
    re.compile(rf"{_NUMBER}–{_NUMBER} s"),
    re.compile(rf"\b[Ff]rom {_NUMBER} to {_NUMBER} s"),
    re.compile(rf"\b[Bb]etween {_NUMBER} and {_NUMBER} s"),
    re.compile(rf"\b[Ff]rom (the start) to {_NUMBER} s"),
    re.compile(rf"\b[Ff]rom {_NUMBER} s to {_NUMBER} s"),
    re.compile(rf"\b[Ff]rom {_NUMBER} s to (the end) of the log"),
    re.compile(rf"\b[Ff]rom (?:about )?{_NUMBER} s (on)\b"),
)


def event_rows(events: Sequence[MachineEvent], length_s: float) -> list[EventRow]:
    """Rows of ``report.json`` of what happened to the machine as a whole, the verdict's first.

    Parameters
    ----------
    events : Sequence[MachineEvent]
        With the machine's own words.
    length_s : float
        Length of the log [s].
    """
    return [
        {
            "id": f"M{k}",
            "title": event.title,
            "text": event.text,
            "spans": [{"start_s": a, "stop_s": b} for a, b in event.spans or times_said(event.text, length_s)],
        }
        for k, event in enumerate(events, 1)
    ]


def times_said(text: str, length_s: float) -> tuple[tuple[float, float], ...]:
    """Begin and end of the times that a sentence states [s], by time; empty where it states none, as of what is so throughout.

    `length_s` is the length of the log [s].
    """
    found = set()
    for form in _FORMS:
        for first, last in form.findall(text):
            start = 0.0 if first == "the start" else float(first)
            stop = length_s if last in ("the end", "on") else float(last)
            if start < (stop := min(stop, length_s)):
                found.add((start, stop))
    return tuple(sorted(found))
