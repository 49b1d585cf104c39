"""How long healthy channels stay at one value: what a sensor holds again and again, and no other one does, is no habit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.one_value import gaps_in
from diagnosis.response.machine import Judged

Array = NDArray[np.float64]

_OWN, _OTHERS = 4, 2  # holds of a channel that may be faults: of the one in question, and of each other
_GAP = 2.5  # times as long as all shorter ones, and as those of the others: such holds are no habit, however many there are
_LEAST_S = 0.25  # shorter ones are habits
_LONG_S = 0.75, 2.0  # a hold of less, and of more, is never, and always, longer than a habit


def usual_hold(wheel: str, holds: Mapping[str, Array]) -> float:
    """How long healthy channels stay at one value [s].

    Some holds of a channel may be faults, of another wheel's fewer. Where its holds fall into two groups with a gap between
    them, and those of all others are as short as the lower one, all of the upper group may be.

    Parameters
    ----------
    wheel : str
        The wheel in question.
    holds : Mapping[str, Array], each of shape (holds,)
        Of each wheel, the longest first [s].
    """
    others = max((float(x[_OTHERS]) for w, x in holds.items() if w != wheel and x.size > _OTHERS), default=0.0)
    mine = np.r_[holds[wheel], 0.0]
    own = float(mine[min(_OWN, mine.size - 1)])
    if len(holds) > 1:
        gaps = gaps_in(mine, _GAP, _GAP * max(others, _LEAST_S))
        own = min(own, float(mine[gaps[-1] + 1])) if gaps.size else own
    return max(own, others)


def with_habits(found: Mapping[str, Judged], holds: Mapping[str, Array]) -> dict[str, Judged]:
    """Wheels with how long healthy channels stay at one value, and from which length on a hold is none of that.

    `holds` as of `usual_hold`, of shape (holds,) each [s].
    """
    out = {}
    for w, j in found.items():
        habit = usual_hold(w, holds)
        blocks = j.wheel.blocks
        if len(found) > 1:
            blocks = blocks._replace(long_s=float(np.clip(_GAP * habit, *_LONG_S)))
        out[w] = j._replace(wheel=j.wheel._replace(habit=habit, blocks=blocks))
    return out
