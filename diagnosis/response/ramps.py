"""A drive that changes its speed as fast as it can: it comes late to what was to change faster, and nothing is wrong with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.response.machine import Judged
from diagnosis.response.spells import Spell
from diagnosis.results.assessment import Finding

_FASTEST = 0.98  # quantile of a drive's changes of speed that is its limit
_FASTER, _PACE = 1.1, 0.7  # times the limit: faster than it can, and at it
_SHOWS, _MOSTLY = 0.4, 0.8  # of the most that it is off: blocks that show it are; of these


def only_a_ramp(spell: Spell, late: Sequence[Finding], one: Judged, width: int) -> bool:
    """Whether what looks like a scale lies, for the most part, where a drive is `at_its_limit`.

    `late` are the times in which it comes late; `width` is the number of steps in a block.
    """
    if spell.own or not spell.unspecific:
        return False
    start, stop = spell.start * width, spell.stop * width
    return any(2 * (min(f.stop, stop) - max(f.start, start)) >= stop - start and at_its_limit(f, one) for f in late)


def at_its_limit(found: Finding, one: Judged) -> bool:
    """Whether a speed that is late changes as fast as this drive ever does, towards what was to change faster: its ramp is late, nothing else.

    A limit of the acceleration that a mission meets once or twice is not in the response that was found.

    Parameters
    ----------
    found : Finding
        The time.
    one : Judged
        The wheel.
    """
    b = one.wheel.blocks
    width, block_s = int(b.start[1]), int(b.start[1]) * one.wheel.dt
    if not one.response.answered:
        return False
    part = slice(found.start // width, -(-found.stop // width))
    asked = 0.5 * (b.low + b.high)
    own, told = (np.abs(np.gradient(np.nan_to_num(x))) / block_s for x in (b.mean, asked))
    known = one.driving & np.isfinite(b.mean)
    off = known[part] & (np.abs(b.mean - asked)[part] > _SHOWS * np.nanmax(np.abs(b.mean - asked)[part], initial=0.0))
    if not off.any():
        return False
    limit = float(np.quantile(own[known], _FASTEST))
    return bool(np.max(told[part][off]) > _FASTER * limit and np.mean(own[part][off] > _PACE * limit) > _MOSTLY)
