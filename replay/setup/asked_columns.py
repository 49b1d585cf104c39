"""Columns of a log that ask a wheel for something without a word for what: ``left_cmd``, ``RIGHT SETPOINT``.

They may be speeds, duties or counts, which no name tells: a draft asks for them rather than says that the log has no commands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from replay.log.raw_log import Channel
from replay.machine.config import Machine
from replay.machine.quantities import SI_UNITS
from replay.machine.signal_table import quantity_of
from replay.signals.name_parts import wheel_of
from replay.signals.name_words import english, role, tokens
from replay.signals.unsure_kinds import Open, Unsure
from replay.signals.unsure_names import unsure


def asked_columns(channels: Mapping[str, Channel], machine: Machine, used: Sequence[str]) -> dict[str, str]:
    """Names of such columns and symbols by wheel, the first one of each; empty where none is there.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        Of the log, by name.
    machine : Machine
        Its wheels.
    used : Sequence[str]
        Channels that are taken for other signals.
    """
    out: dict[str, str] = {}
    for name, channel in channels.items():
        wheel = wheel_of(channel.field or channel.name, machine)
        if wheel is not None and name not in used and role(english(tokens(channel.field or channel.name))) == "ref":
            out.setdefault(wheel, name)
    return out


def motions_of_body(channels: Mapping[str, Channel], machine: Machine) -> list[Unsure]:
    """Columns that may be the machine's commands, or what it does: ``linear_x``, ``angular_z``.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        Of the log, by name.
    machine : Machine
        Its wheels.
    """
    return [one for one in unsure(channels, machine) if one.kind is Open.MOTION]


def where_commands_are(
    only: str,
    columns: Mapping[str, str],
    commands: Mapping[str, tuple[str, str]],
    motions: Sequence[Unsure],
) -> str:
    """The question where the commands are, with columns that may hold them.

    Parameters
    ----------
    only : str
        What can be judged without commands, in words.
    columns : Mapping[str, str]
        Of `asked_columns`.
    commands : Mapping[str, tuple[str, str]]
        Of `possible_commands`.
    motions : Sequence[Unsure]
        Of `motions_of_body`.
    """
    if commands:
        topic, lines = next(iter(commands.items()))
        may = f"{topic} may hold them" if len(commands) == 1 else f"one of {', '.join(commands)} may hold them"
        return f"where are the commands? None is known by its name, so {only}. {may}; if {topic} does, write {' and '.join(lines)}."
    if motions:
        written = " and ".join(
            f'"{one.signal}" = {{ column = "{one.origin.label}", unit = "{one.origin.unit or SI_UNITS[quantity_of(one.signal)]}" }}'
            for one in motions
        )
        return (
            f"where are the commands? None is known by its name, so {only}. {', '.join(one.origin.label for one in motions)} may be what "
            f"the machine is told to do, or what it does: if they are its commands, write {written}; the measured speed of the machine is odom.v."
        )
    if not columns:
        return f"where are the commands? None is in the log, so {only}; record /cmd_vel, or name its topic."
    wheel, name = next(iter(columns.items()))
    several = len(columns) > 1
    said = "ask for something, but their names do" if several else "asks for something, but its name does"
    return (
        f"where are the commands? None is known by its name, so {only}. {', '.join(columns.values())} {said} not say what; if "
        f"{'they are' if several else 'it is'} the commanded speed of a wheel, write "
        f'"wheel.{wheel}.v_ref" = {{ column = "{name}", unit = "…" }}{" and so on" if several else ""}.'
    )
