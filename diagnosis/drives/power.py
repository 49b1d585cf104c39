"""What a mission would have shown of a single drive: the smallest loss of its sensor, and the smallest load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.drives.load import LoadTrack
from diagnosis.drives.load_findings import LEAST_LOAD
from diagnosis.drives.speed_pair import SpeedPair
from diagnosis.results.detectability import Deviation, Power, Powers
from replay.faults import Side
from replay.machine.config import Limits
from replay.machine.drive_model import EffortMap

Array = NDArray[np.float64]

LENGTHS_S = (2.0, 10.0, None)
_NEEDED = 15.0  # log-evidence that outweighs how seldom faults begin
_LIKE = 4.0  # so many samples of the implied speed err alike
_SURE = 0.95
_QUANTILE = 1.645  # of a normal distribution, 95 %


def sensor_powers(pair: SpeedPair, limits: Limits) -> Powers:
    """Smallest faults of the speed's channel that the controller did not meet.

    A loss ε leaves ε·v beside the implied speed; n samples of noise σ show it where n/4·(ε·v/σ)²/2 is enough.

    Parameters
    ----------
    pair : SpeedPair
        Both speeds.
    limits : Limits
        ``driving_speed``, ``min_epsilon``, ``min_sat``, ``clear_at``.
    """
    x = np.abs(pair.samples.x)
    seen = (pair.samples.status == PAIR) & (np.nan_to_num(x) > limits.driving_speed)
    rows: list[Power] = []
    for length in LENGTHS_S:
        n = x.size if length is None else max(1, round(length / pair.dt))
        count, speed = _places(np.where(seen, x, 0.0), seen, n)
        with np.errstate(divide="ignore", invalid="ignore"):
            off = pair.noise * np.sqrt(2.0 * _LIKE * _NEEDED / count)
            loss = np.where(count > 0, np.maximum(off / speed, limits.min_epsilon), np.inf)
        loss[loss > 1.0] = np.inf
        total = np.where(np.isfinite(loss), 1.0, np.inf)
        rows += [
            _row(Deviation.INEFFICIENT, length, loss, "1", limits.clear_at),
            _row(Deviation.NO_SIGNAL, length, total, "", 1.0),
            _row(Deviation.NOISY, length, np.maximum(np.where(count > 0, off, np.inf), limits.min_sat), "m/s", None),
        ]
        if length is not None:
            rows.append(_row(Deviation.STUCK, length, total, "", 1.0))
    return Powers(tuple(rows), Side.SENSOR)


def load_powers(load: LoadTrack, effort: EffortMap, limits: Limits) -> Powers:
    """Smallest loads, as shares of the effort, that are more than what healthy missions differ by.

    Parameters
    ----------
    load : LoadTrack
        The mission's extra effort.
    effort : EffortMap
        From healthy missions.
    limits : Limits
        ``clear_at``.
    """
    known = np.isfinite(load.expected)
    rows: list[Power] = []
    for length in LENGTHS_S:
        n = int(known.size) if length is None else round(length)
        count, expected = _places(np.nan_to_num(load.expected), known, max(1, n))
        own = (
            effort.between if length is None else np.hypot(effort.noise / np.sqrt(max(n, 1)), effort.drift * np.sqrt(n))
        )
        least = LEAST_LOAD * effort.between + _QUANTILE * own
        share = np.where(2 * count > min(n, known.sum()), least / (np.abs(expected) + least), np.inf)
        rows.append(_row(Deviation.INEFFICIENT, length, share, "1", limits.clear_at))
    return Powers(tuple(rows), Side.SENSOR_OR_ACTUATOR)


def _places(x: Array, use: NDArray[np.bool_], n: int) -> tuple[Array, Array]:
    """How many of n samples count, and their mean, for places half of n apart in which any does; shape (places,)."""
    first = np.arange(0, max(x.size - n, 0) + 1, max(1, n // 2))
    last = np.minimum(first + n, x.size)
    total, number = np.cumsum(np.r_[0.0, np.where(use, x, 0.0)]), np.cumsum(np.r_[0, use])
    count = (number[last] - number[first]).astype(np.float64)
    driven = count >= 0.25 * (last - first)
    count = count[driven]
    return count, (total[last] - total[first])[driven] / np.maximum(count, 1.0)


def _row(deviation: Deviation, length: float | None, sizes: Array, unit: str, natural: float | None) -> Power:
    size = float(np.quantile(sizes, _SURE, method="higher")) if sizes.size else np.inf
    share = None if natural is None or not sizes.size else float(np.mean(sizes <= natural))
    return Power(deviation, length, size if np.isfinite(size) else None, unit, share, int(sizes.size))
