"""A wheel that stands although it is told to go and another one goes, where no answer to commands was found: the mission is too short for one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import shifted
from diagnosis.channels.standstill import STILL
from diagnosis.response.machine import Judged
from diagnosis.response.tracking import estimate_lag
from diagnosis.response.wheel import sensor_finding
from diagnosis.results.assessment import Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import lasting
from replay.arrays.runs import runs_of
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ANSWER_S = 1.0  # for which it was told to go already: drives take as long to answer
_LEAST_S, _FOLLOWS_S = 2.0, 2.0  # of standing so, and of following at other times
_OTHERS_MOVE, _FOLLOWS = 0.7, 0.7  # of these times, in which another wheel moves, and in which it does itself
_GAIN = (0.5, 2.0)  # of what it is told, at those times
_LEAST_TOLD, _MUCH = (
    0.1,
    0.5,
)  # quantile of what it is told when it moves, and share of that: less may be too little to set it going
_OF_OTHERS = 0.4  # of what another wheel does meanwhile: by a wrong track, one about which the machine turns is told to move a little
_SAME, _OTHER = (
    0.3,
    0.6,
)  # of what it is told: what the body's motion leaves it at most where it stands, and at least where it does not
_P = 0.85
_SENSOR = {
    True: 0.1,
    False: 0.85,
    None: 0.5,
}  # share of the sensor where the body's motion says that it stands, that it does not, and nothing


def stays_though_told(one: Judged, driving_speed: float) -> list[Finding]:
    """Findings of a wheel without motion while its command and another wheel go on, which follows its command at other times.

    Whether the drive or its sensor is at fault is told by the other views of its speed, where there are any.

    Parameters
    ----------
    one : Judged
        The wheel, of which no answer to its command is known.
    driving_speed : float
        Speed from which a wheel drives [m/s].
    """
    dt, y = one.wheel.dt, one.data.y
    if not one.others or not np.isfinite(one.data.asked).any() or not np.isfinite(y).any():
        return []
    asked = shifted(one.data.asked, estimate_lag(y, one.data.asked, dt))
    told = _held(np.nan_to_num(np.abs(asked)) > driving_speed, round(_ANSWER_S / dt))
    known, size = np.isfinite(y), np.abs(np.nan_to_num(y))
    fastest = np.max([np.abs(np.nan_to_num(o)) for o in one.others], axis=0)
    others = fastest > driving_speed
    moves = told & known & (size > driving_speed)
    out: list[Finding] = []
    for start, stop in runs_of(known & (size <= STILL * driving_speed)):
        there = slice(start, stop)
        if (stop - start) * dt < _LEAST_S or np.count_nonzero(told[there] & others[there]) * dt < _LEAST_S:
            continue
        if float(np.mean(others[there][told[there]])) < _OTHERS_MOVE:
            continue
        rest = told & known
        rest[there] = False
        if not _follows(rest, moves, y, asked, dt):
            continue
        usual = float(np.median(np.abs(asked[there][told[there]])))
        if usual < _OF_OTHERS * float(np.median(fastest[there][told[there]])):
            continue
        if usual < _MUCH * float(np.quantile(np.abs(asked[moves]), _LEAST_TOLD)):
            continue
        goes = start + np.flatnonzero(np.abs(np.nan_to_num(asked[there])) > driving_speed)
        first, stop = int(goes[0]), int(goes[-1]) + 1
        stands = _by_the_body(one, slice(first, stop), usual)
        text = (
            f"{one.data.name} reads no motion for {lasting((stop - first) * dt, 1)} while it is told to go at {plain(usual, 2)} {{speed_unit}} (median) and another {{wheel}} "
            "goes on; at other times it follows its command."
        )
        seen = {
            True: (
                "The other {wheels} and the measured motion of the body say that it stands, too: the {valve} does not do what it is told.",
            ),
            False: (
                "The other {wheels} and the measured motion of the body say that it moves: its sensor gives nothing.",
            ),
            None: (),
        }[stands]
        out.append(
            sensor_finding(
                first, stop, FaultMode.NO_SIGNAL, _P, Epsilon(1.0, 1.0, 1.0), None, (text, *seen), _SENSOR[stands]
            )
        )
    return out


def _held(flags: Flags, steps: int) -> Flags:
    """Where flags have been set for so many steps."""
    number = np.arange(flags.size)
    last = np.maximum.accumulate(np.where(flags, -1, number))
    return np.asarray(flags & (number - last > steps))


def _follows(rest: Flags, moves: Flags, y: Array, asked: Array, dt: float) -> bool:
    """Whether a wheel does about what it is told in the times `rest`, shape (n,)."""
    then = rest & moves
    if np.count_nonzero(then) * dt < _FOLLOWS_S or np.count_nonzero(then) < _FOLLOWS * np.count_nonzero(rest):
        return False
    return bool(_GAIN[0] < float(np.median(y[then] / asked[then])) < _GAIN[1])


def _by_the_body(one: Judged, steps: slice, usual: float) -> bool | None:
    """Whether the wheel stands by other views of its speed; None where they do not tell. `usual` in m/s."""
    blocks = one.wheel.blocks
    if one.speed is None or blocks.start.size < 2:
        return None
    width = int(blocks.start[1])
    seen = one.speed[steps.start // width : -(-steps.stop // width)]
    seen = np.abs(seen[np.isfinite(seen)])
    if not seen.size:
        return None
    share = float(np.median(seen)) / usual
    return True if share < _SAME else False if share > _OTHER else None
