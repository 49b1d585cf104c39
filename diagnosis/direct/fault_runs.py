"""Faulty runs of a path through the rows, one for each fault: what belongs together is joined, what is no fault trimmed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import CLEAR, PAIR, SILENT
from diagnosis.estimation.fault_models import (
    HEALTHY,
    SCALED_ROWS,
    UNSATURATED_ROWS,
    VALUE_ROWS,
    VARYING_ROWS,
    ModeModel,
)
from diagnosis.estimation.filter_kernel import segment_evidence
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.segments import Run, absorb_short, join_noisy, merge_equal, runs_of, trim
from diagnosis.estimation.viterbi import ModePath
from replay.arrays.sliding import mean_within

Array = NDArray[np.float64]

_BRIDGE_S, _APART_S = 5.0, 30.0
_BRIEF_S = 0.1
_NEAR = 20  # samples between runs that follow each other
_ONE_GAIN = 0.1  # by which gains of one fault may differ
_ALL_BUT = 0.03  # by which a gain is off that is all but a healthy one
_NEAR_MEAN = 0.25  # of its mean: standard deviation of a reference that hardly changes
_ABOUT = 0.05  # of what a gain leaves: as near to it a channel may rest
_ZERO = 3.0  # times the noise: no reading
_ELSEWHERE = 8.0  # times the noise of a constant: a reading beside it
_LONG_S, _EVENED_S, _GAP_S = (
    10.0,
    0.25,
    2.0,
)  # noise that drift may be; time that a deviation is evened over; between pieces of one fault
_DRIFTS = 2.0  # tolerances that a healthy channel drifts by
_PIECES, _MINOR = 3, 0.5  # and their share of a run
_PLAYS = 3.0  # by which a command must move for a valve with a loss of gain to follow


class _Evidence:
    """Log-evidence of each row over parts of one channel, each computed once: the same ones are asked again and again."""

    def __init__(self, samples: Samples, model: ModeModel) -> None:
        self.samples, self.model = samples, model
        self._known: dict[tuple[int, int], Array] = {}

    def of(self, start: int, stop: int) -> Array:
        """That of samples [start, stop), shape (rows,)."""
        if (start, stop) not in self._known:
            self._known[start, stop] = segment_evidence(self.samples.part(start, stop), self.model)
        return self._known[start, stop]


def fault_runs(path: ModePath, samples: Samples, model: ModeModel, dt: float, shortest: int, play: float) -> list[Run]:
    """Faulty runs of a path, joined where they belong together, without the ends in which nothing moves.

    `dt` in s, `play` in the channel's unit.
    """
    runs = absorb_short(runs_of(path), shortest)
    runs = join_noisy(runs)
    runs = merge_equal(
        runs,
        max(2, round(0.02 / dt)),
        VARYING_ROWS + UNSATURATED_ROWS,
        lambda first, second: _lost_in_one(first, second, samples, model),
    )
    evidence = _Evidence(samples, model)
    runs = _bridged(_renamed([r for r in runs if r.row != HEALTHY], evidence), evidence)
    runs = _bridged(_resting(runs, samples, model, play), evidence)
    out = []
    for run in runs:
        if run.row in UNSATURATED_ROWS:
            silent = samples.status[run.start : run.stop] == SILENT
            still = samples.quiet if not silent.any() else samples.quiet & (samples.status != SILENT)
            kept = trim(run, still)
            if kept is None:
                continue
            run = kept
        elif run.row in VALUE_ROWS:
            kept = _moving(run, samples, model)
            if kept is None:
                continue
            run = kept
        out += _where_it_deviates(run, samples, model) if run.row in VARYING_ROWS else [run]
    return out


def _where_it_deviates(run: Run, samples: Samples, model: ModeModel) -> list[Run]:
    """A noisy run cut to where the channel is off by more than healthy ones are, where that is a minor part in a few pieces.

    What a healthy channel drifts by slowly, noise explains better than no fault does, so that the path stays in that row once something
    else has brought it there.
    """
    if run.size * model.dt < _LONG_S:
        return [run]
    part = samples.part(run.start, run.stop)
    known = (part.status == PAIR) & np.isfinite(part.y) & np.isfinite(part.x)
    off = np.where(known, part.y - part.x, 0.0)
    width = max(1, round(_EVENED_S / model.dt))
    away = np.abs(mean_within(off, width)) > _DRIFTS * model.tolerance * mean_within(known.astype(np.float64), width)
    away &= known
    rest = off[known & ~away]
    if not away.any() or not rest.size or float(np.mean(rest**2)) > model.tolerance**2:
        return [run]
    gap = round(_GAP_S / model.dt)
    ends = np.flatnonzero(np.diff(np.r_[0, away.astype(np.int8), 0]))
    pieces: list[list[int]] = []
    for start, stop in ends.reshape(-1, 2).tolist():
        if pieces and start - pieces[-1][1] <= gap:
            pieces[-1][1] = stop
        else:
            pieces.append([start, stop])
    if len(pieces) > _PIECES or sum(stop - start for start, stop in pieces) > _MINOR * run.size:
        return [run]
    return [Run(run.start + start, run.start + stop, run.row) for start, stop in pieces]


def _moving(run: Run, samples: Samples, model: ModeModel) -> Run | None:
    """A constant run without the ends in which nothing moves and nothing is read, or another value; None where nothing is left."""
    part = slice(run.start, run.stop)
    y = samples.y[part]
    rests = samples.quiet[part] & (np.abs(np.nan_to_num(y, nan=np.inf)) <= _ZERO * model.noise)
    known = y[np.isfinite(y)]
    level = float(np.median(known)) if known.size else 0.0
    # the path may go from one value to the next in one row
    rests |= np.abs(y - level) > _ELSEWHERE * model.constant_noise
    kept = trim(Run(0, run.size, run.row), rests)
    return None if kept is None else Run(run.start + kept.start, run.start + kept.stop, run.row)


def _resting(runs: list[Run], samples: Samples, model: ModeModel, play: float) -> list[Run]:
    """Constant runs beside one of a loss of gain under that one's row, where the reference rests and the gain explains them.

    The reference rests where it moves no more than a valve's play, or what the gain leaves of its motion no more than the noise.
    """
    out = list(runs)
    for i, run in enumerate(runs):
        if run.row not in VALUE_ROWS:
            continue
        y, x, noise = _pairs(run, samples, model)
        if y.size < 3:
            continue
        for near in (*_beside(out[: i + 1][::-1]), *_beside(runs[i:])):
            if near.row not in SCALED_ROWS:
                continue
            other, reference, _ = _pairs(near, samples, model)
            power = float(reference @ reference)
            delta = float(reference @ other) / power if power > 0.0 else 0.0
            share = delta * float(x.mean())
            rests = motion_left(x, delta) <= 2 * noise or float(np.ptp(x)) <= _PLAYS * play
            if rests and abs(float(y.mean()) - share) < max(noise, play, _ABOUT * abs(share)):
                out[i] = Run(run.start, run.stop, near.row)
                break
    return out


def motion_left(x: Array, share: float) -> float:
    """Standard deviation of a reference, shape (n,); of one that stays near its mean, what a share of it leaves [unit of x].

    What goes the other way is no share.
    """
    moves = float(np.std(x))
    return moves * min(1.0, share) if share >= 0.0 and moves < _NEAR_MEAN * abs(float(np.mean(x))) else moves


def _beside(runs: list[Run]) -> list[Run]:
    """The nearest run to the first one that is no noise, if all that lies between is noisy; runs in order of their distance."""
    for last, near in pairwise(runs):
        if max(last.start, near.start) - min(last.stop, near.stop) > _NEAR:
            return []
        if near.row not in VARYING_ROWS:
            return [near]
    return []


def _pairs(run: Run, samples: Samples, model: ModeModel) -> tuple[Array, Array, float]:
    """Both values of the samples of a run that have them, and their usual noise."""
    part = samples.part(run.start, run.stop)
    use = (part.status == PAIR) | (part.status == CLEAR)
    white = part.white[use]
    return part.y[use], part.x[use], model.noise * float(np.sqrt(white.mean())) if white.size else model.noise


def _renamed(runs: list[Run], evidence: _Evidence) -> list[Run]:
    """Noisy runs beside another one under that one's row, where it explains them better: the path never went back."""
    out = list(runs)
    for i, run in enumerate(runs):
        near = [
            r
            for r in out[max(0, i - 1) : i] + runs[i + 1 : i + 2]
            if min(abs(run.start - r.stop), abs(r.start - run.stop)) < 3
        ]
        if run.row not in VARYING_ROWS or not near:
            continue
        rows = evidence.of(*inner(run))
        best = max((r.row for r in near), key=lambda row: rows[row])
        if rows[best] > rows[run.row] + evidence.model.switch_cost:
            out[i] = Run(run.start, run.stop, best)
    return out


def inner(run: Run) -> tuple[int, int]:
    """First sample and the one after the last, without a few at both ends: a delay leaves some of the neighbours there."""
    edge = min(5, run.size // 20)
    return run.start + edge, run.stop - edge


def _bridged(runs: list[Run], evidence: _Evidence) -> list[Run]:
    """Join runs of one row where the same fault explains them and what lies between as well as parts of their own do.

    Between them may lie a healthy stretch or a shorter run of another row.
    """
    out: list[Run] = []
    for run in runs:
        out.append(run)
        while len(out) > 1:
            if _one_fault(out[-2], out[-1], evidence):
                out[-2:] = [Run(out[-2].start, out[-1].stop, out[-1].row)]
            elif len(out) > 2 and _interrupted(out[-3], out[-2], out[-1], evidence):
                out[-3:] = [Run(out[-3].start, out[-1].stop, out[-1].row)]
            else:
                break
    return out


def _interrupted(first: Run, middle: Run, last: Run, evidence: _Evidence) -> bool:
    """Whether a run of another row merely interrupts one fault, such as a value that rests for a moment."""
    if first.row != last.row or middle.size >= min(first.size, last.size):
        return False
    brief = last.start - first.stop <= min(_BRIEF_S / evidence.model.dt, min(first.size, last.size) / 4)
    return (brief and _of_one_gain(first, last, evidence.samples, evidence.model)) or _one_fault(first, last, evidence)


def _lost_in_one(first: Run, second: Run, samples: Samples, model: ModeModel) -> bool:
    """Whether a gain is all but a healthy one in one of two runs and none in the other: a path may go from the one to the other in one row."""
    if first.row != second.row or first.row not in SCALED_ROWS:
        return False
    off = sorted(abs(1.0 - gain) for gain in _gains_beside(first, second, samples, model))
    return off[0] < _ALL_BUT and off[1] > _ONE_GAIN


def _of_one_gain(first: Run, last: Run, samples: Samples, model: ModeModel) -> bool:
    """Whether two runs may be of one gain; what is no loss of gain has none that differs."""
    if first.row not in SCALED_ROWS:
        return True
    before, after = _gains_beside(first, last, samples, model)
    return abs(before - after) <= _ONE_GAIN


def _gains_beside(first: Run, last: Run, samples: Samples, model: ModeModel) -> tuple[float, float]:
    """Gain at the end of one run and at the beginning of another."""
    reach = round(_BRIDGE_S / model.dt)

    def gain(start: int, stop: int) -> float:
        y, x, _ = _pairs(Run(start, stop, first.row), samples, model)
        power = float(x @ x)
        return float(x @ y) / power if power > 0.0 else 1.0

    return (
        gain(max(first.start, first.stop - reach), first.stop),
        gain(last.start, min(last.stop, last.start + reach)),
    )


def _one_fault(first: Run, second: Run, evidence: _Evidence) -> bool:
    """Whether two runs and what lies between are one fault rather than three parts."""
    reach = round(_BRIDGE_S / evidence.model.dt)
    a, b, c, d = max(first.start, first.stop - reach), first.stop, second.start, min(second.stop, second.start + reach)
    if first.row != second.row or c - b > _APART_S / evidence.model.dt:
        return False
    row = first.row
    whole, parts = evidence.of(a, d)[row], evidence.of(a, b)[row] + evidence.of(c, d)[row]
    return bool(whole > parts + evidence.of(b, c).max() - 2 * evidence.model.switch_cost)
