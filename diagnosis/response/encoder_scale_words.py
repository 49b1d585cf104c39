"""What is said of one side that goes otherwise than it reads, and of the factor on an encoder that a log does not show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.response.body import BodySpeed
from diagnosis.response.disputed import unproved
from diagnosis.response.encoder_scale import LENGTH_S, Scaled, Sought
from diagnosis.response.machine import Judged
from diagnosis.response.turning import Turning
from diagnosis.results.assessment import Assessment
from diagnosis.results.said import Said, Stated

_END_S = 1.0
_UNTOLD = (
    "No command says what the {wheels} should do, so that a factor on one side, or on all of them, from the start of the log to its end would not show, "
    "and is not assessed: log the commands (cmd.v, cmd.omega)."
)
_BY_BODY = (
    "No command says what the {wheels} should do, so that a factor on one side, or on all of them, from the start of the log to its end shows by the "
    "measured speed of the machine alone, and a small one is not assessed: log the commands (cmd.v, cmd.omega)."
)
_LEAST_BLOCKS = 80  # of a speed of the body, by which a lasting factor shows
OTHERWISE = "it keeps to its command, but the gyro shows that one side of the machine goes otherwise than it reads"


def told(sought: Sought, turning: Turning | None, block_s: float) -> tuple[Said, ...]:
    """What is said of each time in which one side goes otherwise than it reads; `block_s` is the length of a block [s]."""
    if turning is None:
        return ()
    return tuple(_said(x, turning.sides, turning.yaw.size, block_s) for x in sought.found)


def by_the_gyro(
    wheel: str,
    sensor: Assessment,
    judged: Mapping[str, Judged],
    sought: Sought,
    turning: Turning | None,
    open_to: Sequence[slice] = (),
    bodies: Sequence[BodySpeed] = (),
) -> Assessment:
    """A wheel's sensor with nothing healthy said of it while the gyro contradicts its side, and with what does not show.

    Parameters
    ----------
    wheel : str
        The wheel.
    sensor : Assessment
        Of it.
    judged : Mapping[str, Judged]
        All wheels.
    sought : Sought
        What was looked for.
    turning : Turning or None
        How the body is turned.
    open_to : Sequence[slice]
        Steps in which the gyro may be wrong, or either side.
    bodies : Sequence[BodySpeed]
        The body's speed by its own sensors.
    """
    one = judged[wheel]
    which = ""
    if turning is not None and any(w not in turning.sides for w in judged):
        which = f" of {'an unsteered' if wheel in turning.sides else 'a steered'} {{wheel}}"
    if turning is not None and wheel not in turning.sides:  # a steered one, of which the yaw rate says nothing
        sought, turning = Sought(), None
    if not one.response.answered:
        untold = not np.isfinite(one.data.asked).any() and len(judged) > 1
        seen = any(b.name != "odometry" and np.count_nonzero(np.isfinite(b.speed)) >= _LEAST_BLOCKS for b in bodies)
        return replace(sensor, hidden=_BY_BODY if seen else _UNTOLD) if untold else sensor
    several = len(judged) > 1
    if (several or one.view is None) and not one.data.unpowered:  # which closes no loop
        by_turns = several and not (turning is None and one.yaw is not None)
        ground = any(b.name != "odometry" for b in bodies)
        sensor = replace(
            sensor, hidden=unseen(sought, which, several=by_turns, ground=ground, gyro=one.yaw is not None)
        )
    blocks = one.wheel.blocks.start
    width, where = int(blocks[1]) if blocks.size > 1 else 1, np.zeros(one.data.y.size, np.bool_)
    for x in sought.found:
        if turning is not None and (not x.told or turning.sides[wheel] == x.side):
            where[x.start * width : x.stop * width] = True
    for steps in open_to:
        where[steps] = True
    return unproved(sensor, where, OTHERWISE)


def _said(one: Scaled, sides: Mapping[str, float], size: int, block_s: float) -> Said:
    """What is said of a time in which one side goes otherwise than it reads.

    Parameters
    ----------
    one : Scaled
        The time.
    sides : Mapping[str, float]
        Of each wheel, as in `Turning`.
    size : int
        Blocks of the mission.
    block_s : float
        Length of a block [s].
    """
    this, other = (_named([w for w, side in sides.items() if side == s]) for s in (one.side, -one.side))
    at_start, at_end = one.start * block_s < _END_S, (size - one.stop) * block_s < _END_S
    when = Stated.of(0.0 if at_start else one.start * block_s, math.inf if at_end else one.stop * block_s)
    start = "From the start" if at_start else f"From {when.start} s"
    stop = "the end of the log" if at_end else f"{when.stop} s"
    likely = f"{this} went {one.factor:.2f} × as fast as read"
    which = f"{likely} ({other} is less likely)" if one.told else f"{likely}, or {other} {one.rival:.2f} ×"
    text = (
        f"{start} to {stop} the gyro shows that the machine turned as if {which}, while the {{wheels}} kept to their commands: an encoder that is "
        "scaled inside the speed loop that it closes, another tyre, or one that slips; no factor or constant of the gyro itself does that."
    )
    return Said(text, () if at_start and at_end else (when.span,))


def _named(wheels: Sequence[str]) -> str:
    """The wheels of a side: with several of them the share is that of their mean."""
    return wheels[0] if len(wheels) == 1 else f"the mean of {', '.join(wheels[:-1])} and {wheels[-1]}"


def unseen(sought: Sought, which: str = "", *, several: bool, ground: bool = False, gyro: bool = False) -> str:
    """What does not show of an encoder that closes its drive's loop, a sentence.

    Parameters
    ----------
    sought : Sought
        What was looked for.
    which : str
        Of which wheels' encoders it is said, to follow *an encoder*; empty for all of a machine.
    several : bool
        Whether there are several drives, whose difference may turn the machine, without a yaw rate that says otherwise.
    ground : bool
        Whether a speed over ground is in the log, and does not show it.
    gyro : bool
        Whether a yaw rate is in the log, and does not show it.
    """
    of = f"A factor on an encoder{which} that closes its own drive's speed loop"
    if np.isfinite(sought.smallest):
        x = sought.smallest
        return (
            f"{of} shows by the gyro alone, on one {{wheel}} from {x:.2f} × (or {1.0 / x:.2f} ×) on where it lasts {LENGTH_S:.0f} s of driving; a smaller "
            "one is not assessed."
        )
    count = "let each {wheel} make ten turns by its encoder, and count them"
    does = count if ground else "log a speed over ground (gnss.speed)"
    by_turns = "record a longer drive with turns both ways, as the yaw rate of this one does not settle it"
    does = (by_turns if gyro else "log a yaw rate (imu.yaw_rate) with turns both ways") if several else does
    return f"{of} would not show in this log, and is not assessed: {does}."
