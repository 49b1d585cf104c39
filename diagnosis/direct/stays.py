"""Brief stays of a valve's position while its command goes on, which valves that open in steps have all the time: no valve is stuck in them.

A bank of on/off valves, a stepper or a sticky spool rests on one opening until the command has left it by a step. Where the positions of
a machine stay so again and again, one more stay that is as brief and hardly larger is how its valves are built.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.low_speed import left_open
from diagnosis.results.assessment import Assessment, Finding
from replay.arrays.runs import runs_of
from replay.arrays.sliding import largest_within, smallest_within
from replay.faults import FaultMode

_BRIEF_S, _STAYS_S = 0.6, 0.1  # longer is no stay; over so long a position stays ...
_STILL, _NOISES, _MOVES = (
    0.012,
    4.0,
    0.03,
)  # ... within this share of the span, or times its noise, while its command moves by this one
_HABIT, _USUAL, _BEYOND = 6, 0.9, 1.5  # as many are a habit; quantile of their sizes, and times it


def without_stays(found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment]) -> dict[str, Assessment]:
    """Assessments of valves without brief findings of stuck ones that are no larger than the stays that all of them have.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Positions beside their commands, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    """
    if not any(_brief(f, found[w].pair.dt) for w, a in assessments.items() for f in a.findings):
        return dict(assessments)
    stays = {w: _stays(one) for w, one in found.items()}
    out = {}
    for w, a in assessments.items():
        habit = []
        for f in a.findings:
            if not _brief(f, found[w].pair.dt):
                continue
            others = [s[2] for v, every in stays.items() for s in every if v != w or s[1] <= f.start or s[0] >= f.stop]
            if len(others) >= _HABIT and _size(found[w], f.start, f.stop) <= _BEYOND * float(
                np.quantile(others, _USUAL)
            ):
                habit.append(f)
        out[w] = left_open(a, habit)
    return out


def _brief(f: Finding, dt: float) -> bool:
    return f.mode is FaultMode.STUCK and (f.stop - f.start) * dt < _BRIEF_S


def _size(one: IdentifiedPair, start: int, stop: int) -> float:
    """How far a position is off its command at most in samples [start, stop) [unit]."""
    y, x, status, *_ = one.samples.part(start, stop)
    off = np.abs(y - x)[status == PAIR]
    return float(np.max(off[np.isfinite(off)], initial=0.0))


def _stays(one: IdentifiedPair) -> Sequence[tuple[int, int, float]]:
    """Brief stretches in which a position stays while its command moves: samples [start, stop), and how far off it comes [unit]."""
    y, x, status = one.samples.y, one.samples.x, one.samples.status
    width, span = max(2, round(_STAYS_S / one.pair.dt)), one.pair.span
    still = max(_STILL * span, _NOISES * one.model.noise)
    flags = (status == PAIR) & (_range(y, width) <= still) & (_range(x, width) >= max(_MOVES * span, still))
    stretches = [(a - width // 2, b + width // 2) for a, b in runs_of(flags)]
    return [
        (max(0, a), b, _size(one, max(0, a), min(b, y.size)))
        for a, b in stretches
        if (b - a) * one.pair.dt < _BRIEF_S + _STAYS_S
    ]


def _range(z: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    filled, before = np.nan_to_num(z), width // 2
    after = width - before - 1
    return largest_within(filled, before, after) - smallest_within(filled, before, after)
