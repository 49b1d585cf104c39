"""When a fault began, on the mission's clock and the calendar's, and whether it ended within the mission."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.pages.labels import UNDATED_NS, clock, span, utc
from diagnosis.results.document import IntervalRow, ReportDocument
from diagnosis.results.ending import Ending, ending_of

_DIGITS = 3


def when_words(fault: IntervalRow, report: ReportDocument) -> str:
    """Onset and end of a fault: ``F1 began at 0:37.995 (07:30:37.995 UTC) and ended at 1:20.005, 20.0 s before the log does``.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    report : ReportDocument
        The document.
    """
    start, stop, whole = fault["start_s"], fault["stop_s"], report["log"]["duration_s"]
    at = report["log"]["start_ns"] + round(start * 1e9)
    dated = "" if abs(at) < UNDATED_NS else f" ({utc(at)[11:]}.{at // 10**6 % 1000:03d} UTC)"
    began = "was there from the beginning" if start <= 0 else f"began at {clock(start, _DIGITS)}{dated}"
    ending = ending_of(fault, report)
    if ending is Ending.LASTS:
        return f"{fault['id']} {began} and {Ending.LASTS}"
    until, rest = clock(stop, _DIGITS), span(whole - stop)
    if ending is Ending.ENDED:
        return f"{fault['id']} {began} and ended at {until}, {rest} before the log does"
    return f"{fault['id']} {began} and was last seen at {until}, {rest} before the log ends; its part was not seen healthy for a second since"


def times_words(faults: Sequence[IntervalRow], report: ReportDocument) -> str:
    """The same of one part's faults: when the first was seen, of the most urgent one, and of the last, which says how it stands with the part.

    Empty for none.

    Parameters
    ----------
    faults : Sequence[IntervalRow]
        Of one part, the most urgent first.
    report : ReportDocument
        The document.
    """
    if not faults:
        return ""
    first, last = min(faults, key=lambda f: f["start_s"]), max(faults, key=lambda f: f["stop_s"])
    begins = (
        f"first seen at {clock(first['start_s'], _DIGITS)} ({first['id']}); "
        if first["start_s"] < faults[0]["start_s"]
        else ""
    )
    return begins + "; ".join(when_words(f, report) for f in ([faults[0]] if last is faults[0] else [faults[0], last]))
