"""What is known of a machine since its parts were repaired, in words for page, document and terminal."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.audit.fleet.fleet_fault import FleetFault
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.runs import sides_of
from diagnosis.decision.wording import count_words, join_words
from diagnosis.pages.labels import utc_moment
from diagnosis.results.vocabulary import Verdict

_NAMED = 3  # parts


def since_repair(m: Machine, repaired_ns: int) -> str:
    """What is known of a machine since its repairs, where no mission after the last one was judged as a whole."""
    day = utc_moment(repaired_ns)
    repaired = [f for f in m.faults if f.status == "repaired" and f.repaired_ns is not None]
    told = [(f, _judged_since(m, f)) for f in repaired]
    waiting = [f for f, seen in told if not seen]
    if len(waiting) == len(repaired):
        return f"{Verdict.NOT_ASSESSED.short} since the repair on {day}"
    days: dict[str, list[tuple[FleetFault, int]]] = {}
    for f, seen in told:
        if seen:
            days.setdefault(utc_moment(f.repaired_ns or 0), []).append((f, seen))
    shown = "; ".join(
        f"{_parts(m, [f for f, _ in fs])} not found by {count_words(min(n for _, n in fs), 'mission')} since the repair on {d}"
        for d, fs in days.items()
    )
    if not waiting:
        return f"{shown}, {_others(m, repaired)}"
    since = max(f.repaired_ns or 0 for f in waiting)
    return f"{shown}; {_parts(m, waiting)} not judged since the repair on {utc_moment(since)}"


def _others(m: Machine, repaired: Sequence[FleetFault]) -> str:
    """What is known of the other parts since the first of these repairs."""
    since = min(f.repaired_ns or 0 for f in repaired)
    after = [r for r in m.dated if (r.result.start_ns or 0) >= since]
    mended = {(f.component, side) for f in repaired for side in sides_of(f.side)}
    left = [
        key for key in m.parts if key not in mended and not any(r.assessed(*key, m.limits) for r in after)
    ]  # fmt: skip
    others = len(m.parts) - len({*m.parts} & mended)
    if not left:
        return "nor a fault of another part, and not cleared by it" if others else "and not cleared by it"
    if len(left) == others or len(left) > _NAMED:
        return f"{'other' if len(left) == others else 'some other'} parts not judged"
    named = join_words([m.limits.words.part_words(m.kind(component), component, side) for component, side in left])
    return f"{named} not judged"


def _judged_since(m: Machine, f: FleetFault) -> int:
    """Missions that began after the repair of a part and assessed it."""
    after = [r for r in m.dated if (r.result.start_ns or 0) >= (f.repaired_ns or 0)]
    return sum(r.assessed(f.component, f.side, m.limits) for r in after)


def _parts(m: Machine, faults: Sequence[FleetFault]) -> str:
    return join_words(list(dict.fromkeys(m.limits.words.part_words(f.kind, f.component, f.side) for f in faults)))
