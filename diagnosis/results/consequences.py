"""Faults that may be no more than a consequence of another one at the same time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from diagnosis.results.clearing import share_covered
from diagnosis.results.vocabulary import Severity, Tier
from replay.faults import FaultMode, Side

_WITHIN = 0.9  # of a fault's time, with what the other one leaves behind


class Stated(NamedTuple):
    """What is asked of a fault: its part, its row, how severe it is, what showed it, and when it was [s]."""

    id: str
    component: str
    kind: str
    side: str
    mode: str
    severity: str
    tier: str
    start_s: float
    stop_s: float


def causes_of(faults: Sequence[Stated]) -> dict[str, str]:
    """Faults that may be no more than a consequence, each with the fault that may be its cause, by their names.

    A stuck or silent part misleads what is inferred of its component's other side, and what a model makes of the parts around it: it pulls at them,
    or is pulled along. So a fault that no second measurement shows, most of which lies within the other's time, may follow from it; one of another
    component only where it is of low severity, lies in it (almost) wholly, and the other is what the machine is stopped for.
    """
    total = [f for f in faults if FaultMode(f.mode).total]
    out = {}
    for f in faults:
        if f.tier == Tier.DIRECT or FaultMode(f.mode).total or f.side == Side.SENSOR_OR_ACTUATOR:
            continue
        for g in total:
            own = (g.component, g.kind) == (f.component, f.kind)
            if own and g.side not in (f.side, Side.SENSOR_OR_ACTUATOR):
                shared = min(f.stop_s, g.stop_s) - max(f.start_s, g.start_s)
                if shared > 0.5 * (f.stop_s - f.start_s):
                    out[f.id] = g.id
            elif not own and f.id not in out and _follows(f, g):
                out[f.id] = g.id
    return out


def _follows(f: Stated, g: Stated) -> bool:
    """Whether a fault may follow from one of another component."""
    if f.severity != Severity.LOW or g.severity != Severity.HIGH:
        return False
    return share_covered(f.start_s, f.stop_s, (g.start_s, g.stop_s)) >= _WITHIN
