"""Trend of the loss of effectiveness ε̂ of one component and side across missions, and when it reaches a limit.

The missions' estimates are laid over the driving hours before them (or days), outliers are set aside and the series is
cut at steps and bends (`diagnosis.audit.trends.changes`): the trend is that of the last stretch alone, so that a repair
starts it anew. Through the stretch goes a weighted line (`diagnosis.audit.trends.line`); where it meets the limit is given
with Fieller's 90 % interval. Wear may have begun to grow faster without showing for certain, so the interval begins where
a line after the likeliest bend would begin it. The line stands for the mean of missions; single ones scatter by `tau`.

No forecast is made from fewer than five missions in the stretch, where the last mission is off the line, where a quarter
of the missions are outliers, and none reaches further ahead than three times the stretch that it rests on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.audit.trends.changes import Change, find_changes, possible_bend
from diagnosis.audit.trends.kinds import Direction, ForecastState
from diagnosis.audit.trends.line import Array, Line, Weighted, fit_line, sigmas, varies, weighted

CONFIDENCE = 0.9
LEAST_MISSIONS = 5
REACH = 3.0


@dataclass(frozen=True)
class Series:
    """What the missions of a machine say of one component and side, in order of x.

    Attributes
    ----------
    x : NDArray[np.float64], shape (n,)
        Driving hours (or days) at the middle of each mission.
    value, low, high : NDArray[np.float64], shape (n,)
        ε̂ and its 95 % bounds [1].
    now : float
        Hours (or days) at the end of the machine's last mission.
    """

    x: NDArray[np.float64]
    value: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    now: float


@dataclass(frozen=True)
class Forecast:
    """When the trend reaches the limit.

    Attributes
    ----------
    state : str
        ``crossing``: within the interval; ``above``: the trend is at the limit already; ``not_within``: not within
        `horizon`; ``not_known``: see `why`.
    soonest, likely, latest : float or None
        From now on, unit of x; None where there is none within `horizon`.
    horizon : float
        How far ahead the trend is taken, unit of x.
    why : str
        Why nothing is known; empty otherwise.
    """

    state: ForecastState
    soonest: float | None = None
    likely: float | None = None
    latest: float | None = None
    horizon: float = 0.0
    why: str = ""


@dataclass(frozen=True)
class Trend:
    """Trend of one series.

    Attributes
    ----------
    line : Line or None
        Line of the last stretch; None where it is too short.
    first : int
        First mission of the last stretch.
    outliers : tuple[int, ...]
        Missions set aside.
    changes : tuple[Change, ...]
        Steps and bends.
    direction : str
        ``rising`` or ``falling`` where the slope's 95 % interval excludes 0, ``steady``, or ``not_known``.
    forecast : Forecast
        When the limit is reached.
    """

    line: Line | None
    first: int
    outliers: tuple[int, ...]
    changes: tuple[Change, ...]
    direction: Direction
    forecast: Forecast


def trend_of(series: Series, limit: float) -> Trend:
    """Fit the trend of a series and ask when it reaches a limit.

    Parameters
    ----------
    series : Series
        In order of x; values must be finite.
    limit : float
        Limit of ε [1].
    """
    x, y = series.x, series.value
    sigma = sigmas(y, series.low, series.high)
    known = weighted(x, y, sigma) if len(x) >= 3 and varies(x) else None
    found = find_changes(x, y, sigma, known)
    first = found.changes[-1].index if found.changes else 0
    kept = np.delete(np.arange(len(x)), found.outliers)
    kept = kept[kept >= first]
    known = known if len(kept) == len(x) else None
    line = None
    if len(kept) >= 3 and varies(x[kept]):
        line = fit_line(x[kept], y[kept], sigma[kept], known)
    why = _why_not(kept, found.outliers, found.changes, len(x), first)
    if why or line is None:
        forecast = Forecast("not_known", why=why or "the missions do not differ in driving time")
    else:
        lines = [line, *_faster(x[kept], y[kept], sigma[kept], line, known)]
        forecast = _forecast(lines, limit, series.now, REACH * float(series.now - _begin(x, first)))
    return Trend(line, first, found.outliers, found.changes, _direction(line if not why else None), forecast)


def _begin(x: Array, first: int) -> float:
    return float(x[first] if first == 0 else 0.5 * (x[first - 1] + x[first]))


def _why_not(kept: NDArray[np.intp], outliers: tuple[int, ...], changes: tuple[Change, ...], n: int, first: int) -> str:
    if not n:
        return "no mission has an estimate"
    if len(kept) < LEAST_MISSIONS:
        since = {"drop": " since the drop", "rise": " since the rise", "bend": " since the bend"}
        return f"{len(kept)} mission{'' if len(kept) == 1 else 's'}{since[changes[-1].kind] if changes else ''}, {LEAST_MISSIONS} are needed"
    if outliers and outliers[-1] == n - 1:
        return "the last mission deviates from the trend; the next one has to confirm it"
    if 4 * sum(o >= first for o in outliers) > n - first:
        return "too many missions deviate from the trend"
    return ""


def _direction(line: Line | None) -> Direction:
    if line is None:
        return "not_known"
    if abs(line.slope) <= line.quantile(0.95) * math.sqrt(line.slope_var):
        return "steady"
    return "rising" if line.slope > 0 else "falling"


def _faster(x: Array, y: Array, sigma: Array, line: Line, known: Weighted | None) -> list[Line]:
    """Line after the likeliest bend, where it rises faster: the bend may be there although it is not certain."""
    bend = possible_bend(x, y, sigma, known)
    if bend is None or not varies(x[bend:]):
        return []
    late = fit_line(x[bend:], y[bend:], sigma[bend:])
    return [late] if late.slope > line.slope else []


def _forecast(lines: list[Line], limit: float, now: float, horizon: float) -> Forecast:
    """Likely and latest crossing of the first line, soonest of any."""
    line = lines[0]
    if line.at(now) >= limit:
        return Forecast("above", horizon=horizon)
    soonest, likely, latest = (p - now for p in line.crossing(limit, now, CONFIDENCE))
    soonest = min([soonest, *(other.crossing(limit, now, CONFIDENCE)[0] - now for other in lines[1:])])
    if soonest > horizon:
        return Forecast("not_within", horizon=horizon)
    likely_within, latest_within = (p if p <= horizon else None for p in (likely, latest))
    return Forecast("crossing", soonest, likely_within, latest_within, horizon)
