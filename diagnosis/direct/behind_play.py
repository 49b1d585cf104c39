"""A loss of gain behind the play of a valve: its command is scaled before the play, not after it."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.estimation.segments import Run

_SETTLES_S = 0.2
_GRID = 24
_EXPLAINED = 1.5  # times the noise: what is left of a run that a loss of gain explains
_LEAST, _MOST = 0.05, 0.95


def gain_behind_play(run: Run, found: IdentifiedPair) -> float | None:
    """δ of y = relation(δ·x) where that explains a run as well as a healthy channel is explained; None where none does.

    Without a unit [1].

    Parameters
    ----------
    run : Run
        A run of an actuator with play.
    found : IdentifiedPair
        The pair.
    """
    pair, relation, dt = found.pair, found.relation, found.pair.dt
    settles = round(_SETTLES_S / dt)
    first = max(0, run.start - settles)
    status = found.samples.status[first : run.stop]
    use = status == PAIR
    use[: run.start - first + min(settles, run.size // 4)] = False
    if np.count_nonzero(use) < 3:
        return None
    y, x = pair.y[first : run.stop], pair.x[first : run.stop]

    def left(delta: float) -> float:
        rest = y[use] - relation.expected(delta * x, dt)[use]
        return float(np.nanmean(rest**2))

    low, high = 0.0, 1.0
    for _ in range(2):
        grid = np.linspace(low, high, _GRID)
        best = int(np.argmin([left(d) for d in grid]))
        low, high = grid[max(0, best - 1)], grid[min(_GRID - 1, best + 1)]
    delta = float(grid[best])
    explained = left(delta) <= (_EXPLAINED * found.model.noise) ** 2
    return delta if explained and _LEAST < delta < _MOST else None
