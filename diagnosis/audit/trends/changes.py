"""One-off outliers, steps and bends in a series of missions.

Detected one after the other, the most certain first, as in Chen and Liu (Journal of the American Statistical Association
88, 1993), around a straight line instead of an ARIMA model. At each turn three alternatives to one line are tried at every
place: one mission off the line (deleted residual), a step with the same slope before and after, and a bend (broken stick).
Each is an F test of the weighted residual sums; the smallest p counts, multiplied by the number of places tried
(Bonferroni). An outlier is left out, a step or a bend cuts the series in two, and each part is searched again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.special import fdtrc

from diagnosis.audit.trends.kinds import ChangeKind
from diagnosis.audit.trends.line import Array, Weighted, varies, weighted

_ALPHA = 0.01
_LEAST = 5  # missions in a stretch that is searched
_SIDE_STEP, _SIDE_BEND = 2, 4  # missions on either side of a step, and of a bend
_ALPHA_BEND, _BEND_PLACES = 0.05, 4  # knots beside each other say the same: as if so many were tried
_MASKED = 0.3  # stricter for each mission left out in search of what it hides
_JUMP = 0.02  # smaller steps and outliers than this share of ε are left in the line


@dataclass(frozen=True)
class Change:
    """Where a stretch ends and another begins.

    Attributes
    ----------
    index : int
        First mission of the new stretch.
    kind : str
        ``drop`` (as after a repair), ``rise``, or ``bend``: the slope alone changed.
    size : float
        Step of the level [1], signed.
    """

    index: int
    kind: ChangeKind
    size: float


@dataclass(frozen=True)
class Found:
    """Outliers by index, and changes in order."""

    outliers: tuple[int, ...]
    changes: tuple[Change, ...]


@dataclass(frozen=True)
class _Best:
    p: float
    place: int
    kind: Literal["outlier", "step", "bend"]
    size: float


def find_changes(x: Array, y: Array, sigma: Array, known: Weighted | None = None) -> Found:
    """Search a series in order of x.

    Parameters
    ----------
    x, y, sigma : Array, shape (n,)
        Place, estimate and its standard error.
    known : Weighted or None
        From `diagnosis.audit.trends.line.weighted` over all of them, where that was asked for already.
    """
    outliers: list[int] = []
    changes: list[Change] = []
    todo = [np.arange(len(x))]
    while todo:
        at = todo.pop()
        best = _unmasked(x[at], y[at], sigma[at], known if len(at) == len(x) else None)
        if best is None:
            continue
        if best.kind == "outlier":
            outliers.append(int(at[best.place]))
            todo.append(np.delete(at, best.place))
            continue
        changes.append(Change(int(at[best.place]), _kind(best), best.size))
        todo += [at[: best.place], at[best.place :]]
    return Found(tuple(sorted(outliers)), tuple(sorted(changes, key=lambda c: c.index)))


def possible_bend(x: Array, y: Array, sigma: Array, known: Weighted | None = None) -> int | None:
    """First mission after the likeliest bend of a stretch; None where the stretch is too short. `known` as in `fit_line`.

    `x`, `y` and `sigma` of shape (m,).
    """
    if len(x) < 2 * _SIDE_BEND or not varies(x):
        return None
    of = known or weighted(x, y, sigma)
    d = x - of.centre
    best = _bend(d, _behind(d, of.w, of.rest), of.w, of.whole, of.sxx, float(np.mean(of.w * sigma**2)))
    return None if best is None else best.place


def _kind(best: _Best) -> ChangeKind:
    if abs(best.size) < _JUMP:
        return "bend"
    return "drop" if best.size < 0 else "rise"


def _unmasked(x: Array, y: Array, sigma: Array, known: Weighted | None = None) -> _Best | None:
    """Like `_best`; where nothing is certain, also without the one or two missions furthest off, which may hide it.

    What was left out for the search is put back: it is judged again beside what was found.
    """
    at, alpha = np.arange(len(x)), _ALPHA
    for _ in range(3):
        best = _best(x[at], y[at], sigma[at], known if len(at) == len(x) else None)
        if best is None:
            return None
        if best[0].p < alpha:
            return replace(best[0], place=int(at[best[0].place]))
        if best[1] is None or len(at) <= _LEAST:
            return None
        at, alpha = np.delete(at, best[1]), alpha * _MASKED
    return None


def _best(x: Array, y: Array, sigma: Array, known: Weighted | None = None) -> tuple[_Best, int | None] | None:
    """The most certain departure from one line, and the mission furthest off; None where there is none."""
    n = len(x)
    if n < _LEAST or not varies(x):
        return None
    of = known or weighted(x, y, sigma)
    w, centre, sxx, rest, whole = of.w, of.centre, of.sxx, of.rest, of.whole
    floor = float(np.mean(w * sigma**2))
    if whole <= floor * (n - 2) * 0.5:
        return None
    d = x - centre
    behind = _behind(d, w, rest)
    found = [
        _outlier(d, w, rest, whole, sxx, floor),
        _step(behind, w, whole, sxx, floor),
        _bend(d, behind, w, whole, sxx, floor),
    ]
    best = min((f for f in found if f is not None), key=lambda f: f.p, default=None)
    return None if best is None else (best, found[0].place if found[0] is not None else None)


def _tail(gain: Array, whole: float, parameters: int, dof: int, floor: float) -> tuple[float, int]:
    """Smallest p of F tests, times their number, and its place."""
    place = int(np.argmax(gain))
    scale = max((whole - float(gain[place])) / dof, floor)
    p = float(fdtrc(parameters, dof, float(gain[place]) / parameters / scale)) * len(gain)
    return p, place


def _outlier(d: Array, w: Array, rest: Array, whole: float, sxx: float, floor: float) -> _Best | None:
    share = w * (1.0 / float(w.sum()) + d * d / sxx)  # leverage h
    size = rest / np.maximum(1.0 - share, 1e-9)
    p, place = _tail(w * rest * size, whole, 1, len(d) - 3, floor)
    return _Best(p, place, "outlier", float(size[place])) if abs(size[place]) >= _JUMP else None


def _behind(d: Array, w: Array, rest: Array) -> Array:
    """Sums of w, w d, w r, w d², w d r over each mission and those behind it, shape (5, n)."""
    terms = np.empty((5, len(d)))
    terms[0] = w
    np.multiply(w, d, out=terms[1])
    np.multiply(w, rest, out=terms[2])
    np.multiply(terms[1], d, out=terms[3])
    np.multiply(terms[1], rest, out=terms[4])
    return np.asarray(np.cumsum(terms[:, ::-1], axis=1)[:, ::-1])


def _step(behind: Array, w: Array, whole: float, sxx: float, floor: float) -> _Best | None:
    """Step with one slope: the regressor 1[i ≥ k], freed of level and slope, against the residuals."""
    n = len(w)
    weight, moment, product = behind[:3, _SIDE_STEP : n - _SIDE_STEP + 1]
    own = weight - weight**2 / float(w.sum()) - moment**2 / sxx
    good = own > 1e-9 * weight
    if not good.any():
        return None
    size = np.where(good, product / np.where(good, own, 1.0), 0.0)
    p, place = _tail(size * product, whole, 1, n - 3, floor)
    return _Best(p, place + _SIDE_STEP, "step", float(size[place])) if abs(size[place]) >= _JUMP else None


def _bend(d: Array, behind: Array, w: Array, whole: float, sxx: float, floor: float) -> _Best | None:
    """Broken stick: the regressor max(0, x − x_k), freed of level and slope, against the residuals."""
    n = len(d)
    if n < 2 * _SIDE_BEND:
        return None
    inside = slice(_SIDE_BEND - 1, n - _SIDE_BEND)
    knot = d[inside]
    weight, moment, product, square, steep = behind[:, inside]
    one = moment - knot * weight  # Σ w h
    two = square - knot * moment  # Σ w d h
    own = square - 2 * knot * moment + knot * knot * weight - one**2 / float(w.sum()) - two**2 / sxx
    good = own > 1e-9 * sxx
    if not good.any():
        return None
    slope = np.where(good, (steep - knot * product) / np.where(good, own, 1.0), 0.0)
    gain = slope**2 * own
    p, place = _tail(gain, whole, 1, n - 3, floor)
    return _Best(p / len(gain) * min(len(gain), _BEND_PLACES) * _ALPHA / _ALPHA_BEND, place + _SIDE_BEND, "bend", 0.0)
