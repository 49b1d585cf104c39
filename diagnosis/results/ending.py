"""How a fault ends: with the log, within it, or unseen; one notion for sentences, pages, fleets and comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from diagnosis.results.document import IntervalRow, ReportDocument, StateRow
from replay.faults import Side, State

_END_S = 1.0  # before the end of the log: a fault that is found until then lasts to it
#: Healthy time behind a fault that shows that it is gone [s].
HEALTHY_S = 1.0
#: States of which a side that was never judged has no other.
NEVER_JUDGED = (State.NOT_ASSESSED, State.NO_DATA)


class Ending(StrEnum):
    """How a fault ends."""

    LASTS = "lasts to the end of the log"
    ENDED = "ended"
    UNSEEN = "unseen"


def lasts(stop_s: float, duration_s: float) -> bool:
    """Whether a fault lasts to the end of its log; its end and the log's length in s of the mission."""
    return stop_s >= duration_s - _END_S


def how_it_ends(stop_s: float, duration_s: float, healthy_s: float) -> Ending:
    """How a fault ends at `stop_s` [s] of a log of `duration_s` [s], whose part was healthy for `healthy_s` [s] behind it."""
    if lasts(stop_s, duration_s):
        return Ending.LASTS
    return Ending.ENDED if healthy_s >= HEALTHY_S else Ending.UNSEEN


def healthy_after(
    component: str, side: Side, after_s: float, states: Sequence[StateRow], *, of_judged: bool = False
) -> float:
    """For how long every side of a part was healthy behind a time of the mission [s], the least of them [s].

    `of_judged`: a side that was never judged is left out, where the other one was.
    """
    healthy = dict.fromkeys(((component, s.value) for s in side.sides), 0.0)
    judged = set()
    for row in states:
        key = (row["component"], row["side"])
        if key in healthy and row["state"] not in NEVER_JUDGED:
            judged.add(key)
        if key in healthy and row["state"] == State.HEALTHY:
            healthy[key] += max(0.0, row["stop_s"] - max(after_s, row["start_s"]))
    return min(seconds for key, seconds in healthy.items() if key in judged or not judged or not of_judged)


def ending_of(fault: IntervalRow, report: ReportDocument) -> Ending:
    """How a fault of a report ends: *ended* only where its part was healthy behind it.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    report : ReportDocument
        The document.
    """
    after = healthy_after(fault["component"], Side(fault["side"]), fault["stop_s"], report["states"], of_judged=True)
    return how_it_ends(fault["stop_s"], report["log"]["duration_s"], after)
