"""Runs of equal rows: cutting a path into segments, merging and trimming them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import HEALTHY, SCALED_ROWS, STEADY_ROWS, VARYING_ROWS
from diagnosis.estimation.viterbi import ModePath

_RESTS = 5  # times as long as a rest at its end: a noisy run


@dataclass(frozen=True)
class Run:
    """Samples [start, stop) in one row of the table."""

    start: int
    stop: int
    row: int

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.stop - self.start


def runs_of(path: ModePath) -> list[Run]:
    """Cut a path where the row changes, or where a steady row was entered anew (another value or gain)."""
    row = path.row
    anew = path.entered & np.isin(row, STEADY_ROWS)
    cut = np.flatnonzero(np.r_[True, (row[1:] != row[:-1]) | anew[1:]])
    stops = np.r_[cut[1:], row.size]
    return [Run(int(a), int(b), int(row[a])) for a, b in zip(cut, stops, strict=True)]


def absorb_short(runs: Iterable[Run], shortest: int) -> list[Run]:
    """Give faulty runs below `shortest` samples to a neighbouring faulty run, the longer one first."""
    out = list(runs)
    k = 0
    while k < len(out):
        run = out[k]
        if run.row != HEALTHY and run.size < shortest:
            near = [
                j for j in (k - 1, k + 1) if 0 <= j < len(out) and out[j].row != HEALTHY and out[j].size >= shortest
            ]
            if near:
                j = max(near, key=lambda i: out[i].size)
                merged = Run(min(run.start, out[j].start), max(run.stop, out[j].stop), out[j].row)
                out[min(j, k) : max(j, k) + 1] = [merged]
                k = max(0, min(j, k) - 1)
                continue
        k += 1
    return out


def join_noisy(runs: Iterable[Run]) -> list[Run]:
    """Give an inefficient run that lies between two noisy ones, no longer than they, or beside a much longer one to them.

    A drifting bias that rests for a while looks like a loss of gain.
    """
    out = list(runs)
    k = 1
    while k < len(out) - 1:
        a, b, c = out[k - 1 : k + 2]
        if b.row in SCALED_ROWS and a.row == c.row and a.row in VARYING_ROWS and b.size <= a.size + c.size:
            out[k - 1 : k + 2] = [Run(a.start, c.stop, a.row)]
            k = max(1, k - 1)
        else:
            k += 1
    k = 1
    while k < len(out):
        a, b = out[k - 1 : k + 1]
        noisy, scaled = (a, b) if a.row in VARYING_ROWS else (b, a)
        if noisy.row in VARYING_ROWS and scaled.row in SCALED_ROWS and scaled.size * _RESTS <= noisy.size:
            out[k - 1 : k + 1] = [Run(a.start, b.stop, noisy.row)]
        else:
            k += 1
    return out


def merge_equal(
    runs: Iterable[Run],
    gap: int,
    rows: tuple[int, ...] = VARYING_ROWS,
    apart: Callable[[Run, Run], bool] = lambda first, second: False,
) -> list[Run]:
    """Join runs of one of `rows` that touch or are separated by less than `gap` healthy samples, unless they are `apart`."""
    out: list[Run] = []
    for run in runs:
        if run.row in rows and out:
            if out[-1].row == run.row and not apart(out[-1], run):
                out[-1] = Run(out[-1].start, run.stop, run.row)
                continue
            near = len(out) > 1 and out[-1].row == HEALTHY and out[-1].size < gap
            if near and out[-2].row == run.row and not apart(out[-2], run):
                out[-2:] = [Run(out[-2].start, run.stop, run.row)]
                continue
        out.append(run)
    return out


def with_leads(runs: list[Run], lead: int, tail: int, gap: int) -> list[tuple[Run, int, int]]:
    """Faulty runs with the start and stop of the fault that each stands for.

    A fault that grows drifts before it is what it becomes: noisy runs before another one, without a gap and no longer
    than twice that, and runs shorter than `lead` are its beginning; runs shorter than `tail` behind it are its end.

    Parameters
    ----------
    runs : list[Run]
        Faulty runs in order.
    lead, tail : int
        Samples.
    gap : int
        Healthy samples between two runs that count as none.

    Returns
    -------
    list[tuple[Run, int, int]]
        In order of time.
    """
    cuts = [0, *(i + 1 for i, (a, b) in enumerate(pairwise(runs)) if b.start - a.stop > gap), len(runs)]
    out: list[tuple[Run, int, int]] = []
    open_chains = [runs[a:b] for a, b in pairwise(cuts)]
    while open_chains:
        chain = open_chains.pop()
        if not chain:
            continue
        main = max(range(len(chain)), key=lambda i: chain[i].size / (2 if chain[i].row in VARYING_ROWS else 1))
        first = last = main
        while first and (chain[first - 1].row in VARYING_ROWS or chain[first - 1].size < lead):
            first -= 1
        while last + 1 < len(chain) and chain[last + 1].size < tail:
            last += 1
        out.append((chain[main], chain[first].start, chain[last].stop))
        open_chains += [chain[:first], chain[last + 1 :]]
    return sorted(out, key=lambda item: item[0].start)


def trim(run: Run, quiet: NDArray[np.bool_]) -> Run | None:
    """Cut samples off both ends in which nothing moves; None where nothing is left. `quiet` of shape (n,)."""
    moving = np.flatnonzero(~quiet[run.start : run.stop])
    if not moving.size:
        return None
    return Run(run.start + int(moving[0]), run.start + int(moving[-1]) + 1, run.row)
