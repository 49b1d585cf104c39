"""Refine a steering axle's most probable path: stray stretches to their neighbours, onsets to where the evidence puts them.

Viterbi's recursion keeps one entry per model, so that a path may stray for a moment before the right model has learnt.
Every change made here is one that raises the path's evidence, its switches paid for.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.model_bank import ACTUATOR, HEALTHY_MODEL, NOISY, SENSOR
from diagnosis.steering.path import AxleFilter, Models, evidence_of, follow_path

_RUN_OUT_S = 0.7
_GAP_S = 0.1
_FLICKER_S = 0.04
_STRAY_S = 1.5
_JOINED_S, _RETURN_COST = (
    2.0,
    25.0,
)  # a fault that returns so soon is the same one, unless the evidence [nat] is against it
_SHIFTS_S = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28)


def runs_of(x: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
    """Stretches (start, stop, value) of equal values. `x` of shape (n,)."""
    cut = np.flatnonzero(np.r_[True, x[1:] != x[:-1]])
    for a, b in zip(cut, np.r_[cut[1:], x.size], strict=True):
        yield int(a), int(b), int(x[a])


def run_out_evidence(axle: AxleFilter, known: SteeringPath, models: Models, start: int, stop: int) -> float:
    """Log-evidence of a path over [start, stop) and a run-out behind it; see `diagnosis.steering.path.evidence_of`."""
    end = min(models.size, stop + round(_RUN_OUT_S / axle.blocks.dt))
    return float(evidence_of(axle, known, models, start, end)[0])


def refine_path(axle: AxleFilter, models: Models) -> SteeringPath:
    """Refine a path and follow it; see the module's docstring."""
    models = models.copy()
    dt = axle.blocks.dt
    for a, b, faulty in list(runs_of((models != HEALTHY_MODEL).astype(np.int64))):
        if faulty == 0 and a > 0 and b < models.size and (b - a) * dt < _GAP_S:
            models[a:b] = models[a - 1]
    known = follow_path(axle, models)
    for a, b, faulty in list(runs_of((models != HEALTHY_MODEL).astype(np.int64))):
        if faulty:
            _unify(axle, known, models, a, b)
            _merge(axle, known, models, a, b)
    known = follow_path(axle, models, known)
    for side in (SENSOR, ACTUATOR):
        _join(axle, known, models, side)
    for _ in range(2):
        known = follow_path(axle, models, known)
        for c in (np.flatnonzero(np.diff(models.astype(np.int64))) + 1).tolist():
            _shift(axle, known, models, c)
    return follow_path(axle, models, known)


def _unify(axle: AxleFilter, known: SteeringPath, models: Models, a: int, b: int) -> None:
    """Give an episode to one of its models where that explains all of it better."""
    candidates = np.unique(models[a:b])
    if candidates.size == 1:
        return
    best, most = models[a:b].copy(), run_out_evidence(axle, known, models, a, b)
    for m in candidates:
        models[a:b] = m
        evidence = run_out_evidence(axle, known, models, a, b)
        if evidence > most:
            best, most = models[a:b].copy(), evidence
    models[a:b] = best


def _join(axle: AxleFilter, known: SteeringPath, models: Models, side: NDArray[np.int64]) -> None:
    """Fill a short gap between two stretches of one disturbed or noisy part: it will not have healed and failed again."""
    dt = axle.blocks.dt
    runs = list(runs_of((side[models] >= NOISY).astype(np.int64)))
    for (_, a, before), (_, b, noisy) in pairwise(runs):
        if noisy or not before or b == models.size or (b - a) * dt > _JOINED_S:
            continue
        own, most = models[a:b].copy(), run_out_evidence(axle, known, models, a, b)
        models[a:b] = models[a - 1]
        if run_out_evidence(axle, known, models, a, b) < most - _RETURN_COST:
            models[a:b] = own


def _merge(axle: AxleFilter, known: SteeringPath, models: Models, a: int, b: int) -> None:
    """Give stretches of an episode to their neighbours wherever that explains it better; flickers always."""
    k = 0
    dt = axle.blocks.dt
    while True:
        cuts = np.concatenate([[a], a + 1 + np.flatnonzero(np.diff(models[a:b].astype(np.int64))), [b]])
        if k >= cuts.size - 1 or cuts.size == 2:
            return
        c, d = int(cuts[k]), int(cuts[k + 1])
        own = models[c:d].copy()
        flicker = (d - c) * dt < _FLICKER_S
        best, most = own, -np.inf if flicker else run_out_evidence(axle, known, models, c, d)
        near = [int(models[j]) for j in (c - 1, d) if 0 <= j < models.size and models[j] != own[0]]
        splits = {c, d}
        if len(near) == 2 and (d - c) * dt < _STRAY_S:
            splits |= set(np.linspace(c, d, 8).astype(int).tolist())
        for s in sorted(splits) if near else ():
            if near[-1] == own[0]:
                continue
            models[c:s], models[s:d] = near[0], near[-1]
            evidence = run_out_evidence(axle, known, models, c, d)
            if evidence > most:
                best, most = models[c:d].copy(), evidence
        models[c:d] = best
        k = max(0, k - 1) if best is not own else k + 1


def _shift(axle: AxleFilter, known: SteeringPath, models: Models, c: int) -> None:
    """Move the switch at block c to where the evidence is highest, within its two stretches."""
    old, new = models[c - 1], models[c]
    low, high = c, c
    while low > 0 and models[low - 1] == old:
        low -= 1
    while high < models.size and models[high] == new:
        high += 1
    reach = round(_SHIFTS_S[-1] / axle.blocks.dt)
    window = max(low, c - reach), min(high, c + reach)
    most = run_out_evidence(axle, known, models, *window)
    moved = True
    place = c
    while moved:
        moved = False
        for step in _SHIFTS_S:
            for sign in (-1, 1):
                trial = place + sign * max(1, round(step / axle.blocks.dt))
                if not window[0] < trial < window[1]:
                    continue
                _put(models, place, trial, old, new)
                evidence = run_out_evidence(axle, known, models, *window)
                if evidence > most + 0.01:
                    most, place, moved = evidence, trial, True
                else:
                    _put(models, trial, place, old, new)


def _put(models: Models, before: int, now: int, old: np.uint8, new: np.uint8) -> None:
    """Move a switch from block `before` to block `now`."""
    if now < before:
        models[now:before] = new
    else:
        models[before:now] = old
