"""Drives that keep one speed whatever they are told, by the wheel's own sensor: a stuck valve, an output that holds.

The reading shakes as that of a turning wheel does, so that it is none that is frozen; what it shows stays where it is while the command
asks for much else, and the other wheels follow theirs.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from diagnosis.response.body_limits import at_body_limit
from diagnosis.response.machine import Judged
from diagnosis.response.models import Blocks
from diagnosis.results.assessment import Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import lasting
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_S, _JOIN_S = 3.0, 15.0  # for which it keeps its speed, and within which it is at the same speed again
_NEAR = 0.02  # of the top speed, or a usual misfit: as near to one speed
_REPEATS = 0.5  # of a block's readings: a frozen channel repeats them all
_TURNS, _ASKED = 0.08, 0.3  # of the top speed: it moves, and its command varies by as much
_FAR, _OFF = 3.0, 0.1  # usual misfits, and share of the top speed, off its command, ...
_MOSTLY, _AWAY_S = 0.25, 2.0  # ... for as much of the time, and for so long
_FOLLOWS = 0.7  # of the time, in which another wheel is as near to its own command as it should
_OTHERS = 2
_P, _SENSOR = 0.85, 0.1
_STANDS, _RESTS_S, _LEAVES_S = (
    0.04,
    2.0,
    1.0,
)  # of the top speed, below which the other wheels stand; while it keeps its speed; for which it leaves that
_LEAST_BLOCKS, _MOST_OF = 40, 0.8  # that show a share of what is asked; of them that it explains
_TWICE = 2.0  # tolerances, by which two wheels at one speed differ
_WEAK, _IN_SHARE = (
    0.9,
    0.05,
)  # share of what is asked below which a drive is weak; of what is asked, as near to such a share


def running_on(wheel: str, judged: Mapping[str, Judged], blocks: Blocks | None, block_s: float) -> list[Finding]:
    """Times in which a wheel keeps one speed while its command asks for much else.

    Parameters
    ----------
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    blocks : Blocks or None
        Of the wheel, with what is expected of it; None where that is not known.
    block_s : float
        Length of a block [s].
    """
    # two wheels that drag each other keep a speed as well
    if blocks is None or blocks.start.size < 2 or len(judged) <= _OTHERS:
        return []
    if not all(j.response.answered for w, j in judged.items() if w != wheel):
        return []  # of which nobody knows whether they follow
    one, y = judged[wheel], blocks.mean
    band = np.r_[blocks.low, blocks.high]
    top = float(np.nanquantile(np.abs(band), 0.95)) if np.isfinite(band).any() else 0.0
    if top <= 0.0:
        return []
    tolerance = np.maximum(_NEAR * top, np.nan_to_num(blocks.noise))
    alive = (blocks.same <= _REPEATS * blocks.readings) & np.isfinite(y)
    away = _astray(blocks, top)
    others = [np.isfinite(j.wheel.blocks.mean) & ~_astray(j.wheel.blocks, top) for w, j in judged.items() if w != wheel]
    asked = 0.5 * (blocks.low + blocks.high)
    limit = at_body_limit(judged, block_s)
    found: list[tuple[int, int, float]] = []
    for start, stop, speed in _level(y, alive, float(np.median(tolerance)), round(_LEAST_S / block_s)):
        part = slice(start, stop)
        told = asked[part][np.isfinite(asked[part])]
        alone = all(float(np.mean(x[part])) > _FOLLOWS for x in others)
        alone &= not any(
            _with(y[part], j.wheel.blocks.mean[part], tolerance[part]) for w, j in judged.items() if w != wheel
        )
        off = int(np.count_nonzero(away[part]))
        if abs(speed) < _TURNS * top or not told.size or not alone:
            continue
        if limit is not None and np.mean(limit[part]) > _MOSTLY:
            continue
        if off < max(_AWAY_S / block_s, _MOSTLY * (stop - start)):
            continue
        same = found and start - found[-1][1] <= _JOIN_S / block_s and abs(found[-1][2] - speed) <= 2.0 * _NEAR * top
        if same:
            found[-1] = (found[-1][0], stop, found[-1][2])
        elif float(np.ptp(told)) >= _ASKED * top:
            found.append((start, stop, speed))
    gain = _share(y, asked, alive, 2.0 * tolerance) if found else None
    if gain is not None:
        return [_weak(one, gain, (int(found[0][0]), int(found[-1][1])), block_s)]
    stand = np.logical_and.reduce(
        [np.abs(np.nan_to_num(j.wheel.blocks.mean)) < _STANDS * top for w, j in judged.items() if w != wheel]
    )
    out = []
    for span in found:
        part = slice(span[0], span[1])
        near = np.abs(y[part] - span[2]) <= 2.0 * _NEAR * top
        rests, leaves = (np.count_nonzero(x) * block_s for x in (stand[part] & near, ~near & alive[part]))
        others_near = [  # one that goes elsewhere in between, or keeps another speed next, is not held there
            f for f in found if abs(f[2] - span[2]) > 4.0 * _NEAR * top and _gap(f, span) * block_s <= _JOIN_S
        ]
        shifted = rests >= _RESTS_S and (leaves >= _LEAVES_S or bool(others_near))
        out.append(_shifted(one, span, block_s) if shifted else _finding(one, span, asked, block_s))
    return out


def _with(y: Array, other: Array, tolerance: Array) -> bool:
    """Whether another wheel, which follows, does the same: both go as the machine does. Of shape (k,) each [m/s]."""
    return bool(np.mean(np.abs(y - other) < _TWICE * tolerance) > _MOST_OF)


def _share(y: Array, asked: Array, alive: Flags, tolerance: Array) -> float | None:
    """One share of what is asked that a speed is all through the mission [1], also where that changes; None where none is. Of shape (b,) each."""
    told = np.abs(np.gradient(np.nan_to_num(asked))) < tolerance
    use = alive & np.isfinite(asked) & told & (np.abs(asked) > _ASKED * float(np.nanmax(np.abs(asked))))
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return None
    gain = float(np.median(y[use] / asked[use]))
    explained = float(np.mean(np.abs(y - gain * asked)[use] < np.maximum(tolerance, _IN_SHARE * np.abs(asked))[use]))
    return gain if 0.1 < gain < _WEAK and explained > _MOST_OF else None


def _weak(one: Judged, gain: float, span: tuple[int, int], block_s: float) -> Finding:
    """A finding of a wheel that makes one share of its command, of which a stretch at one speed is a part; in blocks `span`."""
    start, stop = span
    width, loss = int(one.wheel.blocks.start[1]), 1.0 - gain
    text = (
        f"{one.data.name} is {gain:.2f} × what its command makes the other {{wheels}} do, at whatever speed, also in the "
        f"{(stop - start) * block_s:.1f} s in which it keeps one. A weak drive and a wrong sensor look the same."
    )
    rest = Hypothesis("none", State.HEALTHY.value, 1.0 - _P)
    side, mode = Side.SENSOR_OR_ACTUATOR, FaultMode.INEFFICIENT
    return Finding(
        start=start * width,
        stop=min(stop * width, one.data.y.size),
        side=side,
        mode=mode,
        probability=_P,
        hypotheses=(Hypothesis(side.value, mode.value, _P), rest),
        epsilon=Epsilon(loss, max(loss - 0.1, 0.0), min(loss + 0.1, 1.0)),
        sat=None,
        evidence=(text,),
        tier=Tier.RESPONSE,
    )


def _gap(one: tuple[int, int, float], other: tuple[int, int, float]) -> int:
    """Blocks between two spans; negative where they overlap."""
    return max(one[0], other[0]) - min(one[1], other[1])


def _shifted(one: Judged, span: tuple[int, int, float], block_s: float) -> Finding:
    """A finding of a wheel that reads one speed, part of it while all others stand; in blocks `span`."""
    start, stop, speed = span
    width = int(one.wheel.blocks.start[1])
    text = (
        f"{one.data.name} stays at {plain(speed, 2)} {{speed_unit}} for {lasting((stop - start) * block_s, 1)}, part of it while all other {{wheels}} stand, and goes at other speeds as well: its "
        "readings are shifted, or it turns freely."
    )
    side, mode = Side.SENSOR_OR_ACTUATOR, FaultMode.OUTSIDE_TABLE
    rest = Hypothesis("none", State.HEALTHY.value, 1.0 - _P)
    return Finding(
        start=start * width,
        stop=min(stop * width, one.data.y.size),
        side=side,
        mode=mode,
        probability=_P,
        hypotheses=(Hypothesis(side.value, mode.value, _P), rest),
        epsilon=None,
        sat=None,
        evidence=(text,),
        tier=Tier.RESPONSE,
    )


def _astray(blocks: Blocks, top: float) -> Flags:
    """Blocks that are far off what the command makes of the wheel; `top` is the top speed [m/s]."""
    off = np.nan_to_num(np.abs(blocks.mean - np.clip(blocks.mean, blocks.low, blocks.high)))
    return np.asarray(off > np.maximum(_FAR * np.nan_to_num(blocks.noise), _OFF * top))


def _level(y: Array, alive: Flags, tolerance: float, least: int) -> list[tuple[int, int, float]]:
    """Stretches of at least so many blocks in which a speed stays within a tolerance of its median: first block, last one + 1, and that median."""
    if y.size < least:
        return []
    near = np.ptp(sliding_window_view(y, least), axis=1) <= 2.0 * tolerance
    near &= sliding_window_view(alive, least).all(axis=1)
    out: list[tuple[int, int, float]] = []
    stop = 0
    for start in np.flatnonzero(near).tolist():
        if start < stop:
            continue
        speed = float(np.median(y[start : start + least]))
        left = np.flatnonzero(~alive[start + least :] | (np.abs(y[start + least :] - speed) > tolerance))
        stop = start + least + int(left[0]) if left.size else y.size
        out.append((start, stop, float(np.median(y[start:stop]))))
    return out


def _finding(one: Judged, span: tuple[int, int, float], asked: Array, block_s: float) -> Finding:
    start, stop, speed = span
    told = asked[start:stop][np.isfinite(asked[start:stop])]
    width = int(one.wheel.blocks.start[1])
    text = (
        f"{one.data.name} stays at {plain(speed, 2)} {{speed_unit}} for {lasting((stop - start) * block_s, 1)}, shaking as a turning {{wheel}} does, while its command "
        f"asks for {plain(told.min(), 2)} to {plain(told.max(), 2)} {{speed_unit}}."
    )
    return Finding(
        start=start * width,
        stop=min(stop * width, one.data.y.size),
        side=Side.ACTUATOR,
        mode=FaultMode.STUCK,
        probability=_P,
        hypotheses=(
            Hypothesis(Side.ACTUATOR.value, FaultMode.STUCK.value, _P),
            Hypothesis(Side.SENSOR.value, FaultMode.OUTSIDE_TABLE.value, _SENSOR),
            Hypothesis("none", State.HEALTHY.value, 1.0 - _P - _SENSOR),
        ),
        epsilon=Epsilon(1.0, 1.0, 1.0),
        sat=None,
        evidence=(text,),
        tier=Tier.RESPONSE,
    )
