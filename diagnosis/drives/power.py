"""What a mission would have shown of a single drive: the smallest loss of its sensor, and the smallest load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.drives.effort_map import STEP_S
from diagnosis.drives.findings import thinnest
from diagnosis.drives.load import LoadTrack, track_steps
from diagnosis.drives.load_findings import load_stretches
from diagnosis.drives.speed_pair import SpeedPair
from diagnosis.results.detectability import Deviation, Power, Powers
from replay.faults import Side
from replay.machine.config import Limits
from replay.machine.drive_model import EffortMap

Array = NDArray[np.float64]

LENGTHS_S = (2.0, 10.0, None)
_LIKE = 4.0  # so many samples of the implied speed err alike
_SURE = 0.95
_QUANTILE = 1.645  # of a normal distribution, 95 %
_AROUND = 30  # steps without load around a load, and with it where it lasts all through
_LOADS = np.geomspace(0.01, 0.6, 48)  # that are tried [share of the healthy effort]
_ADDED = np.geomspace(
    0.5, 64.0, 400
)  # added noise that is tried, as the states of the noisy row have it [healthy noise]


def noncentrality(needed: float) -> float:
    """d at which log-evidence of mean d²/2 and variance d² exceeds `needed` in 95 of 100 cases: d²/2 − 1.645·d = needed.

    A log-evidence, without a unit [1].
    """
    return float(_QUANTILE + np.sqrt(_QUANTILE**2 + 2.0 * needed))


def added_noise(count: Array, needed: float) -> Array:
    """Smallest added white noise, as a multiple κ of the healthy one, that `count` independent samples show at 95 %.

    Against noise of its own power, healthy noise loses (κ² − ln(1 + κ²))/2 a sample on average, with variance κ⁴/2. Infinite where
    not even the strongest state shows.

    Both of one shape (k,); `needed` is a log-evidence [1].
    """
    power = _ADDED**2
    rate, spread = 0.5 * (power - np.log1p(power)), _QUANTILE * np.sqrt(0.5) * power
    # rate·n − spread·√n = needed
    least = ((spread + np.sqrt(spread**2 + 4.0 * rate * needed)) / (2.0 * rate)) ** 2
    place = np.searchsorted(-np.minimum.accumulate(least), -np.asarray(count))
    return np.asarray(np.r_[_ADDED, np.inf][place], dtype=np.float64)


def sensor_powers(pair: SpeedPair, limits: Limits) -> Powers:
    """Smallest faults of the speed's channel that the controller did not meet.

    A loss ε leaves ε·v beside the implied speed. Samples of which four count as one, of noise σ each, give log-evidence of mean d²/2
    and variance d², d² = Σ(ε·v/σ)²/4; it must exceed what a finding needs (`diagnosis.drives.findings.thinnest`) in 95 of 100 cases.

    Parameters
    ----------
    pair : SpeedPair
        Both speeds.
    limits : Limits
        ``driving_speed``, ``min_epsilon``, ``min_sat``, ``clear_at``.
    """
    x = np.abs(pair.samples.x)
    seen = (pair.samples.status == PAIR) & (np.nan_to_num(x) > limits.driving_speed)
    variance = pair.noise**2 + np.nan_to_num(pair.samples.slack) ** 2
    switch_cost = pair.model().switch_cost
    rows: list[Power] = []
    for length in LENGTHS_S:
        n = x.size if length is None else max(1, round(length / pair.dt))
        needed = thinnest(switch_cost, ends=length is not None)
        count, information = _places(np.where(seen, x**2 / variance, 0.0), seen, n)
        noise = np.sqrt(_places(np.where(seen, variance, 0.0), seen, n)[1])
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            loss = noncentrality(needed) * np.sqrt(_LIKE / (count * information))
            loss = np.where(count > 0, np.maximum(loss, limits.min_epsilon), np.inf)
        loss[loss > 1.0] = np.inf
        total = np.where(np.isfinite(loss), 1.0, np.inf)
        noisy = np.maximum(noise * added_noise(count / _LIKE, needed), limits.min_sat)
        if length is None:
            noisy[:] = np.inf  # the healthy noise is found in the mission itself
        rows += [
            _row(Deviation.INEFFICIENT, length, loss, "1", limits.clear_at),
            _row(Deviation.NO_SIGNAL, length, total, "", 1.0),
            _row(Deviation.NOISY, length, noisy, "m/s", None),
        ]
        if length is not None:
            rows.append(_row(Deviation.STUCK, length, total, "", 1.0))
    return Powers(tuple(rows), Side.SENSOR)


def load_powers(load: LoadTrack, effort: EffortMap, limits: Limits) -> Powers:
    """Smallest loads, as shares of the effort, that would have been findings.

    What `diagnosis.drives.load` needs without noise, and what noise, drift and the mission's own offset hide of it in 95 of 100 cases;
    at speeds of healthy missions alone.

    Parameters
    ----------
    load : LoadTrack
        The mission's extra effort.
    effort : EffortMap
        From healthy missions.
    limits : Limits
        ``clear_at``, and what a finding needs.
    """
    known = load.covered > 0.5
    driven = np.abs(load.expected[known])
    reference = float(np.median(driven)) if driven.size else np.nan
    rows: list[Power] = []
    for length in LENGTHS_S:
        n = int(known.size) if length is None else round(length)
        count, expected = _places(np.nan_to_num(load.expected), known, max(1, n))
        own = (
            effort.between if length is None else np.hypot(effort.noise / np.sqrt(max(n, 1)), effort.drift * np.sqrt(n))
        )
        least_share = limits.min_epsilon / (1.0 - limits.min_epsilon) * np.abs(expected)
        least = np.maximum(least_load(length, reference, effort, limits), least_share) + _QUANTILE * own
        with np.errstate(invalid="ignore"):
            share = np.where(2 * count > min(n, known.sum()), least / (np.abs(expected) + least), np.inf)
        share[~np.isfinite(share)] = np.inf
        rows.append(_row(Deviation.INEFFICIENT, length, share, "1", limits.clear_at))
    return Powers(tuple(rows), Side.SENSOR_OR_ACTUATOR)


def least_load(length: float | None, reference: float, effort: EffortMap, limits: Limits) -> float:
    """Smallest load [unit of effort] that is a finding where efforts are just what map and load say; infinite where none is.

    Parameters
    ----------
    length : float or None
        Of the load [s], between two stretches without it; None: over the whole mission.
    reference : float
        Usual healthy effort [unit of effort].
    effort, limits
        As in `load_powers`.
    """
    around = 0 if length is None else _AROUND
    loaded = _AROUND if length is None else round(length)
    needed = np.full(loaded + 2 * around, reference)

    def found(load: float) -> bool:
        used = needed.copy()
        used[around : around + loaded] += load
        return bool(load_stretches(track_steps(needed, used, effort, 1), effort.between, limits, STEP_S))

    loads = _LOADS * reference
    first, last = 0, loads.size
    while first < last:  # the first of them that is found
        middle = (first + last) // 2
        first, last = (first, middle) if found(float(loads[middle])) else (middle + 1, last)
    return float(np.r_[loads, np.inf][first])


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
