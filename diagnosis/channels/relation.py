"""How a channel follows its reference while both are healthy: delay, lag, play and scale, found from the mission itself.

Two speed sensors differ in delay, lag and scale. A spool is no wire: it follows its command behind play (hysteresis) and a
lag. The relation is y(t) = gain·w(t − delay) with lag·ẇ + w = P(x), P the play operator, and it is the one with the least
misfit by Cauchy's loss of scale s, mean ln(1 + (misfit/s)²), where the reference moves: a fault leaves it alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import shifted
from diagnosis.channels.scale import scale_of
from replay.arrays.compiling import njit
from replay.arrays.numeric import bridged, without_nan
from replay.arrays.quantiles import median_of, quantile_known, quantile_of

Array = NDArray[np.float64]

_CHUNK_S, _WARM_S, _CHUNKS = 2.0, 0.5, 30
_PLACES = 6_000
_STILL, _MOTION_S = 0.3, 0.02  # share of the chunks that moves least; time over which a reference moves
_DELAY_S = 0.004
_LAGS_S = (0.004, 0.008, 0.012, 0.018, 0.026, 0.036, 0.05, 0.07)
_LONG_LAGS_S = (0.1, 0.14, 0.2, 0.28)  # of large pilot stages: tried where the longest of the others is best
_PLAYS = (0.006, 0.012, 0.02, 0.03, 0.045, 0.065)  # of the span
_BETTER = 0.03  # of the loss, by which a lag or play is believed
_AT_ONCE = 8  # lags and plays
_ROUNDS, _FINE = 5, (0.8, 0.9, 0.95, 1.05, 1.1, 1.25)
_USUAL = 0.35
_SIBLINGS, _ALIKE, _SCALES = 3, 0.6, 0.01  # channels of one kind; steps, and share, by which they may differ
_UNLIKE = np.array([1.6, 1.6, 1.5])  # times the usual play, lag and lateness of valves of one kind


class Relation(NamedTuple):
    """How a channel follows its reference.

    Attributes
    ----------
    delay : float
        [steps]
    lag : float
        Of first order [s].
    play : float
        Width of the hysteresis [unit of the reference].
    gain : float
        Scale of the channel against its reference [1].
    """

    delay: float = 0.0
    lag: float = 0.0
    play: float = 0.0
    gain: float = 1.0

    def expected(self, x: Array, dt: float) -> Array:
        """What a healthy channel reads beside x, shape (n,); NaN where x is. `dt` in s; both in the channel's unit."""
        followed = x if self.lag == 0.0 and self.play == 0.0 else _followed(x, self.play, self.lag, dt)
        moved = shifted(followed, self.delay)
        return moved if self.gain == 1.0 else self.gain * moved


def relations_of_kind(found: Sequence[Relation], dt: float) -> list[Relation]:
    """Relations of three or more channels of one kind: as late, and of the scale, as most of them are.

    Faults that last for much of a mission may move what is found of one channel; a scale keeps its own small error.

    Parameters
    ----------
    found : Sequence[Relation]
        As each was found.
    dt : float
        Step [s].
    """
    late, gain = np.array([r.delay + r.lag / dt for r in found]), np.array([r.gain for r in found])
    if late.size < _SIBLINGS:
        return list(found)
    apart = np.abs(late - median_of(late))
    agree = np.count_nonzero(apart <= _ALIKE) >= max(2, (late.size + 1) // 2)
    typical, usual = found[int(np.argmin(apart))], float(median_of(gain))
    timed = [typical._replace(gain=r.gain) if agree and d > _ALIKE else r for r, d in zip(found, apart, strict=True)]
    return [r if abs(r.gain - usual) <= _SCALES else r._replace(gain=usual) for r in timed]


def valves_of_kind(found: Sequence[Relation], dt: float) -> list[Relation]:
    """Relations of three or more valves of one kind: play, lag, delay and scale that no other has are a fault's, and become the usual ones.

    Positions that merely come late are all as late as most of them are. `dt` is a step [s].
    """
    if len(found) < _SIBLINGS:
        return list(found)
    if all(r.lag == r.play == 0.0 for r in found):
        return relations_of_kind(found, dt)
    scale = float(median_of([r.gain for r in found]))
    found = [r if abs(r.gain - scale) <= _SCALES else r._replace(gain=scale) for r in found]
    size = np.array([(r.play, r.lag, r.delay * dt + r.lag) for r in found])
    usual = quantile_of(size, 0.5, axis=0, method="lower")
    typical = found[int(np.argmin(np.abs(size - usual) @ np.array([1.0, 0.5, 0.0])))]
    odd = (size > _UNLIKE * usual + np.array([_PLAYS[0], _LAGS_S[3], max(_DELAY_S, 0.5 * dt)])).any(axis=1)
    return [typical._replace(gain=r.gain) if strange else r for r, strange in zip(found, odd, strict=True)]


class _Filled(NamedTuple):
    """A reference whose gaps are bridged, so that nothing settles after one."""

    x: Array
    unknown: NDArray[np.bool_]

    @classmethod
    def of(cls, x: Array) -> _Filled:
        return cls(bridged(x), ~np.isfinite(x))

    def followed(self, ways: Sequence[tuple[float, float]], dt: float) -> Array:
        """With each of some lags [s] and plays, shape (ways, n): several at once, for each waits for its own last sample."""
        out = np.empty((len(ways), self.x.size))
        keep = np.array([float(np.exp(-dt / lag)) if lag > 0.0 else 0.0 for lag, _ in ways])
        _follow(self.x, np.array([0.5 * play for _, play in ways]), keep, out)
        out[:, self.unknown] = np.nan
        return out


def _followed(x: Array, play: float, lag: float, dt: float) -> Array:
    return np.asarray(_Filled.of(x).followed([(lag, play)], dt)[0])


@njit(cache=True, nogil=True)
def _follow(x, half, keep, out):  # type: ignore[no-untyped-def]
    """Plays of ± half, then lags that keep a share of the last value: one for each row of out."""
    held = np.full(half.size, x[0] if x.size else 0.0)
    y = held.copy()
    for k in range(x.size):
        for i in range(half.size):
            held[i] = min(max(held[i], x[k] - half[i]), x[k] + half[i])
            y[i] = keep[i] * y[i] + (1.0 - keep[i]) * held[i]
            out[i, k] = y[i]


class _Places(NamedTuple):
    """Stretches of a mission in which the reference moves, one after the other, and places in them to compare at."""

    x: Array
    at: NDArray[np.intp]
    y: Array


def relation_of(
    y: Array, x: Array, use: NDArray[np.bool_], start: Relation, dt: float, delays: tuple[int, int], span: float
) -> Relation:
    """The relation of a channel to its reference.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Channel and reference.
    use : NDArray[np.bool_], shape (n,)
        Samples that count.
    start : Relation
        With the delay that alone explains most; what is not better stays.
    dt : float
        Step [s].
    delays : tuple[int, int]
        Least and largest delay [steps].
    span : float
        Largest plausible magnitude of the reference where it may have play; 0: it has none.
    """
    places = _places(y, x, use, dt, max(abs(d) for d in delays))
    if places.at.size < 200:
        return start
    best, least = start, np.inf
    for _ in range(2):  # the usual misfit is that of the best relation so far
        scale = _scale(places, best, dt)
        least = _misfit(places, best, dt, scale)
        plain = best
        found, misfit = _least(places, _trials(best, delays, span, dt), dt, scale)
        if span and found.lag >= _LAGS_S[-1]:  # two speeds are measured closer to each other
            longer = (found._replace(lag=lag, delay=delay) for lag in _LONG_LAGS_S for delay in {found.delay, 0.0})
            found, misfit = min((found, misfit), _least(places, longer, dt, scale), key=lambda best: best[1])
        if misfit < least - _BETTER:
            best, least = found, misfit
        if best is plain:
            break
    for _ in range(_ROUNDS if best.lag or best.play else 0):
        found, misfit = _least(places, _near(best, delays, _PLAYS[-1] * span), dt, scale)
        if misfit >= least:
            break
        best, least = found, misfit
    return best._replace(gain=scale_of(_at(places, best, dt), places.y))


def _trials(near: Relation, delays: tuple[int, int], span: float, dt: float) -> Iterable[Relation]:
    """Lags with plays with delays; what lags does not lead its reference as well, by more than a sample may hide."""
    step = max(1, round(_DELAY_S / dt))
    for lag in (0.0, *(s for s in _LAGS_S if s > 0.5 * dt)):
        for play in (0.0, *(_PLAYS if span else ())):
            for delay in range(delays[0] if lag == 0.0 else max(delays[0], -step), delays[1] + 1, step):
                yield near._replace(delay=float(delay), lag=lag, play=play * span)


def _near(best: Relation, delays: tuple[int, int], widest: float) -> Iterable[Relation]:
    lags, plays = [best.lag * f for f in _FINE], [best.play * f for f in _FINE]
    least = delays[0] if best.lag == 0.0 else max(delays[0], min(best.delay, -1.0))
    yield from (best._replace(lag=lag) for lag in lags if lag > 0.0 and (widest == 0.0 or lag <= _LONG_LAGS_S[-1]))
    yield from (best._replace(play=play) for play in plays if 0.0 < play <= widest)
    yield from (
        best._replace(delay=best.delay + d) for d in (-1.0, -0.3, 0.3, 1.0) if least <= best.delay + d <= delays[1]
    )


def _places(y: Array, x: Array, use: NDArray[np.bool_], dt: float, margin: int) -> _Places:
    """Where the reference moves, in chunks of the mission, each after a time to settle in."""
    length, warm = max(20, round(_CHUNK_S / dt)), round(_WARM_S / dt)
    warm = max(warm, 2 * margin)
    count = (x.size - warm - margin) // length
    if count < 1:
        return _Places(x, np.zeros(0, np.intp), y)
    first = warm + length * np.arange(count)
    filled = without_nan(x)
    moved = np.abs(np.diff(filled))[warm : warm + count * length - 1]
    moved = np.r_[moved, 0.0].reshape(count, length).sum(axis=1)
    kept = first[moved >= quantile_of(moved, _STILL)]
    kept = kept[np.linspace(0, kept.size - 1, min(kept.size, _CHUNKS)).round().astype(np.intp)]
    steps = (kept[:, None] + np.arange(-warm, length + margin)).ravel()
    inside = np.tile(np.r_[np.zeros(warm, np.bool_), np.ones(length, np.bool_), np.zeros(margin, np.bool_)], kept.size)
    good = inside & use[steps] & np.isfinite(x[steps]) & np.isfinite(y[steps])
    reach = max(1, round(_MOTION_S / dt))
    motion = np.abs(np.roll(filled[steps], -reach) - np.roll(filled[steps], reach))
    at = np.flatnonzero(good & (motion > median_of(motion[good]))) if good.any() else np.zeros(0, np.intp)
    at = at[:: max(1, at.size // _PLACES)]
    return _Places(x[steps], at, y[steps][at])


def _at(places: _Places, relation: Relation, dt: float) -> Array:
    """What the relation expects at the places, but for its gain."""
    followed = _followed(places.x, relation.play, relation.lag, dt) if relation.lag or relation.play else places.x
    whole = int(np.floor(relation.delay))
    part = relation.delay - whole
    near = followed[places.at - whole]
    return near if part < 1e-9 else (1.0 - part) * near + part * followed[places.at - whole - 1]


def _scale(places: _Places, relation: Relation, dt: float) -> float:
    """Usual size of the misfit: a low quantile, which faults in half of the places leave alone."""
    misfit = np.abs(places.y - relation.gain * _at(places, relation, dt))
    return max(float(quantile_known(misfit, _USUAL)), 1e-12)


def _misfit(places: _Places, relation: Relation, dt: float, scale: float) -> float:
    """Cauchy's loss at the places [1]."""
    followed = _followed(places.x, relation.play, relation.lag, dt) if relation.lag or relation.play else places.x
    return _misfit_of(followed, places, relation, scale)


def _misfit_of(followed: Array, places: _Places, relation: Relation, scale: float, most: float = np.inf) -> float:
    """The same of a reference with play and lag; infinite where it is more than `most`."""
    whole = int(np.floor(relation.delay))
    part = relation.delay - whole
    return float(_loss(followed, places.at, places.y, whole, part if part >= 1e-9 else 0.0, relation.gain, scale, most))


@njit(cache=True, error_model="numpy", nogil=True)
def _loss(x, at, y, whole, part, gain, scale, most):  # type: ignore[no-untyped-def]
    """Mean ln(1 + (misfit/scale)²) over the places where x is known, by logarithms of products.

    No place lowers the sum: it ends where the mean can be no less than `most` any more.
    """
    total, product, known = 0.0, 1.0, 0
    enough = most * at.size
    for k in range(at.size):
        near = x[at[k] - whole]
        if part > 0.0:
            near = (1.0 - part) * near + part * x[at[k] - whole - 1]
        misfit = (y[k] - gain * near) / scale
        if misfit == misfit:
            product *= 1.0 + misfit * misfit
            known += 1
            if product > 1e100:
                total, product = total + np.log(product), 1.0
                if total > enough:
                    return np.inf
    return (total + np.log(product)) / known


def _least(places: _Places, trials: Iterable[Relation], dt: float, scale: float) -> tuple[Relation, float]:
    """The trial that leaves least, and what it leaves."""
    best, least = Relation(), np.inf
    filled = _Filled.of(places.x)
    alike = [(way, list(of)) for way, of in groupby(trials, key=lambda trial: (trial.lag, trial.play))]
    for first in range(0, len(alike), _AT_ONCE):
        some = alike[first : first + _AT_ONCE]
        for (way, of), followed in zip(some, filled.followed([way for way, _ in some], dt), strict=True):
            for trial in of:
                misfit = _misfit_of(followed if any(way) else places.x, places, trial, scale, least)
                if misfit < least:
                    best, least = trial, misfit
    return best, least
