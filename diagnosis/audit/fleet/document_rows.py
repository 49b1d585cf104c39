"""Trends and missions as they stand in a fleet's document; see `diagnosis.audit.fleet.document`."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.audit.fleet.fault_types import BoundsRow, MissionFaultRow
from diagnosis.audit.fleet.fleet_types import MissionRow
from diagnosis.audit.fleet.read import Bounds, FoundFault, Mission
from diagnosis.audit.fleet.trend_types import Axis, LineRow, TrendRow
from diagnosis.audit.fleet.trends import PartTrend
from diagnosis.audit.fleet.words import forecast_words
from diagnosis.audit.store.outcome import MissionState
from diagnosis.audit.trends.line import Line
from diagnosis.results.vocabulary import Severity

_POWERS = np.array([float(f"1e{k}") for k in range(17)])  # each of them exact


def trend_row(k: int, t: PartTrend, at: Mapping[str, int], axis: Axis, *, halving: bool = False) -> TrendRow:
    """One trend of the machine at place `k`; `at` holds each mission's place, `halving` whether half may be lost soon."""
    s, f = t.series, t.trend.forecast
    columns = six_digits_of(np.concatenate((s.x, s.value, s.low, s.high))).reshape(4, -1).tolist()
    return {
        "machine": k,
        "component": t.component,
        "kind": t.kind,
        "side": t.side,
        "limit": t.limit,
        "now": six_digits(s.now),
        "points": list(zip([at[r.name] for r in t.runs], *columns, strict=True)),
        "outliers": list(t.trend.outliers),
        "changes": [{"index": c.index, "kind": c.kind, "size": six_digits(c.size)} for c in t.trend.changes],
        "first": t.trend.first,
        "direction": t.trend.direction,
        "approaching": t.approaching,
        "halving": halving,
        "line": _line(t.trend.line, s.now),
        "forecast": {
            "state": f.state,
            "soonest": rounded(f.soonest),
            "likely": rounded(f.likely),
            "latest": rounded(f.latest),
            "horizon": six_digits(f.horizon),
            "words": forecast_words(f, t.limit, axis),
        },
    }


def _line(line: Line | None, now: float) -> LineRow | None:
    if line is None:
        return None
    level, half = line.at(now), line.half(now, 0.95)
    spread = line.quantile(0.95) * line.slope_var**0.5
    return {
        "level": {"value": six_digits(level), "low": six_digits(level - half), "high": six_digits(level + half)},
        "slope": {
            "value": six_digits(line.slope),
            "low": six_digits(line.slope - spread),
            "high": six_digits(line.slope + spread),
        },
        "tau": six_digits(line.tau),
        "centre": six_digits(line.centre),
        "dof": line.dof,
    }


def mission_row(
    m: Mission, owner: int | None, first: str | None, first_run: int | None, *, judged: bool = False
) -> MissionRow:
    """One mission of the machine at place `owner`; `first` names the first of its copies; `judged`: every part of a wheel was judged long enough."""
    r = m.result
    if r is None:
        return {
            "name": m.name,
            "files": list(m.files),
            "bytes": m.bytes,
            "gone": m.gone,
            "machine": owner,
            "state": MissionState.PENDING,
            "reason": "not audited yet",
            "verdict": None,
            "faults": [],
        }
    faults = sorted(
        (f for f in r.faults if f.severity is not Severity.INFO), key=lambda f: (-f.severity.rank, -f.seconds)
    )
    return {
        "name": m.name,
        "files": list(m.files),
        "bytes": m.bytes,
        "gone": m.gone,
        "machine": owner,
        "state": r.state,
        "reason": r.reason,
        "verdict": r.verdict,
        "title": r.title,
        "start_ns": r.start_ns,
        "duration_s": rounded(r.duration_s),
        "driving_s": rounded(r.driving_s),
        "distance_m": rounded(r.distance_m),
        "open_loop": r.open_loop,
        "attempts": r.attempts,
        "version": r.version,
        "report": r.report,
        "first_run": first_run,
        "judged": judged,
        "copy_of": None if first == m.name else first,
        "faults": [_fault(f) for f in faults],
    }


def _fault(f: FoundFault) -> MissionFaultRow:
    return {
        "id": f.id,
        "component": f.component,
        "kind": f.kind,
        "side": f.side,
        "mode": f.mode,
        "severity": f.severity,
        "seconds": six_digits(f.seconds),
        "epsilon": bounds_row(f.epsilon),
        "probability": six_digits(f.probability),
        "unclear": f.unclear,
        "lasting": f.lasting,
    }


def bounds_row(b: Bounds | None) -> BoundsRow | None:
    """ε̂ with its bounds, rounded."""
    if b is None:
        return None
    return {"value": six_digits(b.value), "low": six_digits(b.low), "high": six_digits(b.high)}


def rounded(value: float | None) -> float | None:
    """Six significant digits, None where there is no finite number."""
    return None if value is None or not math.isfinite(value) else six_digits(value)


def six_digits_of(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same of finite numbers, shape (n,); a number as near to two of six digits as can be told may become either."""
    size = np.abs(values)
    place = 5 - np.floor(np.log10(np.where(size > 0, size, 1.0))).astype(np.intp)
    if len(values) and (place.min() < 0 or place.max() >= len(_POWERS) - 1):
        return np.array([six_digits(float(v)) for v in values])
    place += np.rint(values * _POWERS[place]).__abs__() < 1e5  # where the logarithm was rounded up to a whole number
    place -= np.rint(values * _POWERS[place]).__abs__() >= 1e6
    place = np.maximum(place, 0)
    rounded: NDArray[np.float64] = np.rint(values * _POWERS[place]) / _POWERS[place] + 0.0
    return rounded


def six_digits(value: float) -> float:
    """Six significant digits; the same on every computer."""
    return float(f"{value:.6g}") + 0.0
