"""Trends of a fleet: every component and side of every machine, in order of the missions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.may_leave import is_lost
from diagnosis.audit.fleet.runs import Run, sides_of
from diagnosis.audit.fleet.trend_types import Axis
from diagnosis.audit.trends.trend import CONFIDENCE, REACH, Forecast, Series, Trend, trend_of
from diagnosis.decision.severity import HALF

_DAY_NS = 86_400 * 10**9
_NONE = np.empty(0, np.intp)
_GROWTH = 3  # missions that show growth where no line is known yet
_AHEAD = 2.0  # missions
_FIRST = 2  # missions whose mean is where a relative loss begins


@dataclass(frozen=True)
class PartTrend:
    """Trend of ε̂ of one component and side of a machine; `runs` are the missions that have an estimate."""

    component: str
    side: str
    kind: str
    limit: float
    runs: tuple[Run, ...]
    series: Series
    trend: Trend

    @property
    def approaching(self) -> bool:
        """Whether it rises for certain and likely reaches the limit within as long as the stretch has lasted."""
        f = self.trend.forecast
        return self.trend.direction == "rising" and f.likely is not None and f.likely <= f.horizon / REACH

    @property
    def halving(self) -> bool:
        """Whether it grows so fast that half may be lost (ε ≥ `HALF`) before two more missions like the last ones are over.

        By the line of its last stretch where that rises for certain, by its 90 % bound; else by the last three missions, of which
        each lost more than the one before beyond its bounds.
        """
        x = self.series.x[self.trend.first :]
        value, low, high = (c[self.trend.first :] for c in (self.series.value, self.series.low, self.series.high))
        if len(x) < _GROWTH:
            return False
        line = self.trend.line
        if line is not None and self.trend.direction == "rising":
            ahead = _AHEAD * float(np.median(np.diff(x)))
            return line.crossing(HALF, self.series.now, CONFIDENCE)[0] <= self.series.now + ahead
        steps = np.diff(value[-_GROWTH:])
        grows = bool((low[1 - _GROWTH :] > high[-_GROWTH:-1]).all()) and float(steps.min()) > 0.0
        return grows and float(value[-1]) + _AHEAD * float(steps.mean()) >= HALF


def trends_of(machine: Machine, axis: Axis = "hours") -> list[PartTrend]:
    """Trends of a machine's parts; those without any estimate are left out.

    Parameters
    ----------
    machine : Machine
        Dated missions count alone.
    axis : str
        ``hours`` of driving in the audited missions, or ``days`` since the first of them.
    """
    if not machine.dated:
        return []
    table, (places, now) = machine.table, _places(machine.dated, axis)
    out = []
    for component, side in machine.parts:
        column = machine.columns.get((component, side), _NONE)[: len(machine.dated)]
        found = np.flatnonzero((column >= 0) & np.isfinite(table.value[column]))
        if not len(found):
            continue
        relative = bool(table.relative[column[found[-1]]])
        found = found[table.relative[column[found]] == relative]
        rows = column[found]
        value, low, high = table.value[rows], table.low[rows], table.high[rows]
        x = places[found]
        if relative:  # how unlike the wheels are made is no loss: it counts from the machine's first missions
            made = float(value[:_FIRST].mean())
            value, low, high = value - made, low - made, high - made
        series = Series(x, value, low, high, now)
        trend = trend_of(series, machine.limits.min_epsilon)
        if not machine.id:
            none = Forecast("not_known", why="the machine has no identity, so that missions of several may be mixed")
            trend = Trend(None, trend.first, trend.outliers, trend.changes, "not_known", none)
        runs = tuple(map(machine.dated.__getitem__, found.tolist()))
        kind = machine.kind(component)
        out.append(PartTrend(component, side, kind, machine.limits.min_epsilon, runs, series, trend))
    return out


def fast_losses(machine: Machine, trends: Sequence[PartTrend]) -> tuple[tuple[str, str], ...]:
    """Components and sides that may have lost half before two more missions are over, by how the loss grows, and were not repaired since."""
    return tuple((t.component, t.side) for t in trends if t.halving and not _repaired_since(machine, t))


def _repaired_since(machine: Machine, t: PartTrend) -> bool:
    """Whether the part of a trend was repaired after the trend's last mission."""
    at = t.runs[-1].result.start_ns
    mine = [f for f in machine.faults if f.component == t.component and t.side in sides_of(f.side)]
    return any(f.repaired_ns is not None and at is not None and at < f.repaired_ns for f in mine)


def untold_losses(machine: Machine, trends: Sequence[PartTrend]) -> tuple[tuple[str, str], ...]:
    """Components and sides whose loss in the last mission is beyond the limit for certain, without a fault that stands or a repair since."""
    out = []
    for t in trends:
        if not is_lost(float(t.series.low[-1]), t.limit):
            continue
        mine = [f for f in machine.faults if f.component == t.component and t.side in sides_of(f.side)]
        if not _repaired_since(machine, t) and not any(f.standing for f in mine):
            out.append((t.component, t.side))
    return tuple(out)


def _places(runs: Sequence[Run], axis: Axis) -> tuple[NDArray[np.float64], float]:
    """Middle of each mission and end of the last, in hours of driving or days."""
    if axis == "days":
        begin = runs[0].result.start_ns or 0
        ends = [((r.result.start_ns or 0) - begin) / _DAY_NS + (r.result.duration_s or 0.0) / 86_400 for r in runs]
        half = [(r.result.duration_s or 0.0) / 172_800 for r in runs]
        return np.array(ends) - np.array(half), max(ends)
    hours = np.array([(r.result.driving_s or 0.0) / 3600 for r in runs])
    after = np.cumsum(hours)
    return after - hours / 2, float(after[-1])
