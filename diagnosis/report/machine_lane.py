"""The lane of the timeline that says what the machine did as a whole, which is no part's fault."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.pages.labels import clock
from diagnosis.report.timeline import Bar, side_by_side
from diagnosis.results.document import ReportDocument
from diagnosis.results.event_row import EventRow

_ENOUGH = 45.0  # percent, in which the words of any event stand on a wide screen


@dataclass(frozen=True)
class EventBar:
    """A time of an event on the lane.

    Attributes
    ----------
    bar : Bar
        The bar; places in percent of the mission.
    event : str
        ``M1``.
    start_s, stop_s : float
        The time [s].
    side : str
        Where its words stand: ``in`` the bar, or to its ``right`` or ``left``, wherever there is most room.
    left, width : float
        Room of the words, in percent of the mission.
    """

    bar: Bar
    event: str
    start_s: float
    stop_s: float
    side: str = "in"
    left: float = 0.0
    width: float = 0.0


def machine_lane(report: ReportDocument, duration: float) -> tuple[EventBar, ...]:
    """Bars of all events by time, those that would cover each other in rows of their own; an event without times is so throughout.

    Parameters
    ----------
    report : ReportDocument
        The document.
    duration : float
        Length of the time axis [s].
    """
    if duration <= 0.0:
        return ()
    times = sorted(
        ((a, b, event) for event in report.get("events", ()) for a, b in _times(event, duration)),
        key=lambda time: (time[0], time[2]["id"], time[1]),
    )
    bars = side_by_side(_bar(event, a, b, duration) for a, b, event in times)
    return tuple(
        EventBar(bar, event["id"], a, b, *_room(bar, bars)) for bar, (a, b, event) in zip(bars, times, strict=True)
    )


def _room(bar: Bar, bars: Sequence[Bar]) -> tuple[str, float, float]:
    """Where the words of a bar stand, and their room: in it, or in the larger gap beside it, without what stands in its row."""
    others = [b for b in bars if b is not bar and (b.row == bar.row or b.rows != bar.rows)]
    end = bar.left + bar.width
    before = max((b.left + b.width for b in others if b.left < bar.left), default=0.0)
    after = min((b.left for b in others if b.left > bar.left), default=100.0)
    rooms = [
        ("in", bar.left, bar.width),
        ("right", end, max(0.0, after - end)),
        ("left", before, max(0.0, bar.left - before)),
    ]
    if bar.width >= _ENOUGH:
        return rooms[0]
    return max(rooms, key=lambda room: room[2])


def _times(event: EventRow, duration: float) -> Sequence[tuple[float, float]]:
    spans = [(s["start_s"], min(s["stop_s"], duration)) for s in event["spans"]]
    return [(a, b) for a, b in spans if a < b] or [(0.0, duration)]


def _bar(event: EventRow, start: float, stop: float, duration: float) -> Bar:
    whole = not event["spans"]
    when = "throughout" if whole else f"{clock(start, 1)} to {clock(stop, 1)}"
    title = f"{event['title']}, {when}"
    return Bar(event["id"], "event", 100 * start / duration, 100 * (stop - start) / duration, event["title"], title)
