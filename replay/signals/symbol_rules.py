"""Rules for symbols of PLCs and columns of tables, whose names alone say what they hold, in English, German or French."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from replay.log.raw_log import Channel
from replay.machine.config import Machine
from replay.machine.quantities import UNITS
from replay.machine.signal_table import CANONICAL, Scope
from replay.machine.units import known_unit
from replay.signals.candidate import Candidate, source_of
from replay.signals.name_parts import axle_of, index_of, is_drive, is_place, is_steering, wheel_of, without_place
from replay.signals.name_words import ASKING, MEASURED, english, role, tokens
from replay.signals.named_units import bare_name, unit_by_word

_EFFORT_UNITS = (("A", r"current|(^|_)amp"), ("V", r"volt"), ("%", r"duty|pwm"))
# Fields of messages that are no measured values.
_NO_VALUE = re.compile(r"(^|[._])(header|stamp|seq|covariance|timestamp|time|layout)([._\[]|$)")
_VALVE = re.compile(r"valve|spool")
_DRIVERS = re.compile(r"(^|_)(steer(ing)?|str)_(wheel|rad)(_|$)")  # that the driver turns
_ELECTRIC = frozenset(("current", "voltage"))
# What is derived from a signal, or bounds it, is not the signal.
_NO_SIGNAL = re.compile(
    r"^(err(or)?|diff|rel(ative)?|max(imum)?|ecart|erreur|seuil)$|fehler|abweichung|limit|grenz|schwelle"
)
# Words beside which a single unit of speed or angle says what a part's channel holds: nIst, VL, Rad_VL.soll.
_PLAIN = (
    ASKING
    | MEASURED
    | frozenset(
        (
            *(
                "n",
                "v",
                "w",
                "omega",
                "rad",
                "wheel",
                "motor",
                "drive",
                "axle",
                "steer",
                "speed",
                "rpm",
                "angle",
                "fahr",
                "hydraulik",
                "phi",
            ),
        )
    )
)
_ANGLES = frozenset(("deg", "grad"))  # units
#: Words of the forward speed by an odometry: ``odom_v``, ``odom_linear_x``, ``speed_odom``; each of such a name, and one of those that say a speed.
_ODOMETRY, _FORWARD = (
    frozenset(("odom", "odometry")),
    frozenset(("v", "vx", "speed", "velocity", "vel", "linear", "lin")),
)
_OF_ODOMETRY = _ODOMETRY | _FORWARD | MEASURED | {"twist", "x", "forward", "fwd", "body", "base"}
_TURN = frozenset(("dreh", "drehung", "turn", "turning", "rotation", "rot", "wende"))
_OMEGA = frozenset(("w", "omega", "wz", "yaw", "yaw_rate", "angular", "turn"))  # that say so beside a word that asks
_RATES = frozenset(("speed", "velocity", "vel", "rate", "z"))
_STATES = frozenset(("state", "states", "status", "feedback", "telemetry"))  # topics of what is measured
_UNITS_ALONE = frozenset(
    ("deg", "degrees", "radians")
)  # fields that say no more than their unit: /steer_rear/angle.deg
_OWN = frozenset(("n", "v", "rad", "wheel"))  # that say it even alone: ``Rad VL [1/min]``
_VEHICLE = frozenset(("fahr", "fahren", "fahrt", "fahrzeug", "fzg", "vehicle", "machine", "maschine"))
# Words beside which an asked speed is that of the whole machine.
_WHOLE = ASKING | _VEHICLE | frozenset(
    (*("speed", "velocity", "vel", "v", "r", "f", "lr", "x", "lin", "linear", "longitudinal"),
     *("engin", "vehicule", "body", "robot", "chassis", "forward", "joystick")),
)  # fmt: skip


def _named(scope: Scope) -> tuple[tuple[str, str], ...]:
    """Signals of a scope with the patterns that name them, in the order in which these are tried."""
    found = [(e.named, e.leaf if scope else e.kind) for e in CANONICAL if e.scope == scope and e.named is not None]
    return tuple((signal, named.pattern) for named, signal in sorted(found, key=lambda pair: pair[0].order))


_PART_PATTERNS = {scope: _named(scope) for scope in (Scope.WHEEL, Scope.AXLE)}
_MACHINE_PATTERNS = _named(Scope.MACHINE)


def by_symbol(channel: Channel, machine: Machine, first: Mapping[str, int]) -> Iterator[Candidate]:
    """Yield what a symbol or column may be by its name: of a wheel, of a steering axle, or of the whole machine.

    Parameters
    ----------
    channel : Channel
        Of a table, a PLC, or a message of a type that is not a common one.
    machine : Machine
        Its wheels and axles.
    first : Mapping[str, int]
        Smallest number of each numbered family of names.
    """
    said = _said(channel, machine)
    if said is None:
        return
    if wheel_of(said.bare, machine) is None:  # R_speed_cmd is of the right wheel alone
        yield from _by_word(channel, said.text, said.parts[-1], said.unit, len(machine.wheels) > 1)
    leaf = _leaf(said)
    if leaf is None:
        return
    part, rank = _part(channel, said, machine, first)
    if part is not None:
        signal = f"{'steer' if said.steering else 'wheel'}.{part}.{leaf}"
        how = {9: "by its number", 10: "as the only wheel"}.get(rank, "by its name")
        unit = said.unit or (_effort_unit("_".join(said.last)) if leaf == "effort" else "")
        yield Candidate(signal, source_of(channel, unit), rank, f"{channel.name} {how}")


def valve_current(channel: Channel, machine: Machine, first: Mapping[str, int]) -> str | None:
    """Canonical name of the command that a valve's current or voltage stands for, by its words or unit; None where a channel is none.

    What a name says that it measures is a command's as well, where no other one is logged: `is_measured` tells them apart.

    A current opens its valve, by a scale that no name tells: it is no opening until somebody says which current is a full one.

    Parameters
    ----------
    channel : Channel
        Of a table, a PLC, or a message of a type that is not a common one.
    machine : Machine
        Its wheels and axles.
    first : Mapping[str, int]
        Smallest number of each numbered family of names.
    """
    said = _said(channel, machine)
    if (
        said is None
        or not _is_valve_current(said)
        or said.asked == "both"
        or any(_NO_SIGNAL.search(w) for w in said.last)
    ):
        return None
    part, _ = _part(channel, said, machine, first)
    return None if part is None else f"{'steer' if said.steering else 'wheel'}.{part}.u"


def is_measured(channel: Channel, machine: Machine) -> bool:
    """Whether a channel's name says that it measures, rather than asks for, what it speaks of."""
    said = _said(channel, machine)
    return said is not None and said.asked == "act"


@dataclass(frozen=True)
class _Said:
    """What a name says: words of all its parts, those of the last part that says more than a place, what it asks or measures."""

    name: str
    bare: str
    unit: str
    parts: tuple[list[str], ...]
    text: str
    last: list[str]
    asked: str
    steering: bool
    valve: bool


def _said(channel: Channel, machine: Machine) -> _Said | None:
    """Words of a channel's name; None where its field holds no measured value."""
    if channel.topic and _NO_VALUE.search(channel.field):
        return None
    name, stated = (_message_name(channel), "") if channel.topic else bare_name(channel.name)
    inner = re.search(r"\[([A-Za-z_][\w.\[\]]*)\]$", name)
    name = inner.group(1) if inner and channel.topic else name
    bare = re.sub(r"\[\d+\]", "", name)
    parts = tuple(english(tokens(part)) for part in re.split(r"[./]", bare))
    text = "_".join(word for part in parts for word in part)
    last, topic = _last_words(parts, machine), {*english(tokens(channel.topic))}
    asked = role([*last, *(w for part in parts if {*part} <= ASKING | {"st"} for w in part), *(topic & ASKING)])
    valve = _VALVE.search("_".join(last)) or (_VALVE.search(text) and not re.search(r"motor|drive", text))
    return _Said(
        name, bare, _stated_unit(channel, stated) or unit_by_word(name, without_place(name)), parts, text, last,
        asked or ("act" if topic & _STATES else ""), is_steering(bare), valve is not None,
    )  # fmt: skip


def _part(channel: Channel, said: _Said, machine: Machine, first: Mapping[str, int]) -> tuple[str | None, int]:
    """Wheel or axle by its name, by its number, or as the only one, with the rank of that."""
    part = axle_of(said.bare, machine) if said.steering else wheel_of(said.bare, machine)
    numbered = index_of(said.name)
    if part is None and numbered is not None and (said.steering or is_drive(said.bare) or said.valve):
        order = machine.axles if said.steering else machine.wheels
        at = numbered[1] - min(first.get(_family(channel, numbered[0]), first.get(numbered[0], numbered[1])), 1)
        return (order[at] if 0 <= at < len(order) else None), 9
    own = not channel.topic or channel.field in ("data", "value") or is_drive(said.bare)
    alone = own and len(machine.wheels) == 1 and not re.search(r"gnss|gps|imu|odom", said.text)
    if part is None and alone and not said.steering:
        return machine.wheels[0], 10
    return part, 8


def _message_name(channel: Channel) -> str:
    """Topic and field, without a last word that says nothing: of ``/wheel_speeds.data[0]`` ``/wheel_speeds[0]``."""
    return re.sub(r"\.(data|values?)(?=\[\d+\]$|$)", "", channel.name)


def _last_words(parts: Sequence[Sequence[str]], machine: Machine) -> list[str]:
    """Words of the last part of a symbol that says more than a place: of ``fbWheel.fVelocity.FL`` velocity."""
    wheels = {w.lower() for w in machine.wheels if len(w) > 1}
    for part in reversed(parts):
        words = [w for w in part if not is_place(w) and w not in wheels]
        if any(not w.isdigit() and w not in _UNITS_ALONE for w in words):
            return words
    return []


def _stated_unit(channel: Channel, stated: str) -> str:
    """Unit that the file states; not the name of a part that stands in brackets, ``velocity[front_left]``."""
    inside = re.search(r"[\[(]([^\[\]()]*)[\])]\s*$", channel.name)
    part = inside is not None and not stated and channel.unit == inside[1].strip() and not channel.topic
    return ("" if part else channel.unit or "") or stated


def _leaf(said: _Said) -> str | None:
    """Last word of the canonical name, by the words of a symbol, or by a unit where these say no quantity."""
    last, asked = said.last, said.asked
    if asked == "both" or any(_NO_SIGNAL.search(w) for w in last):
        return None
    patterns = _PART_PATTERNS[Scope.AXLE if said.steering else Scope.WHEEL]
    leaf = next((leaf for leaf, pattern in patterns if re.search(pattern, "_".join(last))), None)
    if leaf in ("phi", "phi_ref") and _DRIVERS.search(said.text):  # which is geared to the axle
        return None
    if _is_valve_current(said):  # no effort of its wheel, and no opening
        return None
    quantity = UNITS[known] if (known := known_unit(said.unit)) is not None else ("", 1.0)
    words = {w for w in last if not w.isdigit()} - _ANGLES
    if leaf is None and words and words <= _PLAIN and (asked or _OWN & words):
        leaf = "phi" if said.steering and quantity[0] == "angle" else None
        leaf = "v" if not said.steering and quantity[0] in ("speed", "rotation") else leaf
        leaf = {"ref": "u", "act": "u_applied"}.get(asked) if said.valve and quantity[0] == "fraction" else leaf
    if leaf in ("v", "phi") and asked == "ref":
        return f"{leaf}_ref"
    return leaf


def _is_valve_current(said: _Said) -> bool:
    return said.valve and (bool(_ELECTRIC & {*said.last}) or known_unit(said.unit) in ("A", "mA", "V"))


def _effort_unit(word: str) -> str:
    """Unit of an effort by its name; empty where that does not tell."""
    return next((unit for unit, pattern in _EFFORT_UNITS if re.search(pattern, word)), "")


def _family(channel: Channel, template: str) -> str:
    found = index_of(channel.name)
    return found[0] if found is not None else template


def _is_speed(last: Sequence[str], unit: str) -> bool:
    """Whether words speak of a speed: by name, or as ``v``, a joystick or nothing but a setpoint in a unit of speed."""
    speed = (known := known_unit(unit)) is not None and UNITS[known][0] == "speed"
    says = {"v", "joystick"} & {*last} or ({*last} <= ASKING | _VEHICLE and ASKING & {*last})
    return bool({"speed", "velocity", "vel", "lin", "linear"} & {*last}) or (speed and bool(says))


def _is_yaw_rate(last: Sequence[str], unit: str, alone: bool) -> bool:
    """Whether words speak of turning and nothing else: ``Drehvorgabe [°/s]``, ``w_cmd``; the latter where ω is not of a single wheel."""
    bare = {*last} - ASKING - {*tokens(unit)} - _VEHICLE
    if known_unit(unit) in ("rad/s", "deg/s") and bare & _TURN and bare <= _TURN:
        return True
    return alone and known_unit(unit) in (None, "rad/s", "deg/s") and bool(bare & _OMEGA) and bare <= _OMEGA | _RATES


def _is_odometry(words: Sequence[str]) -> bool:
    """Whether words speak of the forward speed by an odometry: of no position, other axis, or turn behind whatever machine's it is."""
    first = next((i for i, w in enumerate(words) if w in _ODOMETRY), None)
    if first is None or not {*words[first:]} <= _OF_ODOMETRY:
        return False
    return bool(_FORWARD & {*words[first:]}) or (bool(_FORWARD & {*words}) and {*words} <= _OF_ODOMETRY)


def _by_word(channel: Channel, text: str, last: Sequence[str], unit: str, turns_alone: bool) -> Iterator[Candidate]:
    """Yield signals of the whole machine by words of their symbol; `turns_alone`: ω asked for is the machine's, not of its only wheel."""
    if re.search(r"wheel|steer|valve|axle", text) or any(is_place(w) and w != "fwd" for w in last):
        return
    signal = next((signal for signal, pattern in _MACHINE_PATTERNS if re.search(pattern, text)), None)
    if signal == "gnss.speed" and (ASKING & {*last} or any(_NO_SIGNAL.search(w) for w in text.split("_"))):
        return
    asks, named = role(last), True
    turning = {*last} - MEASURED - {*tokens(unit)}  # yaw_rate_deg_s
    turns = "yaw_rate" in last or (turning == {"yaw", "rate"} and not re.search(r"odom|est", text))
    turns |= asks == "ref" and _is_yaw_rate(last, unit, turns_alone)
    if turns and asks != "both":
        named = signal is not None or asks == "ref"
        signal = "cmd.omega" if asks == "ref" else signal or "imu.yaw_rate"
    elif (
        signal is None
        and (asks == "ref" or "joystick" in last)
        and _is_speed(last, unit)
        and {*last} - {*tokens(unit)} <= _WHOLE
    ):
        signal = "cmd.v"
    elif signal is None and asks in ("", "act") and _is_odometry([w for w in text.split("_") if w not in tokens(unit)]):
        signal = "odom.v"
    if signal is not None:
        yield Candidate(signal, source_of(channel, unit), 9 if named else 10, f"{channel.name} by its name")
