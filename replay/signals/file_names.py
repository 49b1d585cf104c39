"""Tables of one mission in which each wheel has a file of its own: ``wheel_FL.csv`` and ``wheel_FR.csv`` with the same columns.

The name of such a file belongs to the names of its columns: ``wheel_FL.speed`` is found as a column of that name would be.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath

from replay.log.file_types import split_ending
from replay.log.raw_log import Channel, RawLog
from replay.log.source_options import SignalSource
from replay.signals.name_parts import is_place
from replay.signals.name_words import tokens

_MOSTLY = 0.5


def named_channels(logs: Sequence[RawLog]) -> list[Mapping[str, Channel]]:
    """Channels of each log by the names that say what they hold: those of a wheel's own table with its file's name before them.

    A table is one where its file's name has words of a place, and most of its columns are in another file too.

    Parameters
    ----------
    logs : Sequence[RawLog]
        The files of one mission.
    """
    count = Counter(name for log in logs for name, channel in log.channels.items() if not channel.topic)
    out: list[Mapping[str, Channel]] = []
    for log in logs:
        stem = split_ending(PurePath(log.source).name)[0]
        own = [name for name, channel in log.channels.items() if not channel.topic]
        shared = sum(count[name] > 1 for name in own)
        if own and shared > _MOSTLY * len(own) and any(is_place(word) for word in tokens(stem)):
            named = {f"{stem}.{name}": replace(c, name=f"{stem}.{name}") for name, c in log.channels.items()}
            out.append(named)
        else:
            out.append(log.channels)
    return out


def in_its_file(origin: SignalSource, log: RawLog) -> SignalSource:
    """A source found under a name of `named_channels`, as the file has it."""
    file = PurePath(log.source).name
    name, prefix = origin.label, split_ending(file)[0] + "."
    if origin.topic is not None or name in log.channels or not name.startswith(prefix):
        return origin
    return replace(origin, symbol=None, column=name.removeprefix(prefix), source=file)
