"""Whose misfit it is where a wheel and other channels differ: by who is further off what it should be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.models import Blocks

Array = NDArray[np.float64]

_BLAME_BLOCKS = 9  # over which it is asked whose command misfit is the larger
_MAKES = 0.5  # of a misfit beside other wheels: as much beside the command makes it


def off_command(blocks: Blocks) -> Array:
    """Misfit of a wheel beside its command, in usual ones, shape (b,)."""
    return np.abs(blocks.mean - np.clip(blocks.mean, blocks.low, blocks.high)) / blocks.noise


def blame_by_commands(own: Blocks, others: Sequence[Blocks], speed: Array) -> tuple[Array, Array | None]:
    """Share of a misfit that is the own wheel's: by who is further off its command, or who alone makes nothing of it at all; and nobody's.

    A wheel that is off its command by a small part of what it differs from the others does not make the difference, however exactly it
    usually follows.

    Parameters
    ----------
    own : Blocks
        The wheel.
    others : Sequence[Blocks]
        Those that it is held against.
    speed : Array, shape (b,)
        Its speed by them [m/s].

    Returns
    -------
    tuple[Array, Array or None]
        Shares of the wheel and of nobody, 0…1, shape (b,) each; None where the latter is not asked.
    """
    mine, theirs = _answers(own), [_answers(o) for o in others]
    if mine and not all(theirs):
        return np.zeros(own.mean.size), None
    if not mine and any(theirs):
        return np.ones(own.mean.size), None
    blame = blame_of([off_command(b) for b in (own, *others)])
    if not mine:
        return blame, None
    makes = _makes(own, speed)
    return blame * makes, blame * (1.0 - makes)


def _makes(own: Blocks, speed: Array) -> Array:
    """How much of a misfit beside other wheels a wheel's misfit beside its command can make, 0…1; shape (b,).

    `speed` of shape (b,): by the others [m/s].
    """
    off, apart = own.mean - np.clip(own.mean, own.low, own.high), own.mean - speed
    kernel = np.ones(_BLAME_BLOCKS)
    both = [np.convolve(np.nan_to_num(np.abs(x)), kernel, mode="same") for x in (off, apart)]
    return np.asarray(np.clip(both[0] / np.maximum(_MAKES * both[1], 1e-9), 0.0, 1.0))


def _answers(blocks: Blocks) -> bool:
    """Whether a command says what a wheel's speed is to be."""
    return bool(np.isfinite(blocks.low).any())


def blame_of(away: Sequence[Array]) -> Array:
    """Share of a misfit that is the first one's own, by which of them is further off what it should be, shape (b,).

    `away`: how far each is off, in usual misfits, shape (b,) each.
    """
    kernel = np.ones(_BLAME_BLOCKS) / _BLAME_BLOCKS
    smooth = [np.convolve(np.nan_to_num(np.minimum(a, 8.0)), kernel, mode="same") for a in away]
    return np.asarray(1.0 / (1.0 + np.exp(-4.0 * (smooth[0] - np.max(smooth[1:], axis=0)))))
