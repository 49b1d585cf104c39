"""A drive without a speed loop, judged by its command alone: uphill, loaded or on a low battery it is slower, and nothing is wrong with it.

A load takes the same speed from whatever is asked; a scaled reading, or a weak drive, takes a share, and a delay shows in each change.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.spells import Spell

Array = NDArray[np.float64]

_MOST = 0.8  # of the blocks: the line goes by them once it has been through all
_LEAST_GAIN, _MOST_GAIN = 0.6, 1.4  # share of its command that such a drive may keep to
_BETTER = 0.6  # of what a share leaves: so little a constant has to leave
_VARIES = 0.15  # of a command's size, by which it changes: else share and constant are one
_LEAST_BLOCKS = 8


def lower_of(y: Array, asked: Array) -> Array | None:
    """What is left of a speed by a share of its command and a constant [m/s]; None where no such drive keeps to that share.

    Both of shape (b,); so is what is returned, 0 where either is unknown.
    """
    known = np.isfinite(y) & np.isfinite(asked)
    own, told = y[known], asked[known]
    if own.size < _LEAST_BLOCKS:
        return None
    line = np.column_stack([told, np.ones(told.size)])
    off = np.abs(own - line @ np.linalg.lstsq(line, own, rcond=None)[0])
    kept = off <= np.quantile(off, _MOST)
    gain, constant = np.linalg.lstsq(line[kept], own[kept], rcond=None)[0]
    if not _LEAST_GAIN < gain < _MOST_GAIN:
        return None
    out = np.zeros(y.size)
    out[known] = own - gain * told - constant
    return out


def lower_by_a_load(spell: Spell, one: Judged) -> bool:
    """Whether what looks like a share of a command is, rather, the same constant off it all through the spell.

    Only where nothing but its command shows the speed of a wheel: another wheel, or the body, would be off as well.
    """
    if one.speed is not None or not one.response.answered or not spell.unspecific:
        return False
    blocks, part = one.wheel.blocks, slice(spell.start, spell.stop)
    y, told = blocks.mean[part], 0.5 * (blocks.low + blocks.high)[part]
    known = np.isfinite(y) & np.isfinite(told)
    y, told = y[known], told[known]
    if y.size < _LEAST_BLOCKS or np.std(told) < _VARIES * float(np.sqrt(np.mean(told**2))):
        return False
    share = float(y @ told) / float(told @ told)
    by_share, by_constant = np.abs(y - share * told), np.abs(y - told - float(np.median(y - told)))
    return bool(np.mean(by_constant) < _BETTER * float(np.mean(by_share)))
