"""A gyro beside the yaw rate of odometry, where nothing else measures how a machine turns: a log with no wheels in it, or one of them.

The two belong together as most of the mission shows. Where they part for seconds, the commanded yaw rate says which of them still does as
it is told; but a speed loop that closes over a wrong encoder, and wheels that slip, let odometry do as it is told while the machine turns
otherwise, so that only a heading of odometry that leaves command and gyro is proved to be odometry's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.spells import deviations_of
from diagnosis.results.said import Said, Stated
from diagnosis.results.sizes import turn
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_BLOCKS = 60  # of turning that shows how the two belong together
_TURNS = 0.25  # of the usual yaw rate
_ALIKE = 0.3  # of the usual yaw rate: a larger median misfit is no relation
_LIES = 0.5, 2.0  # gain of one by the other
_OFF, _SHARE = 5.0, 0.4  # usual misfits, and of the yaw rate: less is no deviation
_GAP, _LEAST_S, _MOST_OF = 3, 3.0, 0.8  # sound blocks in a deviation; its length; of its blocks that deviate
_LAG_S, _SMOOTH = 1.5, 3  # of a command; blocks
_NEAR, _FAR = 2.0, 4.0  # usual misfits beside the command
_SLOW_S = 1.0  # between readings of a heading: rarer ones tell no rate


class Contradiction(NamedTuple):
    """Blocks [start, stop) in which gyro and odometry contradict each other, what is said of it, and whether odometry may be the one that is wrong."""

    start: int
    stop: int
    said: Said
    odometry: bool = True


def odometry_rate(timeline: Timeline, width: int) -> Array | None:
    """Yaw rate by the heading of odometry, in blocks of `width` steps [rad/s]; None where no heading is read often enough. Shape (b,)."""
    yaw = timeline.get("odom.yaw")
    if yaw is None:
        return None
    at = np.flatnonzero(timeline.fresh["odom.yaw"] & np.isfinite(yaw))
    if at.size < _LEAST_BLOCKS or np.median(np.diff(at)) * timeline.dt > _SLOW_S:
        return None
    blocks = -(-timeline.size // width)
    edges = np.arange(blocks + 1, dtype=np.float64) * width
    heading = np.interp(edges, at.astype(np.float64), np.unwrap(yaw[at]))
    rate = np.diff(heading) / (width * timeline.dt)
    rate[(edges[1:] <= at[0]) | (edges[:-1] >= at[-1])] = np.nan
    return np.asarray(rate)


def contradictions(gyro: Array, odometry: Array, asked: Array | None, block_s: float) -> tuple[Contradiction, ...]:
    """Times in which a gyro and the heading of odometry contradict each other.

    Parameters
    ----------
    gyro, odometry : Array, shape (b,)
        Yaw rates [rad/s]; NaN where unknown.
    asked : Array or None, shape (b,)
        Commanded yaw rate [rad/s].
    block_s : float
        Length of a block [s].
    """
    about = _related(_smooth(odometry), _smooth(gyro))
    if about is None:
        return ()
    made, measured, noise, usual = about
    off = np.abs(measured - made)
    far = off > np.maximum(_OFF * noise, _SHARE * np.maximum(np.abs(made), np.abs(measured)))
    far &= off > _TURNS * usual
    shows = far | (np.abs(made) > _TURNS * usual)
    out: list[Contradiction] = []
    for start, stop in deviations_of(far, shows, _GAP):
        part = slice(start, stop)
        if (stop - start) * block_s >= _LEAST_S and np.mean(far[part][shows[part]]) >= _MOST_OF:
            which = _which(made, measured, asked, part, block_s)
            out.append(Contradiction(start, stop, _told(made[part], measured[part], (start, stop), which, block_s)))
    return tuple(out)


def agree(one: Array, other: Array, wheels: Array, part: slice) -> bool:
    """Whether two measured yaw rates agree in a time in which the wheels make another one; all of shape (b,) [rad/s]."""
    known = np.isfinite(one[part]) & np.isfinite(other[part]) & np.isfinite(wheels[part])
    apart, beside = np.abs(one - other)[part][known], np.abs(one - wheels)[part][known]
    return bool(known.any() and np.mean(apart) < 0.5 * np.mean(beside))


def _smooth(x: Array) -> Array:
    known = np.isfinite(x)
    kernel = np.ones(_SMOOTH)
    count = np.convolve(known, kernel, mode="same")
    total = np.convolve(np.where(known, x, 0.0), kernel, mode="same")
    return np.where(known, total / np.maximum(count, 1.0), np.nan)


def _related(x: Array, y: Array) -> tuple[Array, Array, float, float] | None:
    """x as y shows it in most of a mission, y without its constant, usual misfit and usual size [rad/s]; None where they are not alike."""
    known = np.isfinite(x) & np.isfinite(y)
    if np.count_nonzero(known) < _LEAST_BLOCKS:
        return None
    usual = float(np.quantile(np.abs(x[known]), 0.9))
    turning = known & (np.abs(x) > _TURNS * usual)
    if usual <= 0.0 or np.count_nonzero(turning) < _LEAST_BLOCKS:
        return None
    resting = known & ~turning
    offset = float(np.median((y - np.where(np.abs(x) > 0.0, x, 0.0))[resting])) if resting.sum() > _SMOOTH else 0.0
    gain = float(np.median((y - offset)[turning] / x[turning]))
    if not _LIES[0] < abs(gain) < _LIES[1]:
        return None
    off = np.abs(y - offset - gain * x)
    misfit = float(np.median(off[turning]))
    if misfit > _ALIKE * usual:
        return None
    return gain * x, y - offset, 1.5 * misfit, abs(gain) * usual


def _which(made: Array, measured: Array, asked: Array | None, part: slice, block_s: float) -> str:
    """Which of the two still does as it is told in a deviation: ``odometry``, ``gyro``, or none where that is not clear."""
    if asked is None:
        return ""
    misfits = [_beside_command(x, asked, part, block_s) for x in (made, measured)]
    if any(not np.isfinite(m) for m in misfits):
        return ""
    odometry, gyro = misfits
    if odometry < _NEAR and gyro > _FAR:
        return "odometry"
    return "gyro" if gyro < _NEAR and odometry > _FAR else ""


def _beside_command(rate: Array, asked: Array, part: slice, block_s: float) -> float:
    """Median misfit of a yaw rate beside its command in a time, in usual ones; infinite where the two have nothing to do with each other."""
    best, found = np.inf, np.inf
    for late in range(round(_LAG_S / block_s) + 1):
        told = np.r_[np.full(late, np.nan), asked[: asked.size - late]]
        other = np.isfinite(told) & np.isfinite(rate)
        inside = np.zeros(rate.size, bool)
        inside[part] = True
        other, here = other & ~inside, other & inside
        power = float(told[other] @ told[other])
        if np.count_nonzero(other) < _LEAST_BLOCKS or power <= 0.0 or not here.any():
            continue
        gain = float(told[other] @ rate[other]) / power
        off = np.abs(rate - gain * told)
        usual = float(np.quantile(off[other], 0.75))
        if usual < best and usual < _ALIKE * float(np.quantile(np.abs(rate[other]), 0.9)):
            best, found = usual, float(np.median(off[here])) / max(usual, 1e-9)
    return found


def _told(made: Array, measured: Array, span: tuple[int, int], which: str, block_s: float) -> Said:
    """What is said of a contradiction."""
    known = np.isfinite(made) & np.isfinite(measured)
    gyro, odometry = (float(np.median(np.abs(x[known]))) for x in (measured, made))
    when = Stated.of(span[0] * block_s, span[1] * block_s)
    head = (
        f"From {when.start} to {when.stop} s the gyro (imu.yaw_rate) and the heading of odometry (odom.yaw) contradict each "
        f"other: {turn(gyro)} and {turn(odometry)} (medians), where they otherwise agree"
    )
    tail = {
        "gyro": ". The gyro does as the command has it turn: the heading of odometry is wrong, or an encoder that it is made of.",
        "odometry": ". Odometry does as the command has it turn: the gyro is wrong, or the wheels slip, or an encoder is wrong over which the speed "
        "loop closes; wheel speeds (/joint_states) would tell them apart.",
        "": ". Which of them is wrong cannot be told: a {wheel} that slips, or an encoder, turns the heading of odometry, too.",
    }[which]
    return Said(head + tail, (when.span,))
