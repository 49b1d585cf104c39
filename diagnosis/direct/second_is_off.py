"""A second speed that deviates by itself is no fault of the sensor beside it.

Two measurements that differ do not say which of them is wrong. What turns the wheel does: whatever the speed really did, the
opening of its drive and the other wheels explain it as well as they usually do. A loop around a faulty sensor holds that sensor's
reading and moves the wheel, with the opening, so that the second speed is still explained. Where that is the one which is not, and
the sensor is, nothing is said of the sensor; of a difference that stays the same, a constant share or offset, this tells nothing.
But a wheel whose drive is closed, and which by its sensor stands as the other wheels do, does not turn, whatever its second speed reads.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.low_speed import left_open
from diagnosis.estimation.lag import low_passed
from diagnosis.results.assessment import Assessment, Finding
from replay.arrays.numeric import without_nan
from replay.arrays.quantiles import median_known, median_of
from replay.arrays.runs import runs_of

Array = NDArray[np.float64]

_CELL_S, _WINDOW_S, _SHORTEST_S = 0.1, 5.0, 1.5
_LAGS_S = (0.15, 0.5)  # of a drive
_LEAST_USUAL = 3  # windows without any finding
_UNEXPLAINED, _EXPLAINED = 3.0, 2.0  # times what is usually left: more of the one, less of the other measurement
_OF_OTHER = 0.4  # of what is left of the second speed, at most left of the sensor
_OF_DIFFERENCE = 0.5  # of how the two differ, at least left of the second speed
_LEAST_POINTS = 3  # per column
_CLOSED, _RESTS, _NEARLY_ALL = 0.03, 0.02, 0.7  # of full opening; of the span; of a finding's time
_OTHERS = 2  # wheels that stand as well


@dataclass(frozen=True)
class _Left:
    """What the drive and the other wheels leave of both measurements in a window, root mean square [m/s]; `apart`: of their difference's changes."""

    sensor: float
    second: float
    apart: float


def without_second_speeds_own(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment], openings: Mapping[str, Array]
) -> dict[str, Assessment]:
    """Assessments of speed sensors without findings that are the second speed's.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Sensors beside their second measurements, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    openings : Mapping[str, Array], each of shape (n,)
        The drives' measured openings [of full opening], or their commands, by wheel.
    """
    assessments = _without_at_rest(found, assessments, openings)
    if not any(not f.mode.total for a in assessments.values() for f in a.findings):
        return assessments
    cells = {
        wheel: _cells(one, openings[wheel], [other.pair.y for name, other in found.items() if name != wheel])
        for wheel, one in found.items()
        if wheel in openings
    }
    usual = {wheel: _usual(assessments[wheel].findings, own, found[wheel].pair.dt) for wheel, own in cells.items()}
    out = dict(assessments)
    for wheel, own in cells.items():
        a, dt = assessments[wheel], found[wheel].pair.dt
        known = usual[wheel] if len(usual[wheel]) >= _LEAST_USUAL else [u for of in usual.values() for u in of]
        if len(known) >= _LEAST_USUAL:
            varying = [f for f in a.findings if not f.mode.total]
            out[wheel] = left_open(a, [f for f in varying if _is_seconds(f, known, own, dt)])
    return out


def _without_at_rest(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment], openings: Mapping[str, Array]
) -> dict[str, Assessment]:
    """The same without sensors that read nothing while their drives are closed and the other wheels stand: their second speeds are off."""
    out = dict(assessments)
    for wheel, one in found.items():
        total = [f for f in assessments[wheel].findings if f.mode.total]
        others = [other.pair.y for name, other in found.items() if name != wheel]
        if total and wheel in openings and len(others) >= _OTHERS:
            rests = [f for f in total if _rests(f, one, openings[wheel], others)]
            out[wheel] = left_open(assessments[wheel], rests)
    return out


def _rests(finding: Finding, one: IdentifiedPair, opening: Array, others: Sequence[Array]) -> bool:
    """Whether a drive is closed, its sensor reads nothing and most other wheels stand for nearly all of a finding."""
    part, least = slice(finding.start, finding.stop), _RESTS * one.pair.span
    closed = np.abs(np.nan_to_num(opening[part], nan=np.inf)) <= _CLOSED
    stand = np.column_stack([np.abs(np.nan_to_num(y[part], nan=np.inf)) <= least for y in others])
    own = np.abs(np.nan_to_num(one.pair.y[part], nan=np.inf)) <= least
    return bool(np.mean(closed & own & (stand.mean(axis=1) > 0.5)) >= _NEARLY_ALL)


@dataclass(frozen=True)
class _Cells:
    """Means over a tenth of a second: both measurements, each of shape (cells,), what explains them, (cells, columns), and its width [samples]."""

    sensor: Array
    second: Array
    explains: Array
    width: int


def _cells(one: IdentifiedPair, opening: Array, others: Sequence[Array]) -> _Cells:
    pair = one.pair
    width = max(1, round(_CELL_S / pair.dt))
    known = without_nan(opening)
    drives = [low_passed(known, lag, pair.dt) for lag in _LAGS_S]
    columns = [_means(x, width) for x in (*drives, *others)]
    if others:
        columns = [*columns[: len(drives)], _middle(columns[len(drives) :])]
    ones = np.ones(columns[0].size)
    return _Cells(_means(pair.y, width), _means(pair.x, width), np.column_stack([ones, *columns]), width)


def _middle(columns: Sequence[Array]) -> Array:
    """Median of what is known of some columns, 0 where nothing is."""
    stacked = np.column_stack(columns)
    some = np.isfinite(stacked).any(axis=1)
    out = np.zeros(len(stacked))
    out[some] = median_known(stacked[some], axis=1)
    return out


def _means(x: Array, width: int) -> Array:
    """Means of what is known in each cell, NaN where nothing is."""
    size = x.size // width * width
    cut = x[:size].reshape(-1, width)
    known = np.isfinite(cut)
    count = np.count_nonzero(known, axis=1)
    return np.where(count > 0, np.where(known, cut, 0.0).sum(axis=1) / np.maximum(count, 1), np.nan)


def _usual(findings: Sequence[Finding], cells: _Cells, dt: float) -> list[_Left]:
    """What is left in windows apart from all findings."""
    taken = np.zeros(cells.sensor.size, np.bool_)
    for f in findings:
        taken[f.start // cells.width : -(-f.stop // cells.width)] = True
    windows = (w for a, b in runs_of(~taken) for w in _windows(a * cells.width, b * cells.width, cells.width, dt))
    return [left for w in windows if (left := _left(w, cells)) is not None]


def _is_seconds(finding: Finding, usual: Sequence[_Left], cells: _Cells, dt: float) -> bool:
    """Whether a finding's deviation is what the second speed does by itself."""
    if (finding.stop - finding.start) * dt < _SHORTEST_S:
        return False
    inside = _together([_left(w, cells) for w in _windows(finding.start, finding.stop, cells.width, dt)])
    if inside is None:
        return False
    most = max(float(median_of([u.sensor for u in usual])), float(median_of([u.second for u in usual])))
    return (
        inside.second > _UNEXPLAINED * most
        and inside.sensor < _EXPLAINED * most
        and inside.sensor < _OF_OTHER * inside.second
        and inside.second > _OF_DIFFERENCE * inside.apart
    )


def _windows(start: int, stop: int, width: int, dt: float) -> list[slice]:
    """A stretch of samples in windows of cells of nearly equal length, no longer than 5 s and no shorter than 1.5 s."""
    first, last = -(-start // width), stop // width
    if (last - first) * width * dt < _SHORTEST_S:
        return []
    count = max(1, round((last - first) * width * dt / _WINDOW_S))
    edges = np.linspace(first, last, count + 1).astype(int)
    return [slice(int(a), int(b)) for a, b in itertools.pairwise(edges)]


def _left(part: slice, cells: _Cells) -> _Left | None:
    """What is left in a window; None where too little is known, or nothing moves."""
    y, x, explains = cells.sensor[part], cells.second[part], cells.explains[part]
    known = np.isfinite(y) & np.isfinite(x) & np.isfinite(explains).all(axis=1)
    if np.count_nonzero(known) < _LEAST_POINTS * explains.shape[1] or not np.any(x[known] != 0.0):
        return None
    y, x, explains = y[known], x[known], explains[known]
    both = np.column_stack([y, x])
    rest = both - explains @ np.linalg.lstsq(explains, both, rcond=None)[0]
    sensor, second = np.sqrt(np.mean(rest**2, axis=0))
    return _Left(float(sensor), float(second), float(np.std(y - x)))


def _together(windows: Sequence[_Left | None]) -> _Left | None:
    """Root mean squares over some windows; None where nothing is known of most."""
    known = [w for w in windows if w is not None]
    if not known or 2 * len(known) < len(windows):
        return None
    return _Left(
        *(float(np.sqrt(np.mean([getattr(w, name) ** 2 for w in known]))) for name in ("sensor", "second", "apart"))
    )
