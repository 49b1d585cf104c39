"""What a mission would have shown of a wheel that is judged by its response: faults laid over its own blocks and scored again."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.models import (
    HEALTHY,
    LEAST_P,
    MEAN_FAULTY_S,
    MEAN_HEALTHY_S,
    NOISY,
    SILENT,
    STATES,
    Beside,
    Blocks,
    hold_shares,
    scores,
)
from diagnosis.results.detectability import Deviation, Power, Powers
from replay.faults import Side

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LENGTHS_S = (2.0, 10.0, None)
_TRACED_S = 10.0
_SIZES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 0.9)
_SURE = 0.95
_LEAST_S = 1.0  # of expected motion in a place
_APART_S = 1.0
_BARE_S = 5.0  # beside its command alone
_HALF = 0.5  # loss of `_TRACED_S` that must have shown where a reading is called healthy


def powers_of(
    blocks: Blocks,
    driving: Flags,
    asked: Flags,
    block_s: float,
    beside: Beside | None,
    clear_at: float,
    lasting: float = np.inf,
) -> Powers:
    """Smallest faults that would have been found.

    The response, the other view and the usual noise are found in the mission itself, so that of what lasts all through it only a
    silent speed, and what makes a wheel unlike the others, would have shown.

    Parameters
    ----------
    blocks : Blocks
        The wheel.
    driving, asked : Flags, shape (b,)
        Where it moves, and where command or other wheels make it move.
    block_s : float
        Length of a block [s].
    beside : Beside or None
        Another view of its speed.
    clear_at : float
        Loss that counts [1].
    lasting : float
        Smallest loss over the whole mission that makes the wheel unlike the others [1].
    """
    steps = np.cumsum(np.r_[0, asked])
    gains = {size: _gain(blocks, driving, block_s, beside, size) for size in _SIZES}
    silent = blocks._replace(mean=0.0 * blocks.mean, zero=blocks.readings, same=blocks.readings)
    lost = _against(silent, driving, block_s, beside, slice(SILENT, SILENT + 1))
    held = -np.log(hold_shares(blocks, driving, block_s)[1]) * (asked & (blocks.readings > 0))[:, np.newaxis]
    rows: list[Power] = []
    starts: tuple[float, ...] = ()
    trace: tuple[float | None, ...] = ()
    for length in LENGTHS_S:
        number = asked.size if length is None else max(1, round(length / block_s))
        first = np.arange(0, max(asked.size - number, 0) + 1, max(1, round(_APART_S / block_s)))
        last = np.minimum(first + number, asked.size)
        enough = (steps[last] - steps[first]) * block_s >= min(_LEAST_S, 0.5 * number * block_s)
        first, last = first[enough], last[enough]
        needed = _needed(last - first, block_s, ends=length is not None)
        losses = np.full(first.size, lasting) if length is None else _smallest(first, last, gains, needed)
        loud = np.inf if length is None else _loud(blocks)
        if beside is None and length is not None and length < _BARE_S:
            losses[:] = np.inf
        rows += [
            _row(Deviation.INEFFICIENT, length, losses, "1", clear_at),
            _row(Deviation.NO_SIGNAL, length, np.where(_shown(lost, first, last, needed), 1.0, np.inf), "", 1.0),
            _row(Deviation.NOISY, length, np.full(first.size, loud), "m/s", None),
        ]
        if length is not None:
            rows.append(
                _row(Deviation.STUCK, length, np.where(_shown(held, first, last, needed), 1.0, np.inf), "", 1.0)
            )
        if length == _TRACED_S:
            starts = tuple((first * block_s).tolist())
            trace = tuple(float(x) if np.isfinite(x) else None for x in losses)
    told = Side.SENSOR if beside is not None else Side.SENSOR_OR_ACTUATOR
    return Powers(tuple(rows), told, starts, trace)


def unshown(powers: Powers, size: int, block_s: float) -> Flags:
    """Blocks around which a speed lower by half would mostly not have shown for ten seconds: that nothing is seen there says nothing.

    Parameters
    ----------
    powers : Powers
        What would have shown.
    size : int
        Blocks of the mission.
    block_s : float
        Length of a block [s].

    Returns
    -------
    Flags, shape (size,)
    """
    number = max(1, round(_TRACED_S / block_s))
    shown = np.zeros(size)
    for start, loss in zip(powers.start_s, powers.loss, strict=True):
        first = round(start / block_s)
        shown[first : first + number] += 1.0 if loss is not None and loss <= _HALF else -1.0
    return np.asarray(shown <= 0.0)


def _gain(blocks: Blocks, driving: Flags, block_s: float, beside: Beside | None, size: float) -> Array:
    """Log-evidence of each scale against healthy, were the readings less by a share, shape (b, scales)."""
    less = blocks._replace(mean=(1.0 - size) * blocks.mean)
    return _against(less, driving, block_s, beside, slice(NOISY + 1, None))


def _against(blocks: Blocks, driving: Flags, block_s: float, beside: Beside | None, states: slice) -> Array:
    score = scores(blocks, driving, block_s, beside)
    return np.asarray(score[:, states] - score[:, [HEALTHY]])


def _needed(number: NDArray[np.intp], block_s: float, *, ends: bool) -> Array:
    """Log-evidence of so many blocks that outweighs how seldom a fault begins, stays so long, and ends, shape of `number`."""
    enter, leave = -np.expm1(-block_s / MEAN_HEALTHY_S), -np.expm1(-block_s / MEAN_FAULTY_S)
    once = np.log((STATES - 1) / enter) - (np.log(leave) if ends else 0.0) + np.log(LEAST_P / (1.0 - LEAST_P))
    return np.asarray(once + number * (block_s / MEAN_FAULTY_S - block_s / MEAN_HEALTHY_S))


def _shown(gain: Array, first: NDArray[np.intp], last: NDArray[np.intp], needed: Array) -> Flags:
    """Whether the evidence in each place [first, last) is enough."""
    total = np.vstack([np.zeros(gain.shape[1]), np.cumsum(gain, axis=0)])
    return np.asarray((total[last] - total[first]).max(axis=1, initial=-np.inf) >= needed)


def _smallest(first: NDArray[np.intp], last: NDArray[np.intp], gains: Mapping[float, Array], needed: Array) -> Array:
    """Smallest loss that shows in each place; infinite where none does. Shape (places,)."""
    out = np.full(first.size, np.inf)
    for size in reversed(_SIZES):
        found = _shown(gains[size], first, last, needed)
        out[found] = size
    return out


def _loud(blocks: Blocks) -> float:
    """Noise that is three times the usual one [m/s], in the loudest third of the driving."""
    return 3.0 * float(np.max(blocks.usual, initial=0.0))


def _row(deviation: Deviation, length: float | None, sizes: Array, unit: str, natural: float | None) -> Power:
    size = float(np.quantile(sizes, _SURE, method="higher")) if sizes.size else np.inf
    share = None if natural is None or not sizes.size else float(np.mean(sizes <= natural))
    return Power(deviation, length, size if np.isfinite(size) else None, unit, share, int(sizes.size))
