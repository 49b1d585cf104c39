"""What a channel shows by its readings alone: wild ones, none, and a fall to 0 that no wheel makes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples
from diagnosis.response.wheel import SENSOR_SHARE, Wheel, sensor_finding
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import lasting
from replay.arrays.runs import runs_of
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

SPIKE_GAP_S, LEAST_SPIKES = 10.0, 3
_BEYOND, _LEAP = (
    3.0,
    100.0,
)  # times the largest speed of the driving; m/s² there and back: no wheel does that, be it once
_TURNS, _SAME_LEAP, _SAME_TURN, _MOSTLY = 4, 0.01, 0.1, 0.7  # wild readings; shares of leap and turn; of the turns
_IMPOSSIBLE_P = 0.97, 0.99  # that the sensor is at fault, by one such reading and by two
_LOST_DRIVING_S = 1.0
_DEAD_S, _OTHERS_MOVE = 2.0, 0.7  # of one reading of 0, and of that time in which another wheel turns
_TURNING, _SUDDEN = (
    2.0,
    3.0,
)  # driving speeds before it; times what readings change by while the wheel turns (99 of 100)
_LEAST_TURNING = 100  # readings of a turning wheel
_BREAKS_OFF_P = 0.85, 0.93  # that something is wrong, by one end of it that comes at once and by both


def spikes_of(wheel: Wheel, y: Array, driving_speed: float, others: Sequence[Array] = ()) -> list[Finding]:
    """Findings of wild readings that come again and again, or that no wheel can make; none where those of the other wheels do, too.

    Where all wheels have some, as taps of a joystick read ten times a second make them, those count that are far beyond all else that is read, unless other
    wheels read as much.

    Parameters
    ----------
    wheel : Wheel
        The wheel.
    y : Array, shape (n,)
        Its readings, the wild ones too [m/s].
    driving_speed : float
        Speed from which a wheel drives [m/s].
    others : Sequence[Array], each of shape (n,)
        Readings of the other wheels [m/s].
    """
    wild = wheel.samples.wild if wheel.spiky else _far(wheel, y, driving_speed, others)
    if not wild.any() or once_a_turn(wheel.samples, y, wheel.dt):
        return []
    places = wheel.samples.step[wild]
    beyond = _impossible(wheel, y, driving_speed)
    groups = np.split(places, np.flatnonzero(np.diff(places) * wheel.dt > SPIKE_GAP_S) + 1) if places.size else []
    out = []
    for group in groups:
        few = int(np.count_nonzero(np.isin(group, beyond)))
        if group.size >= LEAST_SPIKES:
            p, why = 0.97, "and no machine moves like that"
        elif few:
            p, why = _IMPOSSIBLE_P[few - 1], "further than any wheel can be set going and stopped between two readings"
        else:
            continue
        number = "1 reading" if group.size == 1 else f"{group.size} readings"
        text = (
            f"Spikes: {number} of {wheel.name} within {(group[-1] - group[0] + 1) * wheel.dt:.1f} s "
            f"{'is' if group.size == 1 else 'are'} far off those before and after, {why}."
        )
        out.append(sensor_finding(int(group[0]), int(group[-1]) + 1, FaultMode.NOISY, p, None, None, (text,)))
    return out


def _far(wheel: Wheel, y: Array, driving_speed: float, others: Sequence[Array]) -> Flags:
    """Wild readings far beyond all others of a wheel, shape (m,); none where another wheel reads as much."""
    samples, value = wheel.samples, np.abs(y[wheel.samples.step])
    least = _BEYOND * max(float(np.nanmax(np.abs(samples.value), initial=0.0)), driving_speed)
    if any(bool((np.abs(np.nan_to_num(x)) > least).any()) for x in others):
        return np.zeros_like(samples.wild)
    return np.asarray(samples.wild & (value > least))


def once_a_turn(samples: Samples, y: Array, dt: float) -> bool:
    """Whether wild readings are those of an angle that starts anew after each turn, and whose derivative is logged.

    All leap by the same amount against the motion, and from one to the next the wheel goes as far. `y` of shape (n,) [m/s], `dt` in s.
    """
    at = np.flatnonzero(samples.wild)
    if at.size < _TURNS or at[0] == 0:
        return False
    value = y[samples.step]
    near = np.interp(at, np.flatnonzero(~samples.wild), value[~samples.wild])
    leap = value[at] - near
    way = np.cumsum(np.where(samples.wild, 0.0, np.nan_to_num(samples.value)) * np.diff(samples.step, prepend=0) * dt)
    turn = np.abs(np.diff(way[at]))
    usual = float(np.median(turn))
    same = float(np.std(leap)) < _SAME_LEAP * abs(float(np.mean(leap)))
    return bool(same and (leap * near <= 0.0).all() and np.mean(np.abs(turn - usual) < _SAME_TURN * usual) >= _MOSTLY)


def _impossible(wheel: Wheel, y: Array, driving_speed: float) -> NDArray[np.intp]:
    """Steps of wild readings far beyond all others, reached and left by an acceleration that no wheel has; shape (k,)."""
    samples = wheel.samples
    value = y[samples.step]
    top = float(np.nanmax(np.abs(samples.value), initial=0.0)) if np.isfinite(samples.value).any() else 0.0
    pause = np.diff(samples.step) * wheel.dt
    change = np.abs(np.diff(value)) / pause
    leap = np.minimum(np.r_[np.inf, change], np.r_[change, np.inf])
    least = _BEYOND * max(top, driving_speed)
    return np.asarray(samples.step[samples.wild & (np.abs(value) > least) & (leap > _LEAP)])


def lost_of(wheel: Wheel, lost: Sequence[tuple[int, int]], driving: Flags) -> list[Finding]:
    """Findings of a channel from which nothing came while others were recorded, where the wheel had to move.

    Parameters
    ----------
    wheel : Wheel
        The wheel.
    lost : Sequence[tuple[int, int]]
        Steps [start, stop) in which nothing came.
    driving : Flags, shape (n,)
        Steps in which it moves, or is to.
    """
    out = []
    for first, last in lost:
        if np.count_nonzero(driving[first:last]) * wheel.dt < _LOST_DRIVING_S:
            continue
        text = f"Nothing came from {wheel.name} for {lasting((last - first) * wheel.dt, 1)}, while what is recorded with it went on."
        out.append(
            sensor_finding(first, last, FaultMode.NO_SIGNAL, SENSOR_SHARE, Epsilon(1.0, 1.0, 1.0), None, (text,))
        )
    return out


def broken_off(
    wheel: Wheel, others: Sequence[Array], driving_speed: float, asked: Array | None = None
) -> list[Finding]:
    """Findings of a speed that falls to 0 from one reading to the next, and stays there, while another wheel goes on turning.

    For wheels of which no command says what they should do: a drive takes its time to stop. A lone one is held against its
    command, from which no answer was found; it must come back at once as well, and must not stop like that where it is told to.

    Parameters
    ----------
    wheel : Wheel
        The wheel.
    others : Sequence[Array], each of shape (n,)
        Readings of the other wheels [m/s].
    driving_speed : float
        Speed from which a wheel drives [m/s].
    asked : Array or None, shape (n,)
        Commanded speed of the only drive [m/s].
    """
    step, value = wheel.samples.step, np.nan_to_num(wheel.samples.value)
    size = np.abs(np.nan_to_num(wheel.samples.change))
    spans = [(a, b) for a, b in runs_of(value == 0.0) if a > 0]
    goes_on = others if asked is None else (asked,)
    if asked is not None:
        spans = [
            (a, b) for a, b in spans if b < step.size and _turn((asked,), int(step[a]), int(step[b]), driving_speed)
        ]
    ends = np.r_[[a for a, _ in spans], [b for _, b in spans if b < value.size]].astype(np.intp)
    turning = size[((value != 0.0) if asked is None else (size > 0.0)) & ~np.isin(np.arange(value.size), ends)]
    if not goes_on or turning.size < _LEAST_TURNING:
        return []
    least = max(_SUDDEN * float(np.quantile(turning, 0.99)), _TURNING * driving_speed)
    out = []
    for a, b in spans:
        first, last = int(step[a]), int(step[b]) if b < step.size else int(step[-1]) + 1
        at_once = [size[a] > least, b < size.size and size[b] > least]
        if (last - first) * wheel.dt < _DEAD_S or not any(at_once) or not (asked is None or all(at_once)):
            continue
        if not _turn(goes_on, first, last, driving_speed):
            continue
        text = (
            f"{wheel.name} {'fell to 0' if at_once[0] else 'rose from 0'} from one reading to the next and read 0 for "
            f"{(last - first) * wheel.dt:.1f} s while "
            + (
                "another {wheel} went on turning; nothing says what it should have done."
                if asked is None
                else "its command went on, and was back at its speed from one reading to the next: it takes longer to stop or start."
            )
        )
        p = _BREAKS_OFF_P[all(at_once)]
        sensor = SENSOR_SHARE if wheel.sharp else 0.5
        out.append(sensor_finding(first, last, FaultMode.NO_SIGNAL, p, Epsilon(1.0, 1.0, 1.0), None, (text,), sensor))
    return out


def _turn(speeds: Sequence[Array], first: int, last: int, driving_speed: float) -> bool:
    """Whether the largest of some speeds, each of shape (n,) [m/s], is one of driving in most of the steps [first, last)."""
    moves = np.max([np.abs(np.nan_to_num(y[first:last])) for y in speeds], axis=0) > driving_speed
    return bool(np.mean(moves) >= _OTHERS_MOVE)
