"""Arrays of joint states that a driver does not fill in: 0 of every joint from start to end, while another array moves.

Taken for measurements they would be a position that contradicts its own speed, or a drive without effort.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping

from replay.arrays.blocks import blocks
from replay.log.raw_log import Channel

_ARRAY = re.compile(r"(position|velocity|effort)\[[^\[\]]+\]$")
_LEAST = 50  # samples


def unfilled(channels: Mapping[str, Channel]) -> dict[str, str]:
    """Channels of such arrays by their names, each with its topic and array in words (``/joint_states position``).

    An array of a topic in which nothing moves is none: the machine may have stood still.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        Of one log.
    """
    arrays: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for name, channel in channels.items():
        found = _ARRAY.search(channel.field)
        if found is not None and channel.type_name.rpartition("/")[2] == "JointState":
            arrays[channel.topic][found[1]].append(name)
    out: dict[str, str] = {}
    for topic, kinds in arrays.items():
        still = {k for k, names in kinds.items() if not any(_moves(channels[n]) for n in names)}
        if still and len(still) < len(kinds):
            out |= {n: f"{topic} {k}" for k in sorted(still) for n in kinds[k]}
    return out


def unfilled_note(array: str) -> str:
    """What is said of such an array."""
    return f"{array}: 0 of every joint throughout, though the joints move: its driver does not fill it in, and it is not used"


def _moves(channel: Channel) -> bool:
    """Whether a channel ever differs from 0; of one that is too short that is not known."""
    values = channel.values
    return values.size < _LEAST or any(bool((values[part] != 0).any()) for part in blocks(values.size))
