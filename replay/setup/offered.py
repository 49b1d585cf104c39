"""Lines of [signals] for channels that no name tells for certain: commands and positions that stand beside a signal that is used."""

from __future__ import annotations

import re

from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_text import signal_line
from replay.setup.all_channels import ChannelRow
from replay.signals.name_words import ASKING, MEASURED, tokens

_FULL = 1.05  # what a share of full command reaches, with its noise
_SHARES = re.compile(r"duty|pwm|valve|spool|throttle|effort")
_BESIDE = {"phi_ref": "u", "phi": "u_applied"}  # of a steering joint: what its effort may be, by what its position is


def offered_line(machine: Machine, row: ChannelRow) -> str:
    """The line that takes a channel as a command or its carrying out; empty where nothing suggests one, or the signal is taken.

    The effort of a steering joint is its command where its position is the commanded one, and what is carried out where it is the measured one; an
    array of duties that measures repeats the order of the array that asks. Both are shares of full command where they stay within 1.05.

    Parameters
    ----------
    machine : Machine
        As drafted.
    row : ChannelRow
        A channel that is not used.
    """
    if row.low is None or row.high is None or max(-row.low, row.high) > _FULL:
        return ""
    name = _of_a_joint(machine, row) or _of_an_array(machine, row)
    if not name or name in machine.signals:
        return ""
    return signal_line(name, SignalSource(topic=row.topic, field=row.field, unit="1"))


def _of_a_joint(machine: Machine, row: ChannelRow) -> str:
    joint = re.match(r"effort\[(.+)\]$", row.field)
    if joint is None:
        return ""
    for name, source in machine.signals.items():
        group, part, leaf = (*name.split("."), "", "")[:3]
        if (
            group == "steer"
            and leaf in _BESIDE
            and (source.topic, source.field) == (row.topic, f"position[{joint[1]}]")
        ):
            return f"steer.{part}.{_BESIDE[leaf]}"
    return ""


def _of_an_array(machine: Machine, row: ChannelRow) -> str:
    said = {*tokens(row.topic)}
    if (
        not re.match(r"data\[\d+\]$", row.field)
        or not _SHARES.search(row.topic.lower())
        or not MEASURED & said
        or ASKING & said
    ):
        return ""
    for name, source in machine.signals.items():
        if (
            re.fullmatch(r"(wheel|steer)\.[^.]+\.u", name)
            and source.field == row.field
            and _SHARES.search((source.topic or "").lower())
        ):
            return f"{name}_applied"
    return ""
