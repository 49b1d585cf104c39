"""Whether the speed of an odometry is along the machine, as it should be, or along an axis of the ground, as some simulators give it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from replay.log.raw_log import Channel

Array = NDArray[np.float64]

_PIECE_S = 0.2  # over which positions are compared
_LEAST = 8  # pieces in which the two would differ
_MOVES, _DIFFER = 0.2, 0.15  # of the top speed
_BETTER = 0.5  # times the misfit of the other
_POSE, _TURN = "pose.pose.position.", "pose.pose.orientation."


def along_the_ground(speed: Channel, channels: Mapping[str, Channel]) -> bool:
    """Whether a forward speed is that along the first axis of its positions, rather than along their heading.

    Parameters
    ----------
    speed : Channel
        ``twist.twist.linear.x`` of a topic.
    channels : Mapping[str, Channel]
        All channels; positions and orientation are looked for in the same topic.
    """
    own = {c.field: c for c in channels.values() if speed.topic and c.topic == speed.topic}
    names = [f"{_POSE}{a}" for a in "xy"] + [f"{_TURN}{a}" for a in "xyzw"]
    found = [own[n].values for n in names if n in own]
    if len(found) < len(names) or any(v.size != speed.values.size for v in found) or speed.values.size < 2:
        return False
    x, y, a, b, c, d = (np.asarray(v, np.float64) for v in found)
    t = (speed.stamps - speed.stamps[0]) * 1e-9
    step = float(np.median(np.diff(t)))
    width = max(1, round(_PIECE_S / step)) if step > 0.0 else 0
    if width == 0 or x.size <= _LEAST * width:
        return False
    ends = np.arange(0, x.size, width)
    yaw = np.arctan2(2.0 * (d * c + a * b), 1.0 - 2.0 * (b**2 + c**2))
    heading = yaw[(ends[:-1] + ends[1:]) // 2]
    said = np.add.reduceat(np.asarray(speed.values, np.float64), ends)[: ends.size - 1] / width
    with np.errstate(divide="ignore", invalid="ignore"):
        along, across = (np.diff(v[ends]) / np.diff(t[ends]) for v in (x, y))
    forward = along * np.cos(heading) + across * np.sin(heading)
    known = np.isfinite(forward) & np.isfinite(said)
    if not known.any():
        return False
    top = float(np.quantile(np.hypot(along, across)[known], 0.95))
    use = known & (np.hypot(along, across) > _MOVES * top) & (np.abs(forward - along) > _DIFFER * top)
    if top <= 0.0 or np.count_nonzero(use) < _LEAST:
        return False
    misfits = [float(np.median(np.abs(said - v)[use])) for v in (along, forward)]
    return misfits[0] < _BETTER * misfits[1]
