"""How urgent a fault is, by Assumptions 1 and 2 of the paper.

Assumption 1: a sensor that is stuck or silent is tolerable when brief, else stop and repair. Assumption 2: a stuck
actuator, or one without control signal, means stop at once. Everything else is watched.

Both are about the part that is named, so *high* needs its probability, not that of any fault: the named side must be faulty
with `limits.min_probability` (as every stated fault is), and be stuck or without signal with odds of three to one. A machine
that is stopped for the wrong part, or for a row that is no reason to stop, stands without need; the fault that misses these
bounds is still *medium*, to be checked before the next mission, unless the odds are three to one that it is neither: a row that
is a little more probable than *stuck* does not make a valve that may be stuck fit to go out. The risk decides, not the most probable row: a part of which
hardly anything is left (ε̂ ≥ .9) is as good as without signal, whatever its row is called.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import replace

from diagnosis.results.assessment import Finding
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, FaultInterval
from diagnosis.results.sizes import loss_known
from diagnosis.results.vocabulary import Kind, Severity, Tier, Verdict
from replay.faults import TOTAL, FaultMode, Side
from replay.machine.config import Limits

_LIKELY = 0.6  # probability of any fault from which on one is worth a check
_MARKED_EPSILON = 0.3
_SHORT_NOISE_S = 1.0
_MOMENT_S = 0.15  # of which a row must be likely, to be worth a check
_CERTAIN = 0.99  # probability of any fault from which on even brief noise is worth a check
_LOST = 0.9  # ε̂ from which on so little is left that the part is as good as without signal
_EVEN = 0.5  # that a part delivers nothing usable, from which on that is what is said
PROBABLY_TOTAL = 0.75  # that the named side is stuck or without signal, from which on the machine is stopped, ...
_MAY_BE_TOTAL = 0.25  # ... and from which on it is looked at before the machine goes out
HALF = 0.5  # of ε: a part that may have lost so much is no fault to drive on with
_ALONE = "This alone is no reason to stop; check it before it grows."
DOUBLE = -1.0  # of ε: one that gives twice what it should, and more, likewise
_HARDLY_DOUBTED = 0.8
_LATER = "Probable, not certain: check it at the next service, and compare with the next mission."
#: The same in a mission that gives no leave for other reasons.
SOONER = (
    "Probable, not certain; but this mission does not clear the machine: check it before the machine goes out again."
)
HELD = (
    "Alone it would keep no machine in, but this mission does not clear it: check it before the machine goes out again."
)
#: The same of one that is dead briefly again and again, and how often, and for how long in all, that is: a contact is loose.
AGAIN = "Each time it is tolerable (the paper’s Assumption 1), so often it is not: check plug and cable before the machine goes out again."
_OFTEN, _OFTEN_S = 5, 3.0
_HELD = {_ALONE: HELD, _LATER: SOONER}
_BEFORE, _WITH = (
    "check it before the machine goes out again.",
    "check it with the repair, and compare with the next mission.",
)
_PARTIAL = (FaultMode.INEFFICIENT, FaultMode.OUTSIDE_TABLE)  # rows of which ε̂ says how much is left


def severity_of(
    finding: Finding, seconds: float, limits: Limits, words: MachineWords, kind: Kind = Kind.WHEEL
) -> tuple[Severity, str]:
    """Severity and advice of one fault that lasts `seconds`; see the module's docstring."""
    faulty = 1.0 - sum(h.p for h in finding.hypotheses if h.mode == "healthy")
    if faulty < _LIKELY:
        return Severity.INFO, "Not certain enough to act on. Compare with the next mission."
    sizeless = finding.mode is FaultMode.OUTSIDE_TABLE and finding.epsilon is None
    brief = (finding.mode.varying or sizeless) and seconds < _SHORT_NOISE_S
    if brief and (finding.tier is Tier.MODEL or faulty < _CERTAIN):
        by = ", and shown by a model alone" if finding.tier is Tier.MODEL else ", and not certain"
        return Severity.INFO, f"Too short to act on{by}. Compare with the next mission."
    if seconds < _MOMENT_S and finding.probability < _LIKELY:
        return (
            Severity.INFO,
            "A moment, of a kind that is not clear: too little to act on. Compare with the next mission.",
        )
    total = finding.mode.total or risk_of(finding) >= _MAY_BE_TOTAL
    halved = halved_words(finding.side, finding.mode, finding.epsilon)
    if faulty < limits.min_probability:
        if total and finding.side is not Side.SENSOR:
            what = (
                "Probably a {valve} that does not answer" if risk_of(finding) >= _EVEN else "The {valve} may not answer"
            )
            return Severity.MEDIUM, words.fill(f"{what}: check it before the machine goes out again.")
        if halved:
            return Severity.LOW, f"Probable, not certain; but it {halved}: {_BEFORE}"
        return Severity.LOW, _LATER
    if total:
        return _severity_of_total(finding, seconds, limits, words, kind)
    marked = finding.epsilon is not None and finding.epsilon.value >= _MARKED_EPSILON
    if finding.mode is FaultMode.OUTSIDE_TABLE:
        if finding.side is Side.ACTUATOR and finding.epsilon is None:
            return Severity.MEDIUM, words.fill(
                "Check the zero and the response of the {valve}: no fault of the tables gives such a deviation."
            )
        when = " before the machine goes out again" if halved else ""
        return (
            Severity.MEDIUM,
            f"Check scaling and sign of the channel{when}: no fault of the tables gives such a gain.",
        )
    severity = Severity.MEDIUM if marked else Severity.LOW
    if halved:
        return severity, f"It {halved}: {_BEFORE}"
    return severity, _ALONE


def _severity_of_total(
    finding: Finding, seconds: float, limits: Limits, words: MachineWords, kind: Kind
) -> tuple[Severity, str]:
    """Severity and advice of a part that is, or may be, stuck or without signal, with enough probability of a fault."""
    if _of_named_side(finding) < limits.min_probability:
        return (
            Severity.MEDIUM,
            words.fill(
                "Faulty, but which part is not certain enough to stop for: check sensor and {valve} before the next mission."
            ),
        )
    if risk_of(finding) < PROBABLY_TOTAL and finding.side is Side.SENSOR and seconds <= limits.brief:
        return Severity.LOW, "Short, and its kind is not clear: check plug and cable at the next service."
    if risk_of(finding) < PROBABLY_TOTAL:
        likely = "Probably" if risk_of(finding) >= _EVEN else "It may be"
        return (
            Severity.MEDIUM,
            f"{likely} stuck or without signal, which is not certain enough to stop for: check it before the next mission.",
        )
    if finding.side is Side.ACTUATOR:
        return Severity.HIGH, words.fill(
            "Stop at once and repair: the {valve} does not answer its command (the paper’s Assumption 2)."
        )
    if finding.side is Side.SENSOR_OR_ACTUATOR:
        part = words.part_name(kind, Side.ACTUATOR)
        return (
            Severity.HIGH,
            f"Stop and find out whether the {part} or its sensor fails; treat it as the {part} until then.",
        )
    if seconds <= limits.brief:
        return Severity.LOW, (
            f"Tolerable: no longer than {limits.brief:g} s (the paper’s Assumption 1). Check plug and cable at the next service."
        )
    return Severity.HIGH, (
        f"Stop and repair the sensor: it delivered nothing usable for more than {limits.brief:g} s (the paper’s Assumption 1)."
    )


def advised(intervals: Sequence[FaultInterval], status: Verdict, *, cleared: bool) -> tuple[FaultInterval, ...]:
    """Faults with the advice that fits their mission's verdict: what alone is no reason to stop is looked at where the mission gives no leave.

    Beside a fault that the machine is stopped for, one of low severity waits for that repair.
    """
    if status is Verdict.STOP:
        return tuple(
            replace(f, advice=f.advice.removesuffix(_BEFORE) + _WITH)
            if f.severity is Severity.LOW and f.advice.endswith(_BEFORE)
            else replace(f, advice=f"Probable, not certain: {_WITH}")
            if f.advice == _LATER
            else f
            for f in intervals
        )
    if status is not Verdict.WATCH or cleared:
        return tuple(intervals)
    again = [f for same in often_dead(intervals) for f in same]
    return tuple(
        replace(f, advice=_HELD[f.advice])
        if f.advice in _HELD
        else replace(f, advice=AGAIN)
        if any(f is g for g in again)
        else f
        for f in intervals
    )


def waits_for_no_mission(f: FaultInterval) -> bool:
    """Whether a fault's advice has it checked before the machine is out again."""
    return any(words in f.advice for words in ("before the machine goes out", "before the next mission"))


def often_dead(faults: Sequence[FaultInterval]) -> list[list[FaultInterval]]:
    """Faults of parts that give nothing usable again and again, each time briefly enough to be tolerated, by part."""
    brief: dict[tuple[str, str], list[FaultInterval]] = {}
    for f in faults:
        if f.severity is Severity.LOW and f.mode.total:
            brief.setdefault((f.component, f.side.value), []).append(f)
    return [
        same for same in brief.values() if len(same) >= _OFTEN and sum(f.stop_s - f.start_s for f in same) >= _OFTEN_S
    ]


def halved_words(side: Side, mode: FaultMode, epsilon: Epsilon | None) -> str:
    """That a part may have lost half or more, by the upper bound of ε̂, surely gives twice as much as it should, or may give so much noise; else empty."""
    if epsilon is not None and mode is FaultMode.OUTSIDE_TABLE and epsilon.high <= DOUBLE:
        return f"{'reads' if side is Side.SENSOR else 'gives'} at least {plain(1.0 - epsilon.high, 2)} times what it should"
    if epsilon is None or epsilon.high < HALF:
        return ""
    if mode.varying:
        return "may give more noise than signal" if side is Side.SENSOR else "may follow noise more than its command"
    if not mode.scaled:
        return ""
    if not loss_known(epsilon.low, epsilon.high):
        return "may have lost anything from nothing to all"
    return f"may have lost up to {round(100 * epsilon.high)} %"


def unbounded_words(fault: FaultInterval) -> str:
    """That nothing bounds what is left of a part whose fault is hardly in doubt and in no row of the tables; else empty."""
    sure = fault.severity is Severity.MEDIUM or (
        fault.severity is Severity.LOW and fault.probability >= _HARDLY_DOUBTED
    )
    open_ = fault.mode is FaultMode.OUTSIDE_TABLE and fault.epsilon is None and sure
    return "deviates in a way of which no row says how much is left" if open_ else ""


def unanswered(fault: FaultInterval) -> bool:
    """Whether a drive may not answer, though that is not certain enough to stop for."""
    may_be = fault.mode.total or risk_of(fault) >= _MAY_BE_TOTAL
    return fault.severity is Severity.MEDIUM and may_be and fault.side is not Side.SENSOR


def risk_of(finding: Finding | FaultInterval) -> float:
    """Probability [1] that nothing usable comes from the side that a fault names: stuck, without signal, or nearly all lost."""
    # a stuck part's ε is 1 by its row; what else it may be says the lower bound, where a second measurement gives it
    size = finding.epsilon
    known = size is not None and (not finding.mode.total or finding.tier is Tier.DIRECT)
    lost = known and size is not None and (size.low if finding.mode.total else size.value) >= _LOST
    return _of_named_side(finding, {*TOTAL, *_PARTIAL} if lost else TOTAL)


def _of_named_side(finding: Finding | FaultInterval, modes: Container[str] | None = None) -> float:
    """Probability that the side that the finding names is faulty, of given modes or any."""
    named = [h for h in finding.hypotheses if h.mode != "healthy" and (modes is None or h.mode in modes)]
    either = finding.side is Side.SENSOR_OR_ACTUATOR
    return sum(h.p for h in named if either or h.side == finding.side.value)
