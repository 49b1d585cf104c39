"""Identification of all wheels' plants at once: valve map, hysteresis, lag, and how the tyres tie a wheel to the body.

On the ground a wheel follows τ·ν̇ = −ν + map(u) + grip·(body − ν), so that its speed is a lagged sum of ramps of its opening
and of the speed that the other wheels give the body. The sum is linear in its coefficients; lag and hysteresis are
searched. Every window of a second may be faulty, so that the share of them that agree best decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.valve_map import RAMPS
from diagnosis.wheels.plant_constants import PlantFit, Trial, penalty, plants_of
from diagnosis.wheels.plant_windows import Drive, usual_driving, windows_of
from diagnosis.wheels.robust_fit import Trimmed, misfits, solve, trimmed

_LAGS = (0.02, 0.05, 0.12, 0.3, 0.7)
_PLAYS = (0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04)
_FREE_LAGS = (0.02, 0.05, 0.1, 0.17, 0.25, 0.35, 0.5, 0.8)
_STARTS, _STARTS_LATER = 16, 5
_LEAST_WINDOWS = 24
_BETTER = 0.97
_HELD_SHARE = 0.8
_FREE_ENOUGH = 1.3  # of the misfit with the body: below, the wheels run free of it
_RATHER = 0.75  # of the misfit's square without the body: below, the ground may hold the wheels all the same
_WIDER, _WIDER_STEPS = 5.0, 4


def identify_plants(
    drives: Sequence[Drive], span: float, share: float = 0.3, coupling: str = "auto"
) -> PlantFit | None:
    """Plants of all wheels from one or more missions; None where they drive too little.

    Parameters
    ----------
    drives : Sequence[Drive]
        The missions.
    span : float
        Top speed of the machine [m/s].
    share : float
        Share of the windows that are believed.
    coupling : str
        ``free``, ``ground`` or ``auto``.
    """
    drives = usual_driving(drives, span)
    free = _search(drives, span, share, _FREE_LAGS, None)
    if free is None:
        return None
    best, may_hold = free, 0.0
    known = any(np.isfinite(d.body).any() for d in drives)
    if coupling != "free" and known:
        # the body explains a wheel with a dead valve too: only windows that obey their openings may show the tyres
        held = _search(drives, span, _HELD_SHARE, _LAGS, free.found.chosen)
        if held is not None and (coupling == "ground" or free.found.score > _FREE_ENOUGH**2 * held.found.score):
            best = _widened(drives, held, span)
        elif held is not None and held.found.score < _RATHER * free.found.score:
            may_hold = float(np.clip(held.found.values[RAMPS], 0.0, 1.0))
    return replace(plants_of(drives, best, span, healthy=share > 0.5), may_hold=may_hold)


def _search(
    drives: Sequence[Drive], span: float, share: float, lags: Sequence[float], among: NDArray[np.intp] | None
) -> Trial | None:
    """Lag and hysteresis that explain the best windows best; with the speed of the body `among` some windows alone."""
    body = among is not None

    def trial(hysteresis: float, lag: float, before: Trial | None) -> Trial | None:
        windows = windows_of(drives, hysteresis, lag, span, body=body)
        if among is not None:
            windows = windows.part(among)
        if windows.wheel.size < _LEAST_WINDOWS:
            return None
        starts = _STARTS if before is None else _STARTS_LATER
        given = None if before is None else before.found.chosen
        found = trimmed(windows.normal, penalty(body), share, 0.3 * span, starts, given)
        return Trial(hysteresis, lag, found, windows)

    best: Trial | None = None
    for lag in lags:
        best = _better(best, trial(0.0, lag, None), 1.0)
        if best is None:
            return None
    assert best is not None
    for hysteresis in _PLAYS[1:]:
        before = best
        best = _better(before, trial(hysteresis, before.lag, before), _BETTER) or before
        if best is not before or hysteresis <= _PLAYS[2]:
            best = _better(best, trial(hysteresis, max(best.lag / 2, 0.01), best), _BETTER) or best
    for factor in (0.7, 1.4):
        best = _better(best, trial(best.hysteresis, best.lag * factor, best), _BETTER) or best
    return best


def _widened(drives: Sequence[Drive], found: Trial, span: float) -> Trial:
    """The same from all windows that it explains nearly as well: those that obey their openings alone show little of tyres."""
    windows = windows_of(drives, found.hysteresis, found.lag, span, body=True)
    values, score = found.found.values, found.found.score
    for _ in range(_WIDER_STEPS):
        left = misfits(windows.normal, values, 0.3 * span)
        chosen = np.flatnonzero(left <= _WIDER * score)
        values = solve(windows.normal.part(chosen), penalty(body=True))
    left = misfits(windows.normal, values, 0.3 * span)
    return replace(found, found=Trimmed(values, left, chosen, float(left[chosen].mean())), windows=windows)


def _better(best: Trial | None, found: Trial | None, factor: float) -> Trial | None:
    if found is None or (best is not None and found.found.score >= factor * best.found.score):
        return best
    return found
