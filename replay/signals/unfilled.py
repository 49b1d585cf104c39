"""Parts of messages that a driver does not fill in, which stay from start to end while others of their topic move.

They are an array of joint states that is 0, or no number, of every joint, and an odometry's pose or twist that keeps its first value. Taken for measurements they would be a position that contradicts its own speed, or a drive without effort.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.log.raw_log import Channel

Test = Callable[[NDArray[Any]], NDArray[np.bool_]]

_ARRAY = re.compile(r"(position|velocity|effort)\[[^\[\]]+\]$")
_ODOMETRY = re.compile(r"(pose|twist)\.\1\.\w+\.[xyzw]$")
_LEAST = 50  # samples


def unfilled(channels: Mapping[str, Channel]) -> dict[str, str]:
    """Channels of such parts by their names, each with its topic and part in words (``/joint_states position``, ``/odom pose``).

    A part of a topic in which nothing moves is none: the machine may have stood still. Nor is an array of some joints' numbers and none of the
    others': not every joint has each of its quantities.

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
        still = {k for k, names in kinds.items() if _unfilled([channels[n] for n in names])}
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


def _unfilled(part: Sequence[Channel]) -> bool:
    """Whether all channels of a part keep 0, those of an odometry their first value, or none of them has a number; not of those that are too short."""
    if any(channel.values.size < _LEAST for channel in part):
        return False
    return all(_keeps(c, np.isnan) for c in part) or all(_keeps(c, _as_at_first(c)) for c in part)


def _as_at_first(channel: Channel) -> Test:
    rest = channel.values[0] if _ODOMETRY.match(channel.field) else 0
    return lambda values: np.asarray(values == rest)


def _keeps(channel: Channel, test: Test) -> bool:
    return all(bool(test(channel.values[part]).all()) for part in blocks(channel.values.size))
