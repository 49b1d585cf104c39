"""Parts of messages that a driver does not fill in, which stay from start to end while others of their topic move.

They are an array of joint states that is 0, or no number, of every joint, and an odometry's pose or twist that keeps its first value. Taken for measurements they would be a position that contradicts its own speed, or a drive without effort.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from replay.arrays.blocks import blocks
from replay.log.raw_log import Channel

_ARRAY = re.compile(r"(position|velocity|effort)\[[^\[\]]+\]$")
_ODOMETRY = re.compile(r"(pose|twist)\.\1\.\w+\.[xyzw]$")
_LEAST = 50  # samples


def unfilled(channels: Mapping[str, Channel]) -> dict[str, str]:
    """Channels of such parts by their names, each with its topic and part in words (``/joint_states position``, ``/odom pose``).

    A part of a topic in which nothing moves is none: the machine may have stood still.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        Of one log.
    """
    arrays: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for name, channel in channels.items():
        pattern = {"JointState": _ARRAY, "Odometry": _ODOMETRY}.get(channel.type_name.rpartition("/")[2])
        found = None if pattern is None else pattern.match(channel.field)
        if found is not None:
            arrays[channel.topic][found[1]].append(name)
    out: dict[str, str] = {}
    for topic, kinds in arrays.items():
        still = {k for k, names in kinds.items() if not any(_moves(channels[n]) for n in names)}
        if still and len(still) < len(kinds):
            out |= {n: f"{topic} {k}" for k in sorted(still) for n in kinds[k]}
    return out


def unfilled_note(array: str) -> str:
    """What is said of such a part."""
    body = array.endswith((" pose", " twist"))
    what = (
        "the same throughout, though the machine moves"
        if body
        else "0 or no number of every joint throughout, though the joints move"
    )
    return f"{array}: {what}: its driver does not fill it in, and it is not used"


def _moves(channel: Channel) -> bool:
    """Whether a number of a channel ever differs from 0, that of an odometry from its first one; of one that is too short that is not known."""
    values = channel.values
    if values.size < _LEAST:
        return True
    rest = values[0] if _ODOMETRY.match(channel.field) else 0
    return any(bool(((values[part] != rest) & ~np.isnan(values[part])).any()) for part in blocks(values.size))
