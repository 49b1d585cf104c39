"""Axles that stand still while they are commanded because they answer late, each time: late, and not dead.

An angle that comes half a second late, or a valve that opens so late, stands still for as long whenever the command begins. What tells it
from a dead valve or sensor is that its rate follows its opening as well as another axle's does, once it is shifted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.still import rate_of
from diagnosis.results.assessment import Finding
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, Sentence
from replay.faults import FaultMode, State

_WINDOW_S, _STEP_S, _LATEST_S = 12.0, 3.0, 1.5  # of a course, from one to the next, and lags that are tried
_FOLLOWS, _BETTER, _LATER_S = (
    0.9,
    0.1,
    0.2,
)  # correlation with the shifted opening; beyond the usual lag's; and beyond that lag [s]
_MOSTLY, _ALIKE = 0.75, 0.35  # of the windows of the fault; by how much their lags may differ, of them
_MOVED = 0.03  # of full opening, root mean square: a window in which an axle is steered
_P = 0.9


class Lags(NamedTuple):
    """How one axle's rate follows its opening in windows.

    Attributes
    ----------
    start : NDArray[np.intp], shape (windows,)
        First cell of each.
    lag, best : Array, shape (windows,)
        By how much it is later where that fits best [s], and the correlation there; NaN where it is not steered.
    at : Array, shape (windows, lags)
        Correlation at every lag.
    """

    start: NDArray[np.intp]
    lag: Array
    best: Array
    at: Array


def as_late_axles(found: Mapping[str, Finding], cells: Cells, words: MachineWords) -> dict[str, Finding]:
    """Faults that stand out, by component, those of axles that do nothing as late where these follow their openings later, throughout.

    Parameters
    ----------
    found : Mapping[str, Finding]
        Faults that no row was told of.
    cells : Cells
        The mission.
    words : MachineWords
        How to speak of the machine.
    """
    axles = cells.machine.axles
    if not any(a in found and found[a].mode is FaultMode.NO_SIGNAL for a in axles):
        return dict(found)
    angles, commands, positions = (cells.axles(leaf) for leaf in ("phi", "u", "u_applied"))
    openings = np.where(np.isfinite(positions).any(axis=0), positions, commands)
    rates = rate_of(angles, cells.dt)
    lags = {a: lags_of(rates[:, j], openings[:, j], cells.dt) for j, a in enumerate(axles)}
    return {part: _late(part, f, lags, cells, words) if part in lags else f for part, f in found.items()}


def lags_of(rate: Array, opening: Array, dt: float) -> Lags:
    """By how much a rate [rad/s] follows an opening [1] later, in windows; both of shape (cells,), `dt` in s."""
    width, most = max(2, round(_WINDOW_S / dt)), max(1, round(_LATEST_S / dt))
    start = np.arange(most, max(most + 1, rate.size - width + 1), max(1, round(_STEP_S / dt)), dtype=np.intp)
    at = np.full((start.size, most + 1), np.nan)
    for i, first in enumerate(start):
        y = rate[first : first + width]
        for late in range(most + 1):
            x = opening[first - late : first - late + width]
            known = np.isfinite(x[: y.size]) & np.isfinite(y)
            a, b = x[: y.size][known], y[known]
            if a.size > width // 2 and np.sqrt(np.mean(a**2)) > _MOVED and np.std(a) > 0.0 and np.std(b) > 0.0:
                at[i, late] = np.corrcoef(a, b)[0, 1]
    filled = np.where(np.isfinite(at), at, -1.0)
    k = np.argmax(filled, axis=1)
    best = filled[np.arange(start.size), k]
    told = best > -1.0
    return Lags(start, np.where(told, k * dt, np.nan), np.where(told, best, np.nan), at)


def _late(axle: str, f: Finding, every: Mapping[str, Lags], cells: Cells, words: MachineWords) -> Finding:
    """The fault of an axle as a delay, where that is what it is."""
    own, dt = every[axle], cells.dt
    others = np.concatenate([lag.lag[lag.best > _FOLLOWS] for a, lag in every.items() if a != axle] or [np.zeros(0)])
    usual = float(np.median(others)) if others.size else float(np.nanmin(own.lag, initial=np.inf))
    if f.mode is not FaultMode.NO_SIGNAL or not np.isfinite(usual):
        return f
    base = own.at[:, min(round(usual / dt), own.at.shape[1] - 1)]
    with np.errstate(invalid="ignore"):
        late = (own.best >= _FOLLOWS) & (own.lag - usual >= _LATER_S) & (own.best - base >= _BETTER)
    width = round(_WINDOW_S / dt)
    first, last = own.start * cells.width, (own.start + width) * cells.width
    inside = (last > f.start) & (first < f.stop) & np.isfinite(own.lag)
    if np.count_nonzero(late & inside) < 2 or np.mean(late[inside]) < _MOSTLY:
        return f
    seconds = own.lag[late & inside]
    middle = float(np.median(seconds))
    if np.ptp(seconds) > _ALIKE * middle:
        return f
    text = Sentence(
        About.LATE,
        "It comes ",
        f"{1e3 * (middle - usual):.0f}",
        words.fill(f" ms later than usual after what its {{valve}} is told, each time ({axle}): a delay."),
    )
    either = "An angle that is read late and a {valve} that opens late look alike: a second measurement of either would tell them apart."
    rows = (
        Hypothesis(f.side.value, FaultMode.OUTSIDE_TABLE.value, _P),
        Hypothesis("none", State.HEALTHY.value, 1.0 - _P),
    )
    return replace(
        f,
        start=int(min(f.start, first[late & inside].min())),
        stop=int(max(f.stop, min(last[late & inside].max(), cells.timeline.size))),
        mode=FaultMode.OUTSIDE_TABLE,
        probability=_P,
        hypotheses=rows,
        epsilon=None,
        evidence=(text, words.fill(either)),
    )
