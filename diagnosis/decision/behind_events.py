"""A part that is stuck or dead while the machine as a whole is off: it may be why, and comes first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from diagnosis.decision.wording import cause_words, remedy_words
from diagnosis.results.clearing import MAY_EXPLAIN, share_covered
from diagnosis.results.machine_event import MachineEvent
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Severity


def with_faults_behind(
    events: Sequence[MachineEvent], faults: Sequence[FaultInterval], words: MachineWords
) -> tuple[MachineEvent, ...]:
    """Events with the fault that may be why, where there is one: its repair comes before anything else is looked at.

    The test is that of the checks: a fault explains what deviates where it covers a good part of each of its times, or has just ended.

    Parameters
    ----------
    events : Sequence[MachineEvent]
        What the machine did as a whole.
    faults : Sequence[FaultInterval]
        Of the mission.
    words : MachineWords
        How to speak of the machine.
    """
    total = [f for f in faults if f.mode.total and f.severity is Severity.HIGH]
    return tuple(_behind(event, total, faults, words) for event in events)


def _behind(
    event: MachineEvent, total: Sequence[FaultInterval], faults: Sequence[FaultInterval], words: MachineWords
) -> MachineEvent:
    share = {f.id: min((_covered(span, f) for span in event.spans), default=0.0) for f in total}
    first = max(total, key=lambda f: share[f.id], default=None)
    if first is None or share[first.id] < MAY_EXPLAIN:
        return event
    return replace(
        event,
        text=f"{event.text} {cause_words(first, words)} lasts in that time, and may be why: look at it first.",
        act=f"{remedy_words([first], faults, words)}, then diagnose the next mission; if it is still so, {event.act}",
    )


def _covered(span: tuple[float, float], fault: FaultInterval) -> float:
    return share_covered(*span, (fault.start_s, fault.stop_s))
