"""What a sensor's noise is: quick, and of its own channel. What a wheel really does is slower, and shakes the others.

A wheel has inertia: where a deviation changes slowly, the wheel may really move so, dragged or slipping. Where another wheel becomes
rough at the same time, the ground or the supply may shake both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.wheels.blocks import per_sample
from diagnosis.wheels.findings import WheelFindings, WheelPath
from diagnosis.wheels.own_swings import is_opened, opened
from replay.arrays.quantiles import median_known, quantile_known
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

_STEP_S, _QUICK = 0.04, 0.42  # share of a deviation that changes within such a time
_SLOW_AT_ALL, _RAISED = 0.15, 4.0  # the same where readings are so many times rougher than elsewhere
_WINDOW_S, _QUIET = 3.0, 0.1  # quantile of windows that shows a channel's own noise
_ROUGHER, _OF_MINE = 3.0, 0.2  # times that noise, and of the noisy wheel's
_SHARED_P = 0.6
_LEAST = 20  # readings
_BESIDE = "The {wheel} swings, or deviates slowly, at other times of this mission: the same may shake it here."
_SLOW = "It changes slowly: the {wheel} may really move so, as where it is dragged or slips, or its sensor may read so."


def with_shaken(paths: Mapping[int, WheelPath], found: Mapping[int, WheelFindings]) -> dict[int, WheelFindings]:
    """Findings of noisy sensors, less sure where the deviation is slow, or where another wheel becomes rough meanwhile.

    Parameters
    ----------
    paths, found : Mapping[int, WheelPath], Mapping[int, WheelFindings]
        Wheels and what was found, by wheel.
    """
    if not any(_of_sensor(f) for w in found.values() for f in w.findings):
        return dict(found)
    rough = {i: _roughness(p) for i, p in paths.items()}
    return {
        i: replace(
            w, findings=_of_one_cause([_judged(f, i, paths[i], rough) if _of_sensor(f) else f for f in w.findings])
        )
        for i, w in found.items()
    }


def _of_one_cause(findings: list[Finding]) -> list[Finding]:
    """A wheel's findings; noise of its sensor beside what swings, or deviates slowly, at other times is no surer than that."""
    if not any(is_opened(f) for f in findings):
        return findings
    return [opened(f, _BESIDE) if _of_sensor(f) else f for f in findings]


def _of_sensor(f: Finding) -> bool:
    return f.mode is FaultMode.NOISY and f.side is Side.SENSOR


def _judged(f: Finding, i: int, path: WheelPath, rough: Mapping[int, Array]) -> Finding:
    expected: Array = np.asarray(per_sample(path.expected, path.width, path.y.size), dtype=np.float64)
    part = slice(f.start, f.stop)
    share = quick_share(path.y[part], expected[part], path.dt)
    length = _length(path)
    places = slice(f.start // length, max(f.start // length + 1, f.stop // length))
    known = np.isfinite(rough[i][places]).any()
    mine = float(median_known(rough[i][places])) if known else np.inf
    rougher = known and mine > _RAISED * float(quantile_known(rough[i], _QUIET))  # noise, whatever the slow rest is
    if share is not None and share < (_SLOW_AT_ALL if rougher else _QUICK):
        return opened(f, _SLOW)
    for j, other in rough.items():
        if j != i and np.isfinite(other[places]).any():
            meanwhile, usual = float(median_known(other[places])), float(quantile_known(other, _QUIET))
            if meanwhile > max(_ROUGHER * usual, _OF_MINE * mine):
                return limited(
                    f, _SHARED_P, "Another {wheel} becomes rough meanwhile: the ground or the supply may shake both."
                )
    return f


def quick_share(y: Array, expected: Array, dt: float) -> float | None:
    """Share of a deviation that changes within `_STEP_S`, once a gain and an offset are taken out [1]; 1 of white noise.

    Parameters
    ----------
    y, expected : Array, shape (n,)
        Speeds [m/s]; NaN where unknown.
    dt : float
        Step [s].

    Returns
    -------
    float or None
        None for too few readings.
    """
    known = np.isfinite(y) & np.isfinite(expected)
    if np.count_nonzero(known) < _LEAST:
        return None
    both = np.column_stack([expected[known], np.ones(np.count_nonzero(known))])
    off = np.where(known, y, np.nan)
    off[known] -= both @ np.linalg.lstsq(both, y[known], rcond=None)[0]
    n = max(1, round(_STEP_S / dt))
    changes, power = off[n:] - off[:-n], float(np.nanvar(off))
    if power <= 0.0 or not np.isfinite(changes).any():
        return None
    # the middle of them: a wheel that sticks and slips changes quickly now and then
    return float(median_known(np.abs(changes)) / 0.6745 / np.sqrt(2.0 * power))


def _length(path: WheelPath) -> int:
    return max(_LEAST, round(_WINDOW_S / path.dt))


def _roughness(path: WheelPath) -> Array:
    """Noise of a wheel's speed from its second differences, by windows [m/s]; NaN where nothing is known."""
    length = _length(path)
    bent = np.abs(np.diff(path.y, 2, prepend=np.nan, append=np.nan))
    n = max(1, bent.size // length)
    pieces = bent[: n * length].reshape(n, -1)
    known = np.isfinite(pieces).any(axis=1)
    out = np.full(n, np.nan)
    out[known] = median_known(pieces[known], axis=1) / 0.6745 / np.sqrt(6.0)
    return out
