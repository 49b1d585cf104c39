"""Faults that explain why checks of the all-clear deviate, also of parts that have no fault."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from diagnosis.results.clearing import MAY_EXPLAIN, Check, Checked, lasts_in, share_covered
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Kind, Severity


class When(Enum):
    """How the window of a check lies to a fault: words before its name, and words after its part."""

    MISSION = ("In a mission with", "")
    DURING = ("At the time of", ", at its time")
    AFTER = ("Just after", ", just after it")

    @property
    def before(self) -> str:
        """Words to be followed by the fault's name."""
        return self.value[0]

    @property
    def after(self) -> str:
        """Words to follow the name of the fault's part."""
        return self.value[1]


def explaining(check: Checked, faults: Sequence[FaultInterval]) -> FaultInterval | None:
    """The fault that may explain why a check deviates, one of the same part before others; None where there is none.

    It lasts for a good part of the check's window, or ended just before; what an axle's angle jumps by has no such aftermath.
    """
    start, stop = check.start_s, check.stop_s
    if start is None or stop is None:
        steered = [f for f in faults if f.kind is Kind.STEER and f.severity is not Severity.INFO]
        against = check.check is Check.LASTING_RATE  # one axle against the other: a fault of either
        return max(steered, key=lambda f: f.stop_s - f.start_s, default=None) if against else None
    share = {f.id: share_covered(start, stop, (f.start_s, f.stop_s)) for f in faults if f.severity is not Severity.INFO}
    counted = [f for f in faults if share.get(f.id, 0.0) >= MAY_EXPLAIN]
    if check.check is Check.JUMP:
        counted = [f for f in counted if lasts_in(start, stop, (f.start_s, f.stop_s))]
    return max(counted, key=lambda f: (f.component == check.component, share[f.id]), default=None)


def is_of_another(check: Checked, fault: FaultInterval | None) -> bool:
    """Whether a check of one component deviates where a fault of another one explains it, one that is no small loss: nothing speaks against its own."""
    return fault is not None and fault.component != check.component and fault.severity is not Severity.LOW


def when_of(check: Checked, fault: FaultInterval) -> When:
    """How a check's window lies to a fault that explains it."""
    if check.start_s is None or check.stop_s is None:
        return When.MISSION
    return When.DURING if lasts_in(check.start_s, check.stop_s, (fault.start_s, fault.stop_s)) else When.AFTER
