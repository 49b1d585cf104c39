"""A speed that comes late: it is what command and other wheels make it be, but a while ago.

A delay shows only while the speed changes. Its states are healthy, one for each of some delays, and one that nothing explains; each block
is scored by how far the reading is from what was expected so long ago, beside the command and beside the other view of the wheel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.common_cause import evident, overlaps
from diagnosis.response.ground import dragged
from diagnosis.response.kernel import posterior
from diagnosis.response.machine import Judged
from diagnosis.response.ramps import at_its_limit
from diagnosis.response.spells import Spell
from diagnosis.response.uphill import lower_of
from diagnosis.results.assessment import Finding
from diagnosis.results.detectability import Deviation, Power
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import lasting
from diagnosis.results.vocabulary import Tier
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

DELAYS_S = (0.3, 0.45, 0.6, 0.8, 1.05)
_SLACK_S = 0.12  # by which readings of healthy wheels come earlier or later than expected
_OFF = 2.5  # usual misfits from which on no delay explains a reading
_FREEDOM = 3.0  # of Student's t
_WEIGHT = 0.25  # of a block's misfit: that lasts for about a second
_SHARE, _LEAST = 0.03, 0.02  # of the speed, and of its usual size: misfit that tells nothing
_USUALLY, _USUAL = 0.9, 1.5  # quantile of the misfit of a healthy wheel, and what it is then, in usual ones
_HEALTHY_S, _LATE_S = 120.0, 15.0  # for which a wheel stays as it is, on average
_LEAST_P, _LEAST_S = 0.8, 3.0
_SURE = 0.95
_OWN = 0.95  # that it is the sensor's where another view shows how this wheel turns
_LENGTH_S = 10.0
_BETTER = (
    1.0  # log-likelihood by which a delay explains a speed better beside the other view, which knows of no commands
)
_EXPLAINS = 0.5  # of the misfit that nothing explains: so much of it, at most, a delay leaves beside each of what it is held against


class Past(NamedTuple):
    """What a wheel is held against.

    Attributes
    ----------
    speed, noise : Array, shape (b,)
        Expected speed and its usual misfit [m/s]; NaN where nothing is.
    """

    speed: Array
    noise: Array


def pasts_of(one: Judged, block_s: float) -> list[Past]:
    """Command and other view of a wheel, with usual misfits found in the mission.

    `block_s` is the length of a block [s].
    """
    blocks = one.wheel.blocks
    views = [0.5 * (blocks.low + blocks.high)] if one.response.answered else []
    if one.speed is not None:
        views.append(one.speed)
    return [_past(blocks.mean, v, one.driving, block_s) for v in views if np.isfinite(v).any()]


def _past(y: Array, speed: Array, driving: Flags, block_s: float) -> Past:
    change = np.abs(np.gradient(np.nan_to_num(speed))) / block_s
    off = np.abs(y - speed)
    use = driving & np.isfinite(off)
    usual = float(np.quantile(np.abs(speed[use]), 0.9)) if use.any() else 0.0
    floor = float(np.median(off[use])) if use.any() else np.inf
    noise = np.hypot(floor + _LEAST * usual + _SHARE * np.abs(speed), _SLACK_S * change)
    over = float(np.quantile((off / noise)[use], _USUALLY)) if use.any() else 0.0
    return Past(speed, np.asarray(noise * max(1.0, over / _USUAL)))


def scores(y: Array, pasts: list[Past], block_s: float) -> Array:
    """Log-likelihood of each block if healthy, if late by each of `DELAYS_S`, and if nothing explains it, shape (b, delays + 2)."""
    out = np.zeros((y.size, len(DELAYS_S) + 2))
    place = np.arange(y.size, dtype=np.float64)
    for past in pasts:
        known = np.isfinite(past.speed) & np.isfinite(y)
        speed = np.where(np.isfinite(past.speed), past.speed, 0.0)
        for k, delay in enumerate((0.0, *DELAYS_S)):
            was = np.interp(place - delay / block_s, place, speed)
            there = known & (np.interp(place - delay / block_s, place, known.astype(np.float64)) > 0.99)
            noise = np.interp(place - delay / block_s, place, past.noise)
            out[:, k] -= np.where(there, _WEIGHT * _loss((y - was) / np.where(there, noise, 1.0)), 0.0)
        out[:, -1] -= _WEIGHT * _loss(np.full(y.size, _OFF)) * known
    return out


def _loss(z: Array) -> Array:
    return np.asarray(0.5 * (_FREEDOM + 1.0) * np.log1p(np.nan_to_num(z) ** 2 / _FREEDOM))


def late_of(one: Judged, block_s: float) -> list[Finding]:
    """Times in which a wheel's speed comes late.

    Parameters
    ----------
    one : Judged
        The wheel.
    block_s : float
        Length of a block [s].
    """
    pasts = pasts_of(one, block_s)
    if not pasts:
        return []
    score = scores(one.wheel.blocks.mean, pasts, block_s)
    enters, leaves = (np.full(len(score), -np.expm1(-block_s / t)) for t in (_HEALTHY_S, _LATE_S))
    p = posterior(score, enters, leaves)
    late = p[:, 1:-1].sum(axis=1)
    out = []
    for start, stop in runs_of(late > 0.5):
        part = slice(start, stop)
        if (stop - start) * block_s >= _LEAST_S and float(np.mean(late[part])) >= _LEAST_P:
            delay = float(np.asarray(DELAYS_S)[np.argmax(p[part, 1:-1].sum(axis=0))])
            out.append(_finding(one, start, stop, (delay, float(np.mean(late[part]))), block_s))
    return out


def _finding(one: Judged, start: int, stop: int, said: tuple[float, float], block_s: float) -> Finding:
    delay, p = said
    width = int(one.wheel.blocks.start[1])
    own = one.wheel.own
    side = Side.SENSOR if own else Side.SENSOR_OR_ACTUATOR
    beside = f"what {one.wheel.compared} show of it" if one.speed is not None else "what its command makes of it"
    texts = [
        f"{one.data.name} follows {beside} about {plain(delay, 2)} s late for {lasting((stop - start) * block_s, 1)}."
    ]
    if not own:
        texts.append(
            "Readings that are held up and a drive that answers late cannot be distinguished; stamps by the encoder itself, or "
            f"{'' if one.wheel.compared else '{or_view}'}the drive's effort would tell them apart."
        )
    share = _OWN if own else 1.0
    rest = (Hypothesis(Side.ACTUATOR.value, FaultMode.OUTSIDE_TABLE.value, p * (1.0 - share)),) if own else ()
    return Finding(
        start=start * width, stop=min(stop * width, one.data.y.size), side=side, mode=FaultMode.OUTSIDE_TABLE, probability=p * share,
        hypotheses=(Hypothesis(side.value, FaultMode.OUTSIDE_TABLE.value, p * share), *rest, Hypothesis("none", State.HEALTHY.value, 1.0 - p)),
        epsilon=None, sat=None, evidence=tuple(texts), tier=Tier.RESPONSE,
    )  # fmt: skip


def smallest_delay(one: Judged, block_s: float) -> tuple[Power, str]:
    """Smallest delay of ten seconds that would have been found wherever in the driving it began, and a sentence on where it would not."""
    y, pasts = one.wheel.blocks.mean, pasts_of(one, block_s)
    number = round(_LENGTH_S / block_s)
    first = np.arange(0, max(y.size - number, 0) + 1, max(1, round(1.0 / block_s)))
    last = np.minimum(first + number, y.size)
    driven = np.r_[0, np.cumsum(one.driving)]
    enough = driven[last] - driven[first] >= 0.5 * number
    first, last = first[enough], last[enough]
    sizes = np.full(first.size, np.inf)
    place, known = np.arange(y.size, dtype=np.float64), np.nan_to_num(y)
    enter, leave = (-np.expm1(-block_s / t) for t in (_HEALTHY_S, _LATE_S))
    needed = float(
        np.log((len(DELAYS_S) + 1) / enter) - np.log(leave) + number * block_s * (1 / _LATE_S - 1 / _HEALTHY_S)
    )
    for k in range(len(DELAYS_S), 0, -1) if pasts else ():
        delayed = np.where(np.isfinite(y), np.interp(place - DELAYS_S[k - 1] / block_s, place, known), np.nan)
        score = scores(delayed, pasts, block_s)
        run = np.r_[0.0, np.cumsum(score[:, k] - np.maximum(score[:, 0], score[:, -1]))]
        sizes[run[last] - run[first] >= needed] = DELAYS_S[k - 1]
    size = float(np.quantile(sizes, _SURE, method="higher")) if sizes.size else np.inf
    seen = sizes[np.isfinite(sizes)]
    told = f"A delay of {one.data.name} that lasts {_LENGTH_S:.0f} s "
    told += (
        f"would show from {plain(float(np.median(seen)), 2)} s on, at {100 * seen.size / sizes.size:.0f} % of the places where it may begin; elsewhere, "
        "and where it is less, it is not assessed."
        if seen.size
        else f"is not assessed: up to {plain(DELAYS_S[-1], 2)} s none would show, as the speed hardly changes or nothing else shows it."
    )
    return Power(Deviation.DELAY, _LENGTH_S, size if np.isfinite(size) else None, "s", None, int(sizes.size)), told


def late_neighbour(spell: Spell, wheel: str, late: Mapping[str, Sequence[Finding]], width: int) -> bool:
    """Whether what looks like a scale lies, for the most part, where another wheel's speed comes late: beside that one it differs, too."""
    if spell.own or not spell.unspecific:
        return False
    start, stop = spell.start * width, spell.stop * width
    return any(
        2 * (min(f.stop, stop) - max(f.start, start)) >= stop - start
        for other, found in late.items()
        if other != wheel
        for f in found
    )


def left_open(late: Mapping[str, Sequence[Finding]], judged: Mapping[str, Judged]) -> dict[str, list[Finding]]:
    """Of times in which a speed comes late, those that the ground, or a slope, explains, or no delay beside all that shows the speed.

    Nothing healthy can be said of them, either.

    Parameters
    ----------
    late : Mapping[str, Sequence[Finding]]
        Times by wheel.
    judged : Mapping[str, Judged]
        All wheels.
    """
    return {
        w: [
            f
            for f in found
            if _by_ground(f, w, judged)
            or not _explained(f, judged[w])
            or _with_the_others(f, judged[w])
            or at_its_limit(f, judged[w])
            or _by_a_load(f, judged[w])
        ]
        for w, found in late.items()
    }


def late_wheels(judged: Mapping[str, Judged], block_s: float) -> dict[str, list[Finding]]:
    """Times in which the speed of each wheel comes late.

    None where several do: then commands, or clocks, are late. None where another wheel is evidently wrong: what is held against its
    readings, and dragged by its loop, tells no delay.

    `block_s` is the length of a block [s].
    """
    found = {w: late_of(_beside_sound(w, judged), block_s) for w in judged}
    width = {w: int(j.wheel.blocks.start[1]) for w, j in judged.items() if j.wheel.blocks.start.size > 1}
    wrong = {
        w: [(s.start * width.get(w, 1), s.stop * width.get(w, 1)) for s in j.spells if evident(s, j)]
        for w, j in judged.items()
    }
    out = {}
    for w, own in found.items():
        late = [(f.start, f.stop) for o, its in found.items() if o != w for f in its]
        others = [span for o, spans in wrong.items() if o != w for span in spans]
        out[w] = [
            f
            for f in own
            if not any(f.start < stop and start < f.stop for start, stop in late)
            and not any(overlaps(span, (f.start, f.stop)) for span in others)
        ]
    return out


def _by_ground(found: Finding, wheel: str, judged: Mapping[str, Judged]) -> bool:
    """Whether a wheel only gives way to the other side, which takes a while, or is at once what it is told: then tyres slip, or a body spins on."""
    one = judged[wheel]
    width = int(one.wheel.blocks.start[1])
    part = slice(found.start // width, -(-found.stop // width))
    if not one.response.answered or (one.speed is not None and one.across is None):
        return False
    by_command, block_s = pasts_of(one._replace(speed=None), width * one.wheel.dt), width * one.wheel.dt
    score = scores(one.wheel.blocks.mean, by_command, block_s)[part].sum(axis=0)
    return bool(score[0] >= score[1:-1].max()) or dragged(part, wheel, judged, 0.0)


def _explained(found: Finding, one: Judged) -> bool:
    """Whether some delay explains a speed beside its command and beside the other view, each by itself.

    What is late is late beside both; a wheel that is merely off another one, as where that one is wrong, is so beside that one alone.
    """
    width = int(one.wheel.blocks.start[1])
    part, block_s = slice(found.start // width, -(-found.stop // width)), width * one.wheel.dt
    each = (scores(one.wheel.blocks.mean, [p], block_s)[part].sum(axis=0) for p in pasts_of(one, block_s))
    return all(score[1:-1].max() >= _EXPLAINS * score[-1] for score in each)


def _with_the_others(found: Finding, one: Judged) -> bool:
    """Whether a speed is as little late beside its other view as none: then all that the view is made of does the same, as where commands cease."""
    if one.speed is None:
        return False
    width = int(one.wheel.blocks.start[1])
    part, block_s = slice(found.start // width, -(-found.stop // width)), width * one.wheel.dt
    if not np.isfinite(one.speed[part]).all():
        return False
    score = scores(one.wheel.blocks.mean, pasts_of(one, block_s)[-1:], block_s)[part].sum(axis=0)
    return bool(score[1:-1].max() < score[0] + _BETTER)


def _by_a_load(found: Finding, one: Judged) -> bool:
    """Whether what a load makes of a drive without a speed loop explains it as well as any delay; see `diagnosis.response.uphill`."""
    width = int(one.wheel.blocks.start[1])
    pasts = pasts_of(one, width * one.wheel.dt)
    if len(pasts) != 1 or not one.response.answered:
        return False
    part = slice(found.start // width, -(-found.stop // width))
    off = lower_of(one.wheel.blocks.mean[part], pasts[0].speed[part])
    if off is None:
        return False
    lower = -_WEIGHT * float(_loss(off / pasts[0].noise[part]).sum())
    late = scores(one.wheel.blocks.mean, pasts, width * one.wheel.dt)[part, 1:-1].sum(axis=0).max()
    return bool(lower >= late)


def _beside_sound(wheel: str, judged: Mapping[str, Judged]) -> Judged:
    """A wheel without its other view where another wheel, by which that may be made, is evidently wrong."""
    one = judged[wheel]
    wrong = [s for o, j in judged.items() if o != wheel for s in j.spells if evident(s, j)]
    if one.speed is None or not wrong:
        return one
    speed = one.speed.copy()
    for s in wrong:
        speed[s.start : s.stop] = np.nan
    return one._replace(speed=speed)
