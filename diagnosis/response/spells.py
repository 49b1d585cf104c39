"""Spells: blocks in which one kind of fault is the most probable state of a wheel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.models import FROZEN, NOISY, SCALES, SILENT
from replay.arrays.runs import runs_of
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_JOIN_S = 1.0


class Spell(NamedTuple):
    """Blocks [start, stop) in one kind of state, with its probability, and whether the position of its joint contradicts it.

    `mine` is the share of the misfit beside other wheels that is this one's own [1]; `kin`: the position contradicts another part of it;
    `turns`: whether the body turns as the reading says, None where that cannot be told.
    """

    start: int
    stop: int
    mode: FaultMode
    p: float
    own: bool = False
    mine: float = 1.0
    kin: bool = False
    turns: bool | None = None

    @property
    def unspecific(self) -> bool:
        """Whether it is a share of the speed or outside the table, as slip, drag and other wheels make it of a healthy one as well."""
        return self.mode.scaled or self.mode is FaultMode.OUTSIDE_TABLE


def spans_of(there: Flags, gap: int = 0) -> list[tuple[int, int]]:
    """Steps [start, stop) of each stretch in which something holds, with interruptions of `gap` steps at most bridged; `there` of shape (n,)."""
    out: list[tuple[int, int]] = []
    for start, stop in runs_of(there):
        if out and start - out[-1][1] <= gap:
            out[-1] = out[-1][0], stop
        else:
            out.append((start, stop))
    return out


def deviations_of(off: Flags, shows: Flags, gap: int) -> list[tuple[int, int]]:
    """Blocks [start, stop) of each deviation, interrupted by few blocks that would show one and do not.

    Parameters
    ----------
    off : Flags, shape (b,)
        Blocks that deviate.
    shows : Flags, shape (b,)
        Blocks in which a deviation would show.
    gap : int
        How many of these may lie between two blocks of one deviation.
    """
    out: list[tuple[int, int]] = []
    for k in np.flatnonzero(off).tolist():
        if out and np.count_nonzero(shows[out[-1][1] : k]) <= gap:
            out[-1] = out[-1][0], k + 1
        else:
            out.append((k, k + 1))
    return out


def spells_of(posterior: Array, block_s: float) -> list[Spell]:
    """Spells of faults along the most probable states; short interruptions of one mode are bridged.

    `posterior` of shape (blocks, states), probabilities; `block_s` in s.
    """
    modes = _modes()
    best = posterior.argmax(axis=1)
    out: list[Spell] = []
    for k in np.flatnonzero(best > 1).tolist():
        mode = modes[best[k]]
        if out and out[-1].mode is mode and (k - out[-1].stop) * block_s <= _JOIN_S:
            out[-1] = out[-1]._replace(stop=k + 1)
        else:
            out.append(Spell(k, k + 1, mode, 0.0))
    return [s._replace(p=_mean_probability(posterior[s.start : s.stop], s.mode)) for s in out]


def _modes() -> dict[int, FaultMode]:
    out = {FROZEN: FaultMode.STUCK, SILENT: FaultMode.NO_SIGNAL, NOISY: FaultMode.NOISY}
    scaled = {
        NOISY + 1 + k: FaultMode.INEFFICIENT if s < 1.0 else FaultMode.OUTSIDE_TABLE for k, s in enumerate(SCALES)
    }
    return out | scaled


def _mean_probability(posterior: Array, mode: FaultMode) -> float:
    same = [k for k, m in _modes().items() if m is mode]
    return float(np.mean(posterior[:, same].sum(axis=1)))


def where_asked(
    spells: Sequence[Spell], asked: tuple[Flags, Flags], least: int, posterior: Array | None
) -> list[Spell]:
    """Spells without those of a silent or scaled speed in which no motion is expected, and the ends of such spells cut to it.

    A wheel at rest shows neither scale nor health, so that what it does before and after says nothing of how probable the spell is.

    Parameters
    ----------
    spells : Sequence[Spell]
        Spells.
    asked : tuple[Flags, Flags], each of shape (b,)
        Blocks in which command or other wheels make the wheel move; with those in which the position of its joint goes on, for what
        that contradicts.
    least : int
        Blocks of expected motion that a spell needs.
    posterior : Array or None, shape (b, states)
        Probability of each state, to be taken anew where it moves; None: it stays, as where another view speaks at rest, too.
    """
    out = []
    for s in spells:
        if s.mode is FaultMode.STUCK or s.mode is FaultMode.NOISY:
            out.append(s)
            continue
        places = s.start + np.flatnonzero(asked[s.own][s.start : s.stop])
        if places.size >= least:
            first, stop = int(places[0]), int(places[-1]) + 1
            p = s.p
            if posterior is not None and s.mode.scaled:
                p = max(p, _mean_probability(posterior[first:stop], s.mode))
            out.append(s._replace(start=first, stop=stop, p=p))
    return out


def until_back(spells: Sequence[Spell], dead: Flags, asked: Flags) -> list[Spell]:
    """Spells of a silent speed, each up to the last expected motion before the reading comes back: what stands in between ends none.

    Parameters
    ----------
    spells : Sequence[Spell]
        Spells.
    dead : Flags, shape (b,)
        Blocks in which nothing but one reading of standstill came, or none.
    asked : Flags, shape (b,)
        Blocks in which command or other wheels make the wheel move.
    """
    out = []
    for s in spells:
        stop = s.stop
        if s.mode is FaultMode.NO_SIGNAL:
            back = np.flatnonzero(~dead[stop:])
            missed = np.flatnonzero(asked[stop : stop + int(back[0]) if back.size else dead.size])
            stop += int(missed[-1]) + 1 if missed.size else 0
        out.append(s._replace(stop=stop))
    return out
