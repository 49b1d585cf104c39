"""Columns of a letter or two, and such as are told by their values or by what stands beside them: ``gyro``, ``lat`` and ``lon``, ``pos_FL`` beside ``u_FL``, ``us_rear``.

Each may be something else; see `replay.signals.unsure_names`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from replay.log.raw_log import Channel
from replay.machine.config import Machine
from replay.machine.quantities import UNITS
from replay.machine.units import known_unit
from replay.signals.name_parts import axle_of, end_of, is_place, is_steering, position, wheel_of
from replay.signals.name_words import ASKING, MEASURED, english, role, tokens
from replay.signals.named_units import bare_name, unit_by_end

Array = NDArray[np.float64]

_TURNS = (frozenset(("gyro",)), frozenset(("gz",)), frozenset(("wz",)), frozenset(("omega", "z")))
_OF_TURNS = frozenset(("imu", "body", "z", "rate"))
_LATITUDE, _LONGITUDE = frozenset(("lat",)), (frozenset(("lon",)), frozenset(("long",)), frozenset(("lng",)))
_RECEIVER = frozenset(("pos", "position", "nav", "deg", "grad"))
_DEGREES = (90.0, 180.0, 3.0)  # of latitude and longitude at most, and what a mission goes through of either
_ANGLES = frozenset(("steer", "delta"))
_OF_ANGLES = frozenset(("pos", "position", "axle", "angle", "wheel", "rad")) | ASKING | MEASURED
_RADIANS, _TURN_DEG = 1.6, 90.0  # a steering angle at most
_FULL, _LEAST = 1.1, 0.05  # of full opening: at most, with some noise, and what it reaches
_LIKE = 0.8  # correlation of a valve's position with its command
_PLACES = (frozenset(("pos",)), frozenset(("position",)))
_TOLD = frozenset(("cmd", "command", "ctrl", "control", "y"))  # y: what a controller puts out
_OVER_GROUND = frozenset(("sog",))
_KNOTS = frozenset(("kn", "kt", "kts", "knots"))
#: Letters of a drive's and of a steering valve, as in the control law's u_a and u_s, and what stands before a position.
_VALVES = {"u": (frozenset(("ua",)), frozenset(("us",))), "u_applied": (frozenset(("apos",)), frozenset(("spos",)))}


def turns(channels: Mapping[str, Channel]) -> Iterator[tuple[str, str, str]]:
    """Yield signal, name and unit of columns that may be the yaw rate: ``gyro``, ``wz``, ``imu_gz``.

    `channels`: of tables, by name, of which nothing else is known.
    """
    for name, channel in channels.items():
        words, unit = _words(channel)
        own = words - _OF_TURNS if not words <= _OF_TURNS else words
        alike = words in _TURNS or own in _TURNS
        if alike and (known_unit(unit) is None or UNITS[known_unit(unit) or ""][0] == "rotation"):
            yield "imu.yaw_rate", name, unit


def places(channels: Mapping[str, Channel]) -> Iterator[tuple[str, str]]:
    """Yield signal and name of two columns that may be latitude and longitude, by their names and values; none of one alone."""
    by_words = {name: _words(c)[0] - _RECEIVER for name, c in channels.items()}
    lat = [n for n, words in by_words.items() if words == _LATITUDE and _goes(channels[n], _DEGREES[0])]
    lon = [n for n, words in by_words.items() if words in _LONGITUDE and _goes(channels[n], _DEGREES[1])]
    if len(lat) == 1 and len(lon) == 1:
        yield "gnss.lat", lat[0]
        yield "gnss.lon", lon[0]


def over_ground(channels: Mapping[str, Channel]) -> Iterator[tuple[str, str, str]]:
    """Yield signal, name and unit, which may be empty, of columns that may be the speed over ground: ``SOG``, ``gps_sog_kn``."""
    for name, channel in channels.items():
        words, unit = _words(channel)
        knots = _KNOTS & words
        unit = unit or ("kn" if knots else "")
        own = words - knots - _RECEIVER - {"gps", "gnss"}
        if own == _OVER_GROUND and (known_unit(unit) is None or UNITS[known_unit(unit) or ""][0] == "speed"):
            yield "gnss.speed", name, unit


def angles(
    channels: Mapping[str, Channel], machine: Machine, letters: Mapping[str, str]
) -> Iterator[tuple[str, str, str, bool]]:
    """Yield signal, name, unit and whether it is the driver's wheel, of columns that may be angles of an axle: ``delta_rear``, ``steer_pos_rear``.

    `channels`: by name, of which nothing else is known, of messages the driver's wheel alone; `machine` has the axles; `letters`: of `steering_letters`.
    """
    for name, channel in channels.items():
        words, unit = _words(channel)
        asked = letters.get(name, role([*words]))
        axle = axle_of(bare_name(name)[0], machine)
        if axle is None and name in letters and len(machine.axles) == 1:
            axle = machine.axles[0]
        if axle is None or not _ANGLES & words or not words <= _ANGLES | _OF_ANGLES or asked == "both":
            continue
        if not is_steering(name) and end_of(name) is None and name not in letters:
            continue
        most = _most(channel)
        drivers = "steer" in words and bool({"wheel", "rad"} & words)
        if channel.topic and not drivers:
            continue
        if unit and (known_unit(unit) is None or UNITS[known_unit(unit) or ""][0] != "angle"):
            continue
        if not unit and (drivers or 0.0 < most <= _TURN_DEG):
            unit = "rad" if most <= _RADIANS else "deg"
        if unit:
            yield f"steer.{axle}.{'phi_ref' if asked == 'ref' else 'phi'}", name, unit, drivers


def steering_letters(channels: Mapping[str, Channel]) -> dict[str, str]:
    """Columns that call a car's steering by its letter, δ, each with ``ref`` where it is asked for and ``act`` where it is measured.

    ``command_delta`` is asked for, and ``delta`` too where nothing else speaks of steering: so most such logs are written, and what is commanded
    alone is no part that could be judged. A difference of something else (``delta_t``, ``delta_v``) has a word for it, and one of nothing said keeps to one
    sign, or is larger than an angle of steering.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        By name.
    """
    roles: dict[str, str] = {}
    for name, channel in channels.items():
        words, unit = _words(channel)
        if (
            channel.topic
            or position(bare_name(name)[0]) != (None, None)
            or words - ASKING - MEASURED - {"angle", "rad"} != {"delta"}
            or role([*words]) == "both"
        ):
            continue
        known, quantity = _known(channel), UNITS[u][0] if (u := known_unit(unit)) else ""
        most = _TURN_DEG if u == "deg" else _RADIANS
        turns = known.size > 1 and known.min() < 0.0 < known.max() and float(np.abs(known).max()) <= most
        if turns and quantity == ("angle" if unit else ""):
            roles[name] = role([*words])
    if any(is_steering(name) for name in channels):  # then a bare one may be anything
        return {name: said for name, said in roles.items() if said}
    return {name: said or ("act" if "ref" in roles.values() else "ref") for name, said in roles.items()}


def openings(
    channels: Mapping[str, Channel], machine: Machine, named: Mapping[str, str]
) -> Iterator[tuple[str, str, str]]:
    """Yield signal, name and unit of columns that may be openings by what stands beside them.

    ``pos_FL`` goes as the command ``u_FL`` of the same wheel does; ``us_rear`` and ``spos_rear`` are of an axle whose angle is there;
    ``cmd_FL``, ``ctrl_FL`` and ``y_VL`` stay within a full opening, where the wheels' commanded speeds are other channels.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        Of tables, by name.
    machine : Machine
        Its wheels and axles.
    named : Mapping[str, str]
        Labels of channels that are taken by their names, by canonical signal.
    """
    steered = {s.split(".")[1] for s in named if s.startswith("steer.") and s.endswith(".phi")}
    speeds = "cmd.v" in named or any(s.startswith("wheel.") and s.endswith(".v_ref") for s in named)
    for name, channel in channels.items():
        words, unit = _words(channel)
        opened = _unit(channel, unit)
        axle, wheel = axle_of(name, machine), wheel_of(name, machine)
        if opened is None:
            continue
        for leaf, (of_drive, of_steering) in _VALVES.items():
            if words == of_steering and axle in steered and position(name)[1] is None:
                yield f"steer.{axle}.{leaf}", name, opened
            elif words == of_drive and wheel is not None:
                yield f"wheel.{wheel}.{leaf}", name, opened
        if speeds and wheel is not None and len(words) == 1 and words <= _TOLD and not is_steering(name):
            yield f"wheel.{wheel}.u", name, opened
        if words in _PLACES and wheel is not None and (label := named.get(f"wheel.{wheel}.u")) is not None:
            command = channels.get(label)
            if command is not None and _alike(channel, command):
                yield f"wheel.{wheel}.u_applied", name, opened


def _words(channel: Channel) -> tuple[frozenset[str], str]:
    """Words of a name without places, numbers and the unit that it states, and that unit."""
    name, stated = bare_name(channel.field.rpartition(".")[2] if channel.topic else channel.name)
    by_end = "" if stated else unit_by_end(name)
    unit = stated or (channel.unit if channel.unit and known_unit(channel.unit) else "") or by_end
    words = {w for w in english(tokens(name)) if not is_place(w) and not w.isdigit()} - {*tokens(by_end)}
    steers = is_steering(name)
    return frozenset("steer" if steers and w in ("steering", "str") else w for w in words), unit


def _known(channel: Channel) -> Array:
    values = channel.values
    return np.asarray(values[np.isfinite(values)], np.float64) if values.dtype.kind in "fiu" else np.zeros(0)


def _most(channel: Channel) -> float:
    return float(np.abs(_known(channel)).max(initial=0.0))


def _goes(channel: Channel, most: float) -> bool:
    """Whether values may be degrees of a place on the earth on which a machine drove."""
    known = _known(channel)
    return bool(known.size > 1 and 0.0 < np.abs(known).max() <= most and 0.0 < np.ptp(known) <= _DEGREES[2])


def _unit(channel: Channel, stated: str) -> str | None:
    """Fractions or per cent, as stated or by the largest value; None where it is neither."""
    if stated:
        known = known_unit(stated)
        return known if known is not None and UNITS[known][0] == "fraction" else None
    most = _most(channel)
    return next((unit for full, unit in ((1.0, "1"), (100.0, "%")) if _LEAST * full <= most <= _FULL * full), None)


def _alike(one: Channel, other: Channel) -> bool:
    """Whether a column goes as another one of the same table does."""
    if one.values.size != other.values.size or {one.values.dtype.kind, other.values.dtype.kind} - {*"fiu"}:
        return False
    known = np.isfinite(one.values) & np.isfinite(other.values)
    x, y = (np.asarray(c.values[known], np.float64) for c in (one, other))
    size = float(np.std(x) * np.std(y)) if x.size > 1 else 0.0
    return size > 0.0 and float(np.mean((x - x.mean()) * (y - y.mean()))) / size > _LIKE
