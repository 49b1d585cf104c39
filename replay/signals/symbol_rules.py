"""Rules for symbols of PLCs and columns of tables, whose names alone say what they hold, in English, German or French."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from replay.log.raw_log import Channel
from replay.machine.config import Machine
from replay.machine.quantities import UNITS
from replay.machine.signal_table import CANONICAL, Scope
from replay.machine.units import known_unit
from replay.signals.candidate import Candidate, source_of
from replay.signals.name_parts import axle_of, index_of, is_drive, is_place, is_steering, wheel_of
from replay.signals.name_words import ASKING, MEASURED, english, role, tokens
from replay.signals.named_units import bare_name, unit_by_end

_EFFORT_UNITS = (("A", r"current|(^|_)amp"), ("V", r"volt"), ("%", r"duty|pwm"))
# What is derived from a signal, or bounds it, is not the signal.
_NO_SIGNAL = re.compile(r"^(err(or)?|diff|max(imum)?|ecart|erreur|seuil)$|fehler|abweichung|limit|grenz|schwelle")
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
_OWN = frozenset(("n", "v", "rad", "wheel"))  # that say it even alone: ``Rad VL [1/min]``
# Words beside which an asked speed is that of the whole machine.
_WHOLE = ASKING | frozenset(
    (*("speed", "velocity", "vel", "v", "r", "f", "lr", "x", "lin", "linear", "longitudinal", "fahr", "fahrzeug", "fzg", "vehicle"),
     *("machine", "maschine", "engin", "vehicule", "body", "robot", "chassis", "forward")),
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
        Of a table or a PLC; of messages only plain numbers (``data``, ``value``) and numbered fields.
    machine : Machine
        Its wheels and axles.
    first : Mapping[str, int]
        Smallest number of each numbered family of names.
    """
    if channel.topic and channel.field not in ("data", "value") and not re.search(r"\[[\w.]+\]$", channel.field):
        return
    name, stated = (channel.name, "") if channel.topic else bare_name(channel.name)
    inner = re.search(r"\[([A-Za-z_][\w.\[\]]*)\]$", name)
    name = inner.group(1) if inner and channel.topic else name
    bare = re.sub(r"\[\d+\]", "", name)
    unit = _stated_unit(channel, stated) or unit_by_end(name)
    parts = [english(tokens(part)) for part in re.split(r"[./]", bare)]
    text = "_".join(word for part in parts for word in part)
    last = _last_words(parts, machine)
    asked = role([*last, *(w for part in parts if {*part} <= ASKING | {"st"} for w in part)])
    yield from _by_word(channel, text, parts[-1], unit)
    steering = is_steering(bare)
    valve = re.search(r"valve|spool", text) is not None and re.search(r"motor|drive", text) is None
    leaf = _leaf(last, asked, steering, unit, valve)
    if leaf is None:
        return
    part = axle_of(bare, machine) if steering else wheel_of(bare, machine)
    rank = 8
    numbered = index_of(name)
    if part is None and numbered is not None and (steering or is_drive(bare) or "valve" in "_".join(last)):
        order = machine.axles if steering else machine.wheels
        at = numbered[1] - min(first.get(_family(channel, numbered[0]), first.get(numbered[0], numbered[1])), 1)
        part, rank = (order[at] if 0 <= at < len(order) else None), 9
    if part is None and len(machine.wheels) == 1 and not steering and not re.search(r"gnss|gps|imu|odom", text):
        part, rank = machine.wheels[0], 10
    if part is not None:
        signal = f"{'steer' if steering else 'wheel'}.{part}.{leaf}"
        how = {9: "by its number", 10: "as the only wheel"}.get(rank, "by its name")
        unit = unit or (_effort_unit("_".join(last)) if leaf == "effort" else "")
        yield Candidate(signal, source_of(channel, unit), rank, f"{channel.name} {how}")


def _last_words(parts: Sequence[Sequence[str]], machine: Machine) -> list[str]:
    """Words of the last part of a symbol that says more than a place: of ``fbWheel.fVelocity.FL`` velocity."""
    wheels = {w.lower() for w in machine.wheels if len(w) > 1}
    for part in reversed(parts):
        words = [w for w in part if not is_place(w) and w not in wheels]
        if any(not w.isdigit() for w in words):
            return words
    return []


def _stated_unit(channel: Channel, stated: str) -> str:
    """Unit that the file states; not the name of a part that stands in brackets, ``velocity[front_left]``."""
    inside = re.search(r"[\[(]([^\[\]()]*)[\])]\s*$", channel.name)
    part = inside is not None and not stated and channel.unit == inside[1].strip() and not channel.topic
    return ("" if part else channel.unit or "") or stated


def _leaf(last: Sequence[str], asked: str, steering: bool, unit: str, valve: bool) -> str | None:
    """Last word of the canonical name, by the words of a symbol, or by a unit where these say no quantity."""
    word = "_".join(last)
    if asked == "both" or any(_NO_SIGNAL.search(w) for w in last):
        return None
    patterns = _PART_PATTERNS[Scope.AXLE if steering else Scope.WHEEL]
    leaf = next((leaf for leaf, pattern in patterns if re.search(pattern, word)), None)
    if valve and {"current", "voltage"} & {*last}:  # of a valve: no effort of its wheel, and no opening
        return None
    quantity = UNITS[known] if (known := known_unit(unit)) is not None else ("", 1.0)
    if leaf is None and last and {w for w in last if not w.isdigit()} <= _PLAIN and (asked or _OWN & {*last}):
        leaf = "phi" if steering and quantity[0] == "angle" else None
        leaf = "v" if not steering and quantity[0] in ("speed", "rotation") else leaf
        leaf = {"ref": "u", "act": "u_applied"}.get(asked) if valve and quantity[0] == "fraction" else leaf
    if leaf in ("v", "phi") and asked == "ref":
        return f"{leaf}_ref"
    return leaf


def _effort_unit(word: str) -> str:
    """Unit of an effort by its name; empty where that does not tell."""
    return next((unit for unit, pattern in _EFFORT_UNITS if re.search(pattern, word)), "")


def _family(channel: Channel, template: str) -> str:
    found = index_of(channel.name)
    return found[0] if found is not None else template


def _is_speed(last: Sequence[str], unit: str) -> bool:
    """Whether words speak of a speed: by name, or as ``v`` in a unit of speed."""
    speed = (known := known_unit(unit)) is not None and UNITS[known][0] == "speed"
    return bool({"speed", "velocity", "vel"} & {*last}) or (speed and "v" in last)


def _by_word(channel: Channel, text: str, last: Sequence[str], unit: str) -> Iterator[Candidate]:
    """Yield signals of the whole machine by the words of their symbol or column."""
    if re.search(r"wheel|steer|valve|axle", text) or any(is_place(w) and w != "fwd" for w in last):
        return
    signal = next((signal for signal, pattern in _MACHINE_PATTERNS if re.search(pattern, text)), None)
    asks = role(last)
    if "yaw_rate" in last and asks != "both":
        signal = "cmd.omega" if asks == "ref" else signal or "imu.yaw_rate"
    elif signal is None and asks == "ref" and _is_speed(last, unit) and {*last} <= _WHOLE:
        signal = "cmd.v"
    if signal is not None:
        yield Candidate(signal, source_of(channel, unit), 9, f"{channel.name} by its name")
