"""What an earlier mission of a machine held against a part without stating a fault, and nothing has settled since.

A mission after it that clears the machine does not show that the part is sound: what deviated once may come and go. It is told
until the part is repaired, a fault of it is stated, or ten missions are over.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import NamedTuple

from diagnosis.audit.fleet.runs import Limits, Run
from diagnosis.audit.store.repairs import Repair
from diagnosis.results.vocabulary import Verdict

_RECENT = 10  # missions

Parts = tuple[tuple[str, str], ...]


class Suspicion(NamedTuple):
    """What a mission held against a part.

    Attributes
    ----------
    text : str
        The part and what deviates, in words.
    run : Run
        The newest mission that says so.
    again : int
        Earlier ones that held something against the same parts.
    """

    text: str
    run: Run
    again: int


def suspicions_of(
    dated: Sequence[Run], limits: Callable[[str], Limits] | None, repairs: Sequence[Repair]
) -> tuple[Suspicion, ...]:
    """Open suspicions against parts in the last ten missions before the newest one, the newest first.

    Parameters
    ----------
    dated : Sequence[Run]
        Judged missions of a machine in their order.
    limits : Callable[[str], Limits] or None
        Gives what a report says by its folder; None: nothing is known.
    repairs : Sequence[Repair]
        Repairs of the machine.
    """
    if limits is None:
        return ()
    recent = dated[-_RECENT:]
    faulty = {f.component for run in recent for f in run.faults}
    found: dict[Parts, list[tuple[Run, str]]] = defaultdict(list)
    for run in reversed(recent[:-1]):
        if run.result.verdict is Verdict.READY or run.result.report is None:
            continue
        for parts, text in limits(run.result.report).suspected:
            components = {component for component, _ in parts}
            since = any(r.component in components and r.repaired_ns > (run.result.start_ns or 0) for r in repairs)
            if not since and not components & faulty:
                found[parts].append((run, text))
    return tuple(Suspicion(said[0][1], said[0][0], len(said) - 1) for said in found.values())
