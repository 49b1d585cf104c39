"""Where two wheels differ, the one that is nearer to what it is asked for is not the one to name, whatever either usually makes of it.

A drive that is weak from the start of a log makes a share of its command there all the time, so that nothing is unusual about it: what it
drags down beside it looks off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.drive import off_asked
from diagnosis.response.machine import Judged
from diagnosis.response.rivals import jumped
from diagnosis.response.spells import Spell

Array = NDArray[np.float64]

_NEARER = 0.8  # of what the others are off their commands


def nearer_to_its_command(
    spell: Spell, wheel: str, judged: Mapping[str, Judged], mates: Sequence[str], block_s: float
) -> bool:
    """Whether a wheel is nearer to what it is asked for than each of its side that it is held against.

    A channel that jumps, or that the position of its joint contradicts, shows by itself that it is wrong, and is left as it is.

    Parameters
    ----------
    spell : Spell
        Of the wheel.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    mates : Sequence[str]
        Others of its side, which are told the same.
    block_s : float
        Length of a block [s].
    """
    one = judged[wheel]
    if spell.own or spell.kin or not spell.unspecific:
        return False
    beside = one.wheel.compared.split(" and ")
    others = [judged[w] for w in mates if judged[w].data.name in beside]
    if one.speed is None or not others or jumped(one, spell):
        return False
    mine, theirs = _off(one, spell, block_s), [_off(j, spell, block_s) for j in others]
    return bool(mine < _NEARER * min(theirs))


def _off(one: Judged, spell: Spell, block_s: float) -> float:
    """How far a wheel is from what it is asked for in a spell [m/s] (median); NaN where that is not known."""
    off = off_asked(one, block_s)[spell.start : spell.stop]
    known = np.isfinite(off)
    return float(np.median(off[known])) if known.any() else np.nan
