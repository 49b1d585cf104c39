"""Trends and missions as they stand in a fleet's document; see `diagnosis.audit.fleet.document`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from diagnosis.audit.fleet.read import Bounds, FoundFault, Mission
from diagnosis.audit.fleet.trends import Axis, PartTrend
from diagnosis.audit.fleet.words import forecast_words
from diagnosis.audit.trends.line import Line
from diagnosis.results.result import SEVERITIES


def trend_json(k: int, t: PartTrend, at: Mapping[str, int], axis: Axis) -> dict[str, Any]:
    """One trend of the machine at place `k`; `at` holds each mission's place."""
    s, f = t.series, t.trend.forecast
    columns = [[rounded(float(v)) for v in c] for c in (s.x, s.value, s.low, s.high)]
    return {
        "machine": k,
        "component": t.component,
        "kind": t.kind,
        "side": t.side,
        "limit": t.limit,
        "now": rounded(s.now),
        "points": [list(p) for p in zip([at[r.name] for r in t.runs], *columns, strict=True)],
        "outliers": list(t.trend.outliers),
        "changes": [{"index": c.index, "kind": c.kind, "size": rounded(c.size)} for c in t.trend.changes],
        "first": t.trend.first,
        "direction": t.trend.direction,
        "approaching": t.approaching,
        "line": _line(t.trend.line, s.now),
        "forecast": {
            "state": f.state,
            "soonest": rounded(f.soonest),
            "likely": rounded(f.likely),
            "latest": rounded(f.latest),
            "horizon": rounded(f.horizon),
            "words": forecast_words(f, t.limit, axis),
        },
    }


def _line(line: Line | None, now: float) -> dict[str, Any] | None:
    if line is None:
        return None
    level, half = line.at(now), line.half(now, 0.95)
    spread = line.quantile(0.95) * line.slope_var**0.5
    return {
        "level": {"value": rounded(level), "low": rounded(level - half), "high": rounded(level + half)},
        "slope": {
            "value": rounded(line.slope),
            "low": rounded(line.slope - spread),
            "high": rounded(line.slope + spread),
        },
        "tau": rounded(line.tau),
        "centre": rounded(line.centre),
        "dof": line.dof,
    }


def mission_json(m: Mission, owner: int | None, first: Mapping[int, str], first_run: int | None) -> dict[str, Any]:
    """One mission of the machine at place `owner`; `first` names the first of each result's copies."""
    r = m.result
    head: dict[str, Any] = {"name": m.name, "files": list(m.files), "bytes": m.bytes, "gone": m.gone}
    if r is None:
        return {
            **head,
            "machine": owner,
            "state": "pending",
            "reason": "not audited yet",
            "verdict": None,
            "faults": [],
        }
    faults = sorted(
        (f for f in r.faults if f.severity != "info"), key=lambda f: (-SEVERITIES.index(f.severity), -f.seconds)
    )
    return {
        **head,
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
        "copy_of": None if first[r.id] == m.name else first[r.id],
        "faults": [_found(f) for f in faults],
    }


def _found(f: FoundFault) -> dict[str, Any]:
    told = {k: getattr(f, k) for k in ("id", "component", "kind", "side", "mode", "severity")}
    return {
        **told,
        "seconds": rounded(f.seconds),
        "epsilon": bounds_json(f.epsilon),
        "probability": rounded(f.probability),
    }


def bounds_json(b: Bounds | None) -> dict[str, float | None] | None:
    """ε̂ with its bounds, rounded."""
    return None if b is None else {"value": rounded(b.value), "low": rounded(b.low), "high": rounded(b.high)}


def rounded(value: float | None) -> float | None:
    """Six significant digits; the same on every computer."""
    if value is None or not np.isfinite(value):
        return None
    return float(f"{value:.6g}") + 0.0
