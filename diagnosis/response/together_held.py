"""Wheels that all hold their readings at once while nothing else is asked of them: a coarse channel, and a machine that goes on as it does.

A speed that is rounded, or filtered, gives one value for as long as it changes by less than a step; creeping down a slope, for many seconds.
Sensors do not fail together, so that none of them is stuck by that alone; nor is any of them proved by it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.response.machine import Judged
from diagnosis.response.spells import Spell
from replay.faults import FaultMode

_HELD, _MOSTLY = 0.9, 0.5  # of a block's readings; of the blocks
_MOST = 0.1, 0.85  # of what is asked: its ends may have what comes before and after
_CHANGES = 0.05  # of the top speed, by which what is asked changes: then wheels would, too


def hold_together(spell: Spell, wheel: str, judged: Mapping[str, Judged]) -> bool:
    """Whether all other wheels hold their readings, too, for most of a spell in which what the command makes of this one hardly changes.

    Parameters
    ----------
    spell : Spell
        Of the wheel.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    """
    if spell.mode is not FaultMode.STUCK or spell.own or spell.kin or len(judged) < 2:
        return False
    part, blocks = slice(spell.start, spell.stop), judged[wheel].wheel.blocks
    told = (0.5 * (blocks.low + blocks.high))[part]
    top = float(np.nanquantile(np.abs(blocks.mean), 0.95)) if np.isfinite(blocks.mean).any() else 0.0
    if not np.isfinite(told).all() or np.ptp(np.quantile(told, _MOST)) > _CHANGES * top:
        return False
    others = (j.wheel.blocks for w, j in judged.items() if w != wheel)
    return all(np.mean(b.same[part] >= _HELD * np.maximum(b.readings[part], 1.0)) > _MOSTLY for b in others)
