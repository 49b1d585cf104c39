"""What is seen of a part between two findings: healthy steps that would have shown their fault, or the fault itself, too small to be found."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.one_delay import late_s
from diagnosis.results.assessment import CODE, Assessment, Finding
from replay.arrays.envelope import bucket_of, step_of
from replay.faults import State

_AS_LATE, _EVEN_S = (
    0.25,
    0.5,
)  # of a delay, by which two may differ; over which a reference is evened before it is asked how it changes
_FITS = 0.5  # of what is off by no loss: what is left of it by the loss, where the loss goes on


def as_late(a: Finding, b: Finding) -> bool:
    """Whether two findings are late by as much, or neither is late."""
    late = sorted((late_s(a), late_s(b)))
    return late[1] - late[0] <= _AS_LATE * late[1]


def healthy_steps(a: Finding, b: Finding, sides: Mapping[str, Assessment], dt: float) -> float:
    """Steps between two findings in which what they may be of is seen to be healthy, or gives no data.

    A side of which nothing healthy is ever said, as of a drive without effort, does not speak against a sensor that reads right. A
    healthy step counts by how far the loss would show in it.

    Parameters
    ----------
    a, b : Finding
        One, and a later one, of the same part.
    sides : Mapping[str, Assessment]
        Both sides of the part.
    dt : float
        Step [s].
    """
    known = [sides[s.value] for s in a.side.sides if s.value in sides]
    telling = [one for one in known if np.any(one.states == CODE[State.HEALTHY])] or known
    counts = [
        np.where(s == CODE[State.HEALTHY], _shows(a, b, one, dt), s == CODE[State.NO_DATA])
        for one in telling
        for s in [one.states[a.stop : b.start]]
    ]
    return float(np.sum(np.minimum.reduce(counts)))


def _shows(a: Finding, b: Finding, one: Assessment, dt: float) -> NDArray[np.float64]:
    """How far the lesser loss of a share, or delay, would show at each step between two findings [1]: its square beside the threshold's, 1 at most.

    All would of what loses no share, and where the evidence has no such series.
    """
    steps = np.arange(a.stop, b.start)
    expected, threshold = (one.columns.get(name) for name in ("expected", "threshold"))
    sizes = [f.epsilon.value for f in (a, b) if f.epsilon is not None]
    late = min(late_s(a), late_s(b))
    if not (late > 0.0 or (a.mode.scaled and len(sizes) == 2)) or expected is None or threshold is None:
        return np.ones(steps.size)
    step = step_of(bucket_of(one.states.size))
    rows = np.minimum((steps / step).astype(np.intp), len(expected) - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        known = np.asarray(expected, np.float64)
        off = _lags(known, late, step * dt) if late > 0.0 else min(sizes) * known
        share = (off[rows] / np.asarray(threshold, np.float64)[rows]) ** 2
    return np.minimum(np.nan_to_num(share, nan=1.0, posinf=1.0), 1.0)


def _lags(x: NDArray[np.float64], late: float, dt: float) -> NDArray[np.float64]:
    """By how much a channel that is so late [s] is off x, evened against its noise, shape (n,) in the unit of x."""
    width = max(1, round(_EVEN_S / dt))
    total = np.cumsum(np.r_[np.zeros(width), np.nan_to_num(x), np.full(width, np.nan_to_num(x[-1:])[0])])
    ahead, behind = (
        (total[2 * width :] - total[width:-width]) / width,
        (total[width:-width] - total[: -2 * width]) / width,
    )
    return np.asarray(late * (ahead - behind) / (width * dt))


def goes_on(a: Finding, b: Finding, one: Assessment) -> bool:
    """Whether what is called healthy between two losses of a share fits their loss far better than none; not where nothing is known of it.

    Parameters
    ----------
    a, b : Finding
        One, and a later one, of the same part.
    one : Assessment
        Of a side that both may be of.
    """
    healthy = np.flatnonzero(one.states[a.stop : b.start] == CODE[State.HEALTHY]) + a.stop
    sizes = [f.epsilon.value for f in (a, b) if f.epsilon is not None]
    expected, residual = (one.columns.get(name) for name in ("expected", "residual"))
    if not healthy.size or len(sizes) < 2 or expected is None or residual is None:
        return False
    rows = np.minimum((healthy / step_of(bucket_of(one.states.size))).astype(np.intp), len(expected) - 1)
    off, x = np.asarray(residual, np.float64)[rows], np.asarray(expected, np.float64)[rows]
    known = np.isfinite(off) & np.isfinite(x)
    lost = np.sum((off[known] + 0.5 * sum(sizes) * x[known]) ** 2)
    return bool(known.any() and lost < _FITS * np.sum(off[known] ** 2))


def late_on(a: Finding, b: Finding, one: Assessment, dt: float) -> bool:
    """Whether what is called healthy between two findings that are as late fits their delay far better than none.

    Parameters
    ----------
    a, b : Finding
        One, and a later one, of the same part.
    one : Assessment
        Of a side that both may be of.
    dt : float
        Step [s].
    """
    late = 0.5 * (late_s(a) + late_s(b))
    healthy = np.flatnonzero(one.states[a.stop : b.start] == CODE[State.HEALTHY]) + a.stop
    expected, residual = (one.columns.get(name) for name in ("expected", "residual"))
    if min(late_s(a), late_s(b)) <= 0.0 or not healthy.size or expected is None or residual is None:
        return False
    step = step_of(bucket_of(one.states.size))
    rows = np.unique(np.minimum((healthy / step).astype(np.intp), len(expected) - 1))
    x, off = np.asarray(expected, np.float64), np.asarray(residual, np.float64)[rows]
    before = np.interp(rows - late / (step * dt), np.arange(x.size), x)
    known = np.isfinite(off) & np.isfinite(before) & np.isfinite(x[rows])
    lost = np.sum((off - before + x[rows])[known] ** 2)
    return bool(known.any() and lost < _FITS * np.sum(off[known] ** 2))
