"""How the faults of a mission end, before it is a document: the notion of `diagnosis.results.ending` on states by sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.results.assessment import STATES, Assessment
from diagnosis.results.ending import NEVER_JUDGED, Ending, how_it_ends
from diagnosis.results.result import FaultInterval
from replay.faults import State

_NEVER = [STATES.index(state) for state in NEVER_JUDGED]


def endings_of(
    faults: Sequence[FaultInterval], assessments: Mapping[tuple[str, str], Assessment], end_s: float | None
) -> dict[str, Ending]:
    """How each fault ends, by its name; none where the end of the log is not known.

    Parameters
    ----------
    faults : Sequence[FaultInterval]
        The faults.
    assessments : Mapping
        By component and side.
    end_s : float or None
        End of the log [s].
    """
    if not end_s:
        return {}
    out = {}
    for fault in faults:
        healthy = []
        sides = [assessments[fault.component, side].states for side in fault.side.sides]
        judged = [states for states in sides if not np.isin(states, _NEVER).all()]
        for states in judged or sides:
            behind = states[int(fault.stop_s / end_s * states.size) :]
            healthy.append(np.count_nonzero(behind == STATES.index(State.HEALTHY)) * end_s / states.size)
        out[fault.id] = how_it_ends(fault.stop_s, end_s, min(healthy))
    return out
