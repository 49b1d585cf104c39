"""Channels whose names tell a wheel or axle, and leave open what exactly they hold: a person must say it.

``left_actual`` beside ``left_target``, ``vl_ref``, ``left_ticks``, ``left_wheel_position``, ``HubSpeedAct2`` beside ``HubSpeedAct``,
``/steer_FL/angle2`` beside ``/steer_FL/state`` with an angle, ``/wheel_FL/swash.position``, ``fVentil_Soll_VL [mA]``. A diagnosis takes none of them by itself and says why; a draft of a machine file takes them with a question.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from replay.log.raw_log import Channel
from replay.machine.config import Machine
from replay.machine.quantities import UNITS
from replay.machine.units import known_unit
from replay.signals.candidate import source_of
from replay.signals.name_parts import (
    axle_words,
    first_indices,
    is_place,
    is_steering,
    position,
    side_of,
    speaks_of_no_wheel,
    wheel_of,
)
from replay.signals.name_words import ASKING, MEASURED, english, role, tokens
from replay.signals.named_units import bare_name, unit_by_end
from replay.signals.rules import MESSAGE_TYPES, candidates
from replay.signals.second_ones import number_of, seconds
from replay.signals.symbol_rules import valve_current
from replay.signals.unsure_body import angles, openings, over_ground, places, steering_letters, turns
from replay.signals.unsure_kinds import Open, Unsure
from replay.signals.unsure_openings import unsure_opening

#: Begin of the note that names such channels.
NOT_USED = "not used, for their names leave open what they hold"


_LETTERS = frozenset(("v", "w", "n", "omega"))  # that stand for a speed
_THINGS = frozenset(("wheel", "rad", "motor", "drive", "hub", "side", "track", "joint", "chain", "crawler", "st", "fb"))
_STEPS = frozenset(
    (*("encoder", "encoders", "enc", "tick", "ticks", "count", "counts", "pulse", "pulses", "impulse", "impulses", "inkremente"),
     *("inkr", "geber", "drehgeber", "codeur", "impulsions")),
)  # fmt: skip
_PLACES = frozenset(("position", "pos", "positions"))
_MORE = frozenset(("raw", "total", "abs", "value", "state", "states", "name"))  # that change nothing
#: Words of the two motions of a machine, of which each name needs one of the first and may have those of the second.
_MOTIONS = {
    "cmd.v": (frozenset(("linear", "lin")), frozenset(("x", "v", "speed", "velocity", "vel"))),
    "cmd.omega": (frozenset(("angular",)), frozenset(("z", "w", "omega", "speed", "velocity", "vel", "rate"))),
}
_OF_BODY = frozenset(("twist", "base", "robot"))
_SIDED = re.compile(
    r"(?<![A-Za-z])([vwn])([lr])(?![a-z])", re.IGNORECASE
)  # vl: v of the left one, of a machine with two
_LAST_NUMBER = re.compile(r"[ _.-]?(\d+)(?=\D*$)")


def unsure(channels: Mapping[str, Channel], machine: Machine) -> list[Unsure]:
    """Channels that may hold signals, but whose names leave something open; of messages, second sensors and openings.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        Of one log, by name.
    machine : Machine
        Its wheels and axles.
    """
    bare = {name: c for name, c in channels.items() if not c.topic}
    sure: dict[str, set[str]] = defaultdict(set)
    for c in candidates(bare, machine):
        sure[c.origin.label].add(c.signal)
    out, first_number = [*_seconds(bare, machine, sure)], first_indices(bare)
    others = {name: c for name, c in bare.items() if name not in sure}
    names = {name: said for name, c in others.items() if (said := _said(c, machine)) is not None}
    measured = {signal for signals in sure.values() for signal in signals}
    for name, channel in others.items():
        current = valve_current(channel, machine, first_number)
        if current is not None:
            out.append(Unsure(current, source_of(channel, "1"), Open.CURRENT))
        elif name in names:
            out += _one(channel, names[name], names, measured)
        else:
            out += _motion(channel, measured)
    out += _of_any_log(channels, machine)
    wheels_of_drivers = {name: c for name, c in channels.items() if c.topic}
    out = [*_numbered(out), *_beside_others(bare, wheels_of_drivers, machine, sure)]
    first: dict[str, Unsure] = {}
    for found in out:
        first.setdefault(found.signal, found)
    return [*first.values()]


def _beside_others(
    columns: Mapping[str, Channel], fields: Mapping[str, Channel], machine: Machine, sure: Mapping[str, set[str]]
) -> Iterator[Unsure]:
    """Yield what other columns, or their values, make of names of a letter or two, of places, turns and steering."""
    named = {signal: label for label, signals in sure.items() for signal in signals}
    free = {name: c for name, c in columns.items() if name not in sure}
    for signal, name, unit in turns(free):
        yield Unsure(signal, source_of(free[name], unit), Open.YAW_RATE)
    for signal, name, unit in over_ground(free):
        if signal not in named:
            yield Unsure(signal, source_of(free[name], unit), Open.GROUND)
    for signal, name in places(free):
        yield Unsure(signal, source_of(free[name], "deg"), Open.PLACE)
    every = {**free, **fields}
    for signal, name, unit, drivers in angles(every, machine, steering_letters({**columns, **fields})):
        yield Unsure(signal, source_of(every[name], unit), Open.DRIVERS if drivers else Open.ANGLE)
    for signal, name, unit in openings(columns, machine, named):
        if name in free:
            yield Unsure(signal, source_of(free[name], unit), Open.OPENING)


def _numbered(found: Sequence[Unsure]) -> list[Unsure]:
    """The same, but of two that may be one speed and differ by a number in their names the later one as a second sensor."""
    alike: dict[tuple[str, str], list[Unsure]] = defaultdict(list)
    for one in found:
        if one.kind is Open.SPEED and one.signal.endswith(".v"):
            alike[one.signal, re.sub(r"(?<=[A-Za-z])\d+", "", one.origin.label)].append(one)
    out = {id(one): one for one in found}
    for ones in alike.values():
        if len(ones) == 2:
            first, second = sorted(ones, key=lambda one: one.origin.label != re.sub(r"\d+", "", one.origin.label))
            if first.origin.label == re.sub(r"\d+", "", first.origin.label):
                out[id(second)] = replace(
                    second, signal=f"{second.signal}_true", kind=Open.SECOND, beside=first.origin.label
                )
    return [*out.values()]


def _of_any_log(channels: Mapping[str, Channel], machine: Machine) -> Iterator[Unsure]:
    """Yield second measurements that a number tells from the first, and what valves and pumps may be told, of messages as of tables."""
    every = [*candidates(channels, machine)]
    twice = seconds(every)
    for signal, (first, second) in twice.items():
        yield Unsure(f"{signal}_true", second.origin, Open.SECOND, first.origin.label)
    taken = {c.origin.label for c in every}
    for channel in channels.values():
        origin = source_of(channel)
        if origin.label in taken or (channel.topic and channel.type_name.rpartition("/")[2] in MESSAGE_TYPES):
            continue
        told = unsure_opening(channel, machine)
        if told is not None:
            yield Unsure(told[0], replace(origin, unit=told[1]), Open.OPENING)


@dataclass(frozen=True)
class _Said:
    """Words of a name without its place, the wheel of which it speaks, and whether it asks or measures."""

    words: frozenset[str]
    wheel: str
    asked: str
    unit: str


def _said(channel: Channel, machine: Machine) -> _Said | None:
    """What a name says of a wheel; None where it speaks of none, of steering, or of what is no wheel."""
    name, stated = bare_name(channel.name)
    name = _SIDED.sub(r"\1_\2", name) if {side_of(w) for w in machine.wheels} == {"left", "right"} else name
    wheel = wheel_of(name, machine)
    if wheel is None or is_steering(name) or speaks_of_no_wheel(name):
        return None
    named = {w.lower() for w in machine.wheels}
    parts = re.split(r"[./]", name)
    roles = ASKING | MEASURED
    told = [
        p for p in parts[:-1] if position(p) != (None, None) or {*tokens(p)} & named or {*english(tokens(p))} <= roles
    ]
    told += parts[-1:]
    words = {w for p in told for w in english(tokens(p)) if not is_place(w) and not w.isdigit()} - {"l", "r"} - named
    words -= axle_words(name)
    unit = stated or (channel.unit if channel.unit and known_unit(channel.unit) else "")
    by_end = "" if unit else unit_by_end(name, doubtful=True)
    return _Said(frozenset(words - {*english(tokens(by_end))}), wheel, role([*words]), unit or by_end)


def _one(channel: Channel, said: _Said, names: Mapping[str, _Said], measured: set[str]) -> Iterator[Unsure]:
    """Yield what a channel of a wheel may be, of which no rule for names is sure."""
    v, quantity, words = f"wheel.{said.wheel}.v", _quantity(said.unit), said.words - _THINGS - _MORE - MEASURED
    if words and words <= _STEPS | _PLACES and words & _STEPS and quantity in ("", "angle"):
        if said.unit or _whole(channel):
            yield Unsure(v, source_of(channel, "", derivative=True), Open.COUNTS)
        else:  # steps have no fractions: somebody has made a distance of them
            yield Unsure(v, source_of(channel, "m", derivative=True), Open.POSITION)
    elif words and words <= _PLACES and said.words & _THINGS and quantity in ("", "angle", "length"):
        signal = f"{v}_position" if v in measured else v
        yield Unsure(signal, source_of(channel, said.unit or "rad", derivative=True), Open.POSITION)
    elif said.asked != "both" and words <= _LETTERS | ASKING and quantity in ("", "speed", "rotation"):
        pair = _pair(said, names)
        if words & _LETTERS or pair:
            yield Unsure(f"{v}_ref" if said.asked == "ref" else v, source_of(channel, said.unit), Open.SPEED, pair)


def _whole(channel: Channel) -> bool:
    """Whether every reading is a whole number, as steps are."""
    known = channel.values[np.isfinite(channel.values)] if channel.values.dtype.kind == "f" else channel.values[:0]
    return bool((known == np.rint(known)).all())


def _motion(channel: Channel, sure: set[str]) -> Iterator[Unsure]:
    """Yield the command that a column of the whole machine may be, where no other one is one: ``linear_x``, ``angular_z``."""
    name, stated = bare_name(channel.name)
    unit = stated or unit_by_end(name)
    words = {*english(tokens(name))} - {*english(tokens(unit_by_end(name)))} - _OF_BODY
    for signal, (named, more) in _MOTIONS.items():
        fits = _quantity(unit) in ("", "speed" if signal == "cmd.v" else "rotation")
        if signal not in sure and fits and words & named and words <= named | more:
            yield Unsure(signal, source_of(channel, unit), Open.MOTION)


def _pair(said: _Said, names: Mapping[str, _Said]) -> str:
    """Name that says the same of the same wheel, but asks where this one does not; empty where there is none."""
    plain = said.words - ASKING - MEASURED
    for name, other in names.items():
        alike = other.wheel == said.wheel and other.words - ASKING - MEASURED == plain
        if alike and other.asked != "both" and (other.asked == "ref") != (said.asked == "ref"):
            return name
    return ""


def _quantity(unit: str) -> str:
    """Quantity of a unit; empty where none is stated, or as a count is; another word where it is not known."""
    known = known_unit(unit)
    return UNITS[known][0] if known is not None else "" if {*tokens(unit)} <= _STEPS and "/" not in unit else "?"


def _seconds(channels: Mapping[str, Channel], machine: Machine, sure: Mapping[str, set[str]]) -> Iterator[Unsure]:
    """Yield columns that are called like a measured speed or angle, but for a number at their end."""
    alike: dict[str, list[str]] = defaultdict(list)
    for name in channels:
        alike[_LAST_NUMBER.sub("", bare_name(name)[0])].append(name)
    for names in alike.values():
        of = {
            name: {s for s in sure.get(name, ()) if re.fullmatch(r"wheel\..*\.v|steer\..*\.phi", s)} for name in names
        }
        signals = set().union(*of.values())
        others = [n for n in names if sure.get(n, set()) - signals]
        if len(names) == 2 and len(signals) == 1 and not others:
            (signal,) = signals
            first = min((n for n in names if of[n]), key=number_of)
            second = next(n for n in names if n != first)
            yield Unsure(f"{signal}_true", source_of(channels[second], _unit(channels[second])), Open.SECOND, first)


def _unit(channel: Channel) -> str:
    return (channel.unit or "") or bare_name(channel.name)[1] or unit_by_end(channel.name)
