"""Deviations that say little of one wheel: as many others do as it does, or what passed just before is disputed itself."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.common_cause import evident
from diagnosis.response.disputed import disputed
from diagnosis.response.machine import Judged
from diagnosis.response.rivals import jumped
from diagnosis.response.spells import Spell

Array = NDArray[np.float64]

_OTHERS = 3  # wheels that it is held against together
_WITH, _ALIKE = (
    0.6,
    0.5,
)  # of what it is off them: as near to another wheel, which is off its own others the same way by so much
_BEFORE_S, _LEAST_S = 6.0, 2.0  # before a deviation, and of dispute in that time


def in_company(spell: Spell, wheel: str, judged: Mapping[str, Judged]) -> bool:
    """Whether a wheel that is held against all others goes with so many of them that these are no majority against it.

    Parameters
    ----------
    spell : Spell
        Of the wheel.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    """
    one = judged[wheel]
    if one.speed is None or spell.own or not spell.unspecific:
        return False
    beside = one.wheel.compared.split(" and ")
    others = [j for w, j in judged.items() if w != wheel and j.data.name in beside]
    if len(others) < _OTHERS or jumped(one, spell):
        return False
    part = slice(spell.start, spell.stop)
    off = _off(one, part)
    if not np.isfinite(off).any():
        return False
    size = float(np.nanmedian(off))
    with_it = 0
    for j in others:
        near, its = np.abs(one.wheel.blocks.mean - j.wheel.blocks.mean)[part], _off(j, part)
        if np.isfinite(near).any() and np.isfinite(its).any():
            with_it += bool(
                np.nanmedian(near) < _WITH * abs(size) and float(np.nanmedian(its)) * np.sign(size) > _ALIKE * abs(size)
            )
    return 2 * (with_it + 1) >= len(others) + 1


def _off(one: Judged, part: slice) -> Array:
    """How far a wheel is off what the others say [m/s], of some blocks."""
    y = one.wheel.blocks.mean[part]
    return np.full(y.size, np.nan) if one.speed is None else np.asarray(y - one.speed[part])


def after_a_dispute(spell: Spell, wheel: str, judged: Mapping[str, Judged], block_s: float) -> bool:
    """Whether a brief deviation ends what is disputed between wheels that keep to their commands: either may have let go.

    A loop around an encoder that reads a share keeps to its command, and lets go where the encoder reads right again.

    Parameters
    ----------
    spell : Spell
        Of the wheel.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    block_s : float
        Length of a block [s].
    """
    if evident(spell, judged[wheel]) or jumped(judged[wheel], spell):
        return False
    first = max(0, spell.start - round(_BEFORE_S / block_s))
    for other, j in judged.items():
        before = int(np.count_nonzero(disputed(j, block_s)[first : spell.start]))
        if other != wheel and before * block_s >= _LEAST_S and before > spell.stop - spell.start:
            return True
    return False
