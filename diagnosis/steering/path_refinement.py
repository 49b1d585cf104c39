"""Clean a steering axle's most probable path: stray stretches to their neighbours, onsets to where the evidence puts them.

Viterbi's recursion keeps one entry per model, so that a path may stray for a moment before the right model has learnt.
Every change made here is one that raises the path's evidence, its switches paid for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering import path_kernel as ss
from diagnosis.steering.blocks import SteeringBlocks
from diagnosis.steering.filter import SteeringPath, follow_path
from diagnosis.steering.models import SteeringModel

Array = NDArray[np.float64]
Path = NDArray[np.uint8]

_RUN_OUT_S = 0.7
_GAP_S = 0.1
_FLICKER_S = 0.04
_STRAY_S = 1.5
_SHIFTS_S = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28)


@dataclass(frozen=True)
class SteeringData:
    """What judging an axle needs; `driven` as in `steering_filter`, `names` of angle and command."""

    blocks: SteeringBlocks
    driven: Array
    model: SteeringModel
    allowed: NDArray[np.bool_]
    names: tuple[str, str]

    @cached_property
    def packed(self) -> Array:
        """The model's constants for the compiled scan."""
        return self.model.packed()

    def followed(self, path: Path) -> SteeringPath:
        """States along a path."""
        return follow_path(self.blocks, self.driven, self.model, path)


def runs_of(x: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
    """Stretches (start, stop, value) of equal values."""
    cut = np.flatnonzero(np.r_[True, x[1:] != x[:-1]])
    for a, b in zip(cut, np.r_[cut[1:], x.size], strict=True):
        yield int(a), int(b), int(x[a])


def evidence_of(data: SteeringData, known: SteeringPath, path: Path, start: int, stop: int) -> float:
    """Log-evidence of a path over [start, stop) and a run-out behind it, its switches paid for.

    Up to `start` it is the path `known`, whose states are there.
    """
    return float(_evidence(data, known, path, start, min(path.size, stop + round(_RUN_OUT_S / data.blocks.dt)))[0])


def end_state(data: SteeringData, known: SteeringPath, path: Path, start: int, stop: int) -> Array:
    """State [φ, r, a, b, d, c] of a path at `stop`."""
    return np.asarray(_evidence(data, known, path, start, stop)[1])


def _evidence(data: SteeringData, known: SteeringPath, path: Path, start: int, stop: int) -> tuple[float, Array]:
    b = data.blocks
    found: tuple[float, Array] = ss.path_evidence(
        b.mean,
        b.power,
        b.count,
        data.driven,
        b.u,
        b.status,
        b.second,
        path,
        start,
        stop,
        known.model,
        data.packed,
        known.mean,
        known.cov,
        known.noise,
    )
    return found


def tidy(data: SteeringData, path: Path) -> SteeringPath:
    """Clean a path; see the module's docstring."""
    path = path.copy()
    dt = data.blocks.dt
    for a, b, faulty in list(runs_of((path != 0).astype(np.int64))):
        if faulty == 0 and a > 0 and b < path.size and (b - a) * dt < _GAP_S:
            path[a:b] = path[a - 1]
    known = data.followed(path)
    for a, b, faulty in list(runs_of((path != 0).astype(np.int64))):
        if faulty:
            _one_model(data, known, path, a, b)
            _merge(data, known, path, a, b)
    for _ in range(2):
        known = data.followed(path)
        for c in (np.flatnonzero(np.diff(path.astype(np.int64))) + 1).tolist():
            _shift(data, known, path, c)
    return data.followed(path)


def _one_model(data: SteeringData, known: SteeringPath, path: Path, a: int, b: int) -> None:
    """Give an episode to one of its models where that explains all of it better."""
    models = np.unique(path[a:b])
    if models.size == 1:
        return
    best, most = path[a:b].copy(), evidence_of(data, known, path, a, b)
    for m in models:
        path[a:b] = m
        told = evidence_of(data, known, path, a, b)
        if told > most:
            best, most = path[a:b].copy(), told
    path[a:b] = best


def _merge(data: SteeringData, known: SteeringPath, path: Path, a: int, b: int) -> None:
    """Give stretches of an episode to their neighbours wherever that explains it better; flickers always."""
    k = 0
    dt = data.blocks.dt
    while True:
        cuts = np.concatenate([[a], a + 1 + np.flatnonzero(np.diff(path[a:b].astype(np.int64))), [b]])
        if k >= cuts.size - 1 or cuts.size == 2:
            return
        c, d = int(cuts[k]), int(cuts[k + 1])
        own = path[c:d].copy()
        flicker = (d - c) * dt < _FLICKER_S
        best, most = own, -np.inf if flicker else evidence_of(data, known, path, c, d)
        near = [int(path[j]) for j in (c - 1, d) if 0 <= j < path.size and path[j] != own[0]]
        splits = {c, d}
        if len(near) == 2 and (d - c) * dt < _STRAY_S:
            splits |= set(np.linspace(c, d, 8).astype(int).tolist())
        for s in sorted(splits) if near else ():
            if near[-1] == own[0]:
                continue
            path[c:s], path[s:d] = near[0], near[-1]
            told = evidence_of(data, known, path, c, d)
            if told > most:
                best, most = path[c:d].copy(), told
        path[c:d] = best
        k = max(0, k - 1) if best is not own else k + 1


def _shift(data: SteeringData, known: SteeringPath, path: Path, c: int) -> None:
    """Move the switch at block c to where the evidence is highest, within its two stretches."""
    old, new = path[c - 1], path[c]
    low, high = c, c
    while low > 0 and path[low - 1] == old:
        low -= 1
    while high < path.size and path[high] == new:
        high += 1
    reach = round(_SHIFTS_S[-1] / data.blocks.dt)
    window = max(low, c - reach), min(high, c + reach)
    most = evidence_of(data, known, path, *window)
    moved = True
    place = c
    while moved:
        moved = False
        for step in _SHIFTS_S:
            for sign in (-1, 1):
                trial = place + sign * max(1, round(step / data.blocks.dt))
                if not window[0] < trial < window[1]:
                    continue
                _put(path, place, trial, old, new)
                told = evidence_of(data, known, path, *window)
                if told > most + 0.01:
                    most, place, moved = told, trial, True
                else:
                    _put(path, trial, place, old, new)


def _put(path: Path, before: int, now: int, old: np.uint8, new: np.uint8) -> None:
    """Move a switch from block `before` to block `now`."""
    if now < before:
        path[now:before] = new
    else:
        path[before:now] = old
