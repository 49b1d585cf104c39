"""Faults that explain why checks of the all-clear deviate, also of parts that have no fault.

A fault at the time of a check is not its cause for that alone. One of the check's own component may be. One of another component explains
what compares both: a wheel beside the other wheels, or on a machine that takes another curve; an axle beside the other one, or beside
the yaw rate. Of what a part does by itself it may be the cause, no more; and not at all of two measurements of one part that
disagree, or of an angle that jumps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from diagnosis.results.clearing import MAY_EXPLAIN, Check, Checked, lasts_in, share_covered
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Kind, Severity


class When(Enum):
    """How the window of a check lies to a fault: words before its name, and words after its part."""

    MISSION = ("In a mission with", "")
    DURING = ("At the time of", ", at {its} time")
    AFTER = ("Just after", ", just after {it}")
    APART = ("Of the same part as", ", at another time")

    @property
    def before(self) -> str:
        """Words to be followed by the fault's name."""
        return self.value[0]

    @property
    def after(self) -> str:
        """Words to follow the names of the faults' parts, with ``{its}`` or ``{it}`` to be filled in."""
        return self.value[1]


_TOLD = 3  # faults that are named together
_BESIDE_WHEELS = (
    Check.RESPONSE,
    Check.LASTING_RESPONSE,
    Check.CHANGE,
    Check.EXCESS,
    Check.LASTING_EXCESS,
    Check.SAME_SIDE,
    Check.OPENING_OFFSET,
    Check.EFFORT,
    Check.TRACKING,
    Check.DELAY,
)
_BESIDE_AXLES = (Check.LASTING_RATE, Check.YAW, Check.LASTING_YAW)
_OVER_MISSION = (Check.LASTING_RATE, Check.RATE)  # a rate that changes is compared with the other axle's
_BY_ITSELF_ALONE = (Check.SECOND_MEASUREMENT, Check.JITTER, Check.JUMP, Check.COMMANDED_ANGLE)


@dataclass(frozen=True)
class Explanation:
    """Why a check deviates.

    Attributes
    ----------
    faults : tuple[FaultInterval, ...]
        Of which any may be the cause, the likeliest ones, by their names.
    of_another : bool
        Whether they are of other components, which the check compares with its own, and are no small losses: nothing speaks against its own.
    when : When
        How its window lies to them.
    """

    faults: tuple[FaultInterval, ...]
    of_another: bool
    when: When


def explaining(check: Checked, faults: Sequence[FaultInterval]) -> Explanation | None:
    """What may explain why a check deviates: a fault of the same component before others, and of others all; None where nothing does.

    A fault lasts for a good part of the check's window, or ended just before; what an axle's angle jumps by has no such aftermath. What a part
    is off its own second measurement by at another time goes with its fault, which is to be checked anyway.
    """
    start, stop = check.start_s, check.stop_s
    counted = [f for f in faults if f.severity is not Severity.INFO and _may(check, f)]
    if start is None or stop is None:
        against = check.check in _OVER_MISSION  # one axle against the other: a fault of either
        steered = [f for f in counted if against and f.kind is Kind.STEER]
        longest = max(steered, key=lambda f: f.stop_s - f.start_s, default=None)
        return _of(check, [longest]) if longest is not None else None
    share = {f.id: share_covered(start, stop, (f.start_s, f.stop_s)) for f in counted}
    counted = [f for f in counted if share[f.id] >= MAY_EXPLAIN]
    if check.check is Check.JUMP:
        counted = [f for f in counted if lasts_in(start, stop, (f.start_s, f.stop_s))]
    if not counted and check.check is Check.SECOND_MEASUREMENT:
        own = [f for f in faults if f.component == check.component and check.side in f.side.sides]
        own = [f for f in own if f.severity is not Severity.INFO]
        near = min(own, key=lambda f: max(f.start_s - stop, start - f.stop_s), default=None)
        return None if near is None else Explanation((near,), False, When.APART)
    counted.sort(key=lambda f: (f.component == check.component, _compared(check, f), share[f.id]), reverse=True)
    return _of(check, counted) if counted else None


def _of(check: Checked, likeliest: Sequence[FaultInterval]) -> Explanation:
    """The first fault as the explanation, with others that are as good a one at the same time."""
    first = likeliest[0]
    when, others = when_of(check, first), _clears(check, first)
    alike = [f for f in likeliest if others and _clears(check, f) and when_of(check, f) is when][:_TOLD] or [first]
    return Explanation(tuple(sorted(alike, key=lambda f: int(f.id[1:]))), others, when)


def _may(check: Checked, fault: FaultInterval) -> bool:
    """Whether a fault may be the cause of what a check shows, by what both are of."""
    return fault.component == check.component or check.check not in _BY_ITSELF_ALONE


def _compared(check: Checked, fault: FaultInterval) -> bool:
    """Whether what a check compares with its component is what a fault of another one changes."""
    if check.check in _BESIDE_WHEELS:
        return fault.component != check.component
    beside = check.check in _BESIDE_AXLES or (check.check is Check.RATE and check.start_s is None)
    return beside and fault.kind is Kind.STEER and fault.component != check.component


def _clears(check: Checked, fault: FaultInterval) -> bool:
    """Whether a fault of another component, no small loss, explains a check so that nothing speaks against its own."""
    return _compared(check, fault) and fault.severity is not Severity.LOW


def when_of(check: Checked, fault: FaultInterval) -> When:
    """How a check's window lies to a fault that explains it."""
    if check.start_s is None or check.stop_s is None:
        return When.MISSION
    return When.DURING if lasts_in(check.start_s, check.stop_s, (fault.start_s, fault.stop_s)) else When.AFTER
