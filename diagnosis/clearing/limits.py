"""Limits that an all-clear sets to a wheel's speed per opening: lower where the other wheels deviate by much less."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.measure import alone
from diagnosis.clearing.responses import Responses, largest

_CHANGED = 0.88  # a change counts by its limit in windows, not over the mission
#: A deviation counts from this on, whatever the other wheels do [ln]: tyres hide most of a valve's loss, which is all that
#: shows of it where neither side is measured twice.
_LEAST_SEEN, _LEAST_SEEN_TWICE = 0.06, 0.1
#: A change likewise: healthy wheels of machines that are cleared change alike, by 0.02 where none does by more, whatever is measured
#: (tuning), for what changes of a machine, such as its load or its oil, changes for all of its wheels.
_LEAST_CHANGED = 0.035
#: The same where either is measured twice, so that less hangs on it: one of 10 healthy missions of another machine had 0.049 where no other wheel had 0.01.
_LEAST_CHANGED_TWICE = 0.055
_ABREAST_M = 0.05  # along the machine
#: The same over ten seconds, where either side is measured twice: of 47 healthy tuning missions of 16 machines one wheel had it three
#: times as large as the next, of none that is as large as this.
_LEAST_LONG = 0.075
_LEAST_LASTING = 0.15  # the same over the mission, of what is measured twice on either side
#: A deviation counts from so many times the largest of the other wheels' on: in windows, of what is measured once and of what is twice on either side,
#: over more, and a change likewise. Of 4000 logs with faults these limits alone kept in one that is less than 1.25 times beyond them.
_IN_WINDOWS, _IN_WINDOWS_TWICE, _ALONE, _CHANGED_ALONE = 3.5, 4.3, 3.0, 2.2
#: A change likewise of what is measured once: a valve that came to open 1.4 times as far changed 2.1 times as much as the next wheel, which its tyres
#: took along; of healthy ones that are cleared none changed by 1.72 times (18 machines, tuning).
_CHANGED_ONCE = 1.9
#: The same over the mission of what is measured once: of 112 healthy logs (14 machines, tuning) one wheel was above it, of a machine not cleared.
_LASTING_ALONE = 5.0
#: Of the loss that counts, in windows, of a change and over the mission, for two driven wheels that are measured twice on both sides, of which
#: neither tells how far healthy ones deviate: of ten healthy missions of such a truck none changed by more than 0.02 or was off by 0.04, while
#: motors that had lost 0.4 and 0.5 showed 0.16 to 0.28; in windows healthy ones of another truck were off by 0.12 at most (22 missions), motors
#: that had lost 0.37 by 0.24 to 0.50.
PAIR, _OF_PAIR, _CHANGES_OF_PAIR, _LASTS_OF_PAIR = 2, 0.63, 0.51, 0.7
_STRICT = 0.3  # loss that counts, from which on a machine file asks for no more than that
#: Limits of speed per opening below and above the other wheels', in windows and over the mission, as multiples of the loss
#: that counts, by whether opening and speed are measured twice. Second measurements judge one side alone: what lies behind a drive neither
#: of them does, and what reads too much is in no row of the tables, so that nothing else would tell it. Below the others a loss that counts is
#: beyond the limit whatever is measured: of 118 healthy tuning logs of 16 machines one that is cleared was so far below, by 0.32.
RESPONSE = {
    (False, False): ((0.75, 0.65), (0.9, 0.7)),
    (True, False): ((1.0, 0.65), (1.0, 0.7)),
    (False, True): ((1.0, 0.65), (1.4, 1.2)),
    (True, True): ((1.0, 0.65), (2.0, 1.4)),
}


class Limits(NamedTuple):
    """Limits of a wheel's speed per opening [ln]: in windows below and above, of a change, of one that grows, and over the mission."""

    below: float
    above: float
    changed: float
    grown: float
    lasting_below: float
    lasting_above: float


def measured_twice(cells: Cells) -> list[tuple[bool, bool]]:
    """Whether the opening, and the speed, of each wheel are measured twice."""
    command, opening, second = (
        [bool(np.isfinite(x).any()) for x in cells.wheels(leaf).T] for leaf in ("u", "u_applied", "v_true")
    )
    return [(a and u, x) for u, a, x in zip(command, opening, second, strict=True)]


def usual_limits(twice: tuple[bool, bool], clear_at: float) -> Limits:
    """Limits of a wheel whatever the other wheels do; `twice` as of `measured_twice`, `clear_at` the loss that counts [1]."""
    share = -float(np.log1p(-clear_at))
    (below, lasting_below), (above, lasting_above) = RESPONSE[twice]
    changed = lasting_below / _CHANGED
    return Limits(*(share * x for x in (below, above, changed, changed, lasting_below, lasting_above)))


def response_limits(
    responses: Responses,
    twice: Sequence[tuple[bool, bool]],
    clear_at: float,
    carried: Sequence[float] | None = None,
    ahead: Sequence[float] | None = None,
    *,
    driven: int | None = None,
) -> list[Limits]:
    """Limits of every wheel [ln], lower where the other wheels deviate by much less.

    Arguments as of `usual_limits`; `carried` is the share of its speed that the ground gives each wheel [1], none by default, and `ahead`
    where each is along the machine [m]: two abreast that lose together are held to the wheels of other axles. `driven` is how many wheels have a drive, all by
    default. What is usual of a
    wheel that is measured once may be below the others' by no more than the loss that counts leaves to be seen beside the ground, or above by
    no more than such an excess does.
    """
    return [
        limit
        if any(both)
        else limit._replace(
            lasting_below=min(limit.lasting_below, _seen(clear_at, held)),
            lasting_above=min(limit.lasting_above, float(np.log1p(clear_at * (1.0 - held)))),
        )
        for limit, both, held in zip(
            _beside_others(responses, twice, clear_at, ahead, len(twice) if driven is None else driven),
            twice,
            carried or [0.0] * len(twice),
            strict=True,
        )
    ]


def long_limit(most: Sequence[float], i: int, below: float) -> float:
    """Limit of a wheel's speed per opening over ten seconds [ln], where either of its sides is measured twice.

    `most` is by how much each wheel is below its usual one at most, and `below` the wheel's own limit in windows [ln].
    """
    return alone(most, i, below, _LEAST_LONG, _ALONE)


def _beside_axles(
    below: Sequence[float], i: int, limit: float, least: float, ahead: Sequence[float] | None, times: float
) -> float:
    """Limit of a wheel beside those of other axles alone: both of one may lose together; those of one side differ in turns anyway."""
    if ahead is None:
        return limit
    others = [x for j, x in enumerate(below) if j == i or abs(ahead[j] - ahead[i]) > _ABREAST_M]
    place = sum(abs(ahead[j] - ahead[i]) > _ABREAST_M for j in range(i))
    return alone(others, place, limit, least, times)


def _seen(clear_at: float, carried: float) -> float:
    """By how much a wheel's speed falls by a loss of its valve while the ground gives it a share of it [ln]."""
    return -float(np.log1p(-clear_at * (1.0 - carried)))


def _beside_others(
    responses: Responses,
    twice: Sequence[tuple[bool, bool]],
    clear_at: float,
    ahead: Sequence[float] | None,
    driven: int,
) -> list[Limits]:
    most = [[float(x) for x in largest(sign * responses.windows)] for sign in (-1.0, 1.0)]
    below = [usual.below for usual in responses.usual]
    out = []
    for i, both in enumerate(twice):
        limit = usual_limits(both, clear_at)
        seen = _LEAST_SEEN_TWICE if any(both) else _LEAST_SEEN
        changed = _LEAST_CHANGED_TWICE if any(both) else _LEAST_CHANGED
        more = _CHANGED_ALONE if any(both) else _CHANGED_ONCE
        limit = limit._replace(
            changed=alone(responses.changes, i, limit.changed, changed, more),
            grown=alone(responses.grown, i, limit.grown, changed, more),
        )
        if driven == PAIR and all(both):
            share = -float(np.log1p(-clear_at))
            limit = limit._replace(
                below=min(limit.below, _OF_PAIR * share),
                changed=min(limit.changed, _CHANGES_OF_PAIR * share),
                grown=min(limit.grown, _CHANGES_OF_PAIR * share),
                lasting_below=min(limit.lasting_below, _LASTS_OF_PAIR * share),
            )
        if not all(both):  # else what is left lies behind the drive, which shows longer
            more = _IN_WINDOWS_TWICE if any(both) else _IN_WINDOWS
            beside = (
                alone(most[0], i, limit.below, seen, more),
                _beside_axles(most[0], i, limit.below, seen, ahead, more),
            )
            limit = limit._replace(below=min(beside), above=alone(most[1], i, limit.above, seen, more))
        least, times = (_LEAST_LASTING, _ALONE) if any(both) else (_LEAST_SEEN, _LASTING_ALONE)
        if any(both) or clear_at <= _STRICT:
            limit = limit._replace(lasting_below=alone(below, i, limit.lasting_below, least, times))
        out.append(limit)
    return out
