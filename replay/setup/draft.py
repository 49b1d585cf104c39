"""A first machine from the files of one mission: structure, signals, lengths and speeds, and what a person must still say."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePath

from replay.clocks.align import align_clocks
from replay.clocks.source_clock import SourceClock
from replay.errors import LogError
from replay.log.empty_log import silent_topics
from replay.log.raw_log import Channel, RawLog
from replay.machine.config import Control, Machine, haulotte
from replay.machine.geometry import Geometry
from replay.setup.asked_columns import asked_columns, motions_of_body, where_commands_are
from replay.setup.by_the_body import radius_by_body
from replay.setup.contradictions import in_turn_with_commands, units_by_positions
from replay.setup.draft_notes import Draft
from replay.setup.free_wheels import ask_about_drives
from replay.setup.given import ask_about_odometry, given_signals, odometry, table_sources
from replay.setup.lengths import largest_angle, wheel_places, wheel_radius, without_size
from replay.setup.motion import WheelMotion, wheel_motion
from replay.setup.numbered_wheels import ask_for_more_wheels, ask_for_numbers, ordered_by_turns
from replay.setup.one_clock import lags
from replay.setup.one_direction import in_one_direction
from replay.setup.preset import Preset
from replay.setup.read import options_of
from replay.setup.robot_description import RobotDescription, parse_description
from replay.setup.structure import (
    IN_ROWS,
    ONE,
    Structure,
    described_structure,
    named_structure,
    one_motor,
    preset_structure,
    steering_names,
)
from replay.setup.top_speed import limits_for, with_speeds
from replay.setup.unstated_units import usual_units, valve_currents
from replay.setup.unsure_signals import unsure_signals
from replay.setup.unused_steering import ask_about_steering
from replay.setup.vesc import ask_about_motor
from replay.signals.file_names import named_channels
from replay.signals.like_wheels import like_wheels
from replay.signals.mapping import by_number, map_signals
from replay.signals.possible_commands import possible_commands
from replay.signals.publishing import on_change_hint
from replay.signals.signal import Signals
from replay.signals.unfilled import unfilled, unfilled_note

_SPEEDS = ("v", "v_true", "v_ref")
_SHOWN = 6  # names in a message


def structure_of(logs: Sequence[RawLog]) -> Structure:
    """Wheels of the machine that recorded some logs; raises `LogError` where none can be found."""
    channels = _all_channels(logs)
    return _structure(channels, _description(logs, []), None, silent_topics(log.summary for log in logs))


def preset_draft(preset: Preset) -> Draft:
    """A machine of a usual kind without a log: every length is to be filled in, and every signal found by its name."""
    structure = preset_structure(preset)
    draft = Draft(
        replace(haulotte(), assumed=())
        if preset is Preset.HAULOTTE
        else Machine("unnamed machine", "", structure.wheels, None)
    )
    draft.say("machine", f"Wheels {', '.join(structure.wheels)}, from {structure.how}.")
    if preset is Preset.HAULOTTE:
        return draft
    places = wheel_places(draft, structure, {})
    assert places is not None
    draft.ask("geometry", "how large are the wheels, and how fast can it go? 0.1 m radius and 1 m/s stand in.")
    draft.machine = replace(
        draft.machine,
        geometry=Geometry(dict(places), 0.2),
        control=Control(law="none"),
        max_speed=1.0,
        limits=limits_for(1.0),
    )
    draft.notes["signals"] = ["Found by their names; `mfhca channels LOG` shows which."]
    return draft


def draft_machine(logs: Sequence[RawLog], preset: Preset | None = None) -> Draft:
    """Draft the machine that recorded the files of one mission.

    Parameters
    ----------
    logs : Sequence[RawLog]
        With the topics that may hold signals, and the robot's description.
    preset : Preset or None
        Kind of the machine; None: found.

    Raises
    ------
    LogError
        Where no wheel or drive can be found.
    """
    channels = _all_channels(logs)
    doubts: list[str] = []
    description = _description(logs, doubts)
    structure = _structure(channels, description, preset, silent_topics(log.summary for log in logs))
    draft = Draft(Machine(_name(description, logs), "", structure.wheels, None))
    many = f"Wheels {', '.join(structure.wheels)}" if len(structure.wheels) > 1 else f"One drive, {structure.wheels[0]}"
    draft.say("machine", f"{many}, from {structure.how}.")
    for doubt in doubts:
        draft.ask("geometry", doubt)
    if structure.how.endswith(IN_ROWS):
        draft.ask(
            "geometry",
            f"is the axle of {structure.wheels[0]} in front, and is each name a wheel of its own? Numbers tell an order alone; else turn the "
            "signs of x, and front and rear.",
        )
    if preset is Preset.HAULOTTE:
        return _haulotte_draft(draft, logs)
    empty = unfilled(channels)
    given = given_signals(structure, {n: c for n, c in channels.items() if n not in empty}, logs)
    ask_about_motor(structure, given, draft)
    ask_about_odometry(structure, channels, draft)
    ask_about_steering(structure, steering_names(channels), draft)
    for array in dict.fromkeys(empty.values()):
        draft.say("signals", f"Not used: {unfilled_note(array)}.")
    raw = replace(structure.machine(1.0), signals=given)
    found = map_signals(logs, raw)
    unsure = unsure_signals(draft, channels, raw, found)
    if unsure:
        raw = replace(raw, signals={**raw.signals, **unsure})
        found = map_signals(logs, raw)
    left = [w for w, p in (structure.places or {}).items() if p.y > 0]
    raw = replace(
        raw, sources=table_sources(logs, draft, lags(found, structure.wheels, left, [log.source for log in logs]))
    )
    numbered = by_number(found.items, raw)
    turned = ordered_by_turns(structure, _motions(found, structure.wheels)) if numbered else None
    if turned is not None:
        structure, raw = turned, replace(raw, wheels=turned.wheels, geometry=turned.machine(1.0).geometry)
        found = map_signals(logs, raw)
        numbered = by_number(found.items, raw)
    ask_for_numbers(draft, numbered, turned is not None)
    draft.machine = replace(draft.machine, wheels=structure.wheels)
    for units in (
        {**usual_units(draft, found), **valve_currents(draft, channels, raw, found)},
        units_by_positions(draft, structure, found),
    ):
        if units:
            raw = replace(raw, signals={**raw.signals, **units})
            found = map_signals(logs, raw)
    every = found
    if len(logs) > 1:  # lengths and directions are of signals at one time
        logs, clocks = align_clocks(logs, raw, [options_of(Path(log.source), raw) for log in logs])
        every = map_signals(logs, raw)
        found = _of_one_clock(every, clocks)
    motions = _motions(found, structure.wheels)
    origins = in_one_direction(draft, structure, found, motions)
    origins = {name: signal.origin for name, signal in every.items.items()} | origins
    _ask_for_what_is_missing(draft, every, channels)
    ask_about_drives(draft, every.items)
    if hint := on_change_hint(every.items):
        draft.ask("signals", f"are commands published on change only? {hint}.")
    ask_for_more_wheels(draft, like_wheels({n: c for n, c in channels.items() if n not in empty}, origins))
    motions = in_turn_with_commands(draft, structure, found, motions, origins)
    straight = [w for w, p in (structure.places or {}).items() if p.axle == "fixed"]
    radius = wheel_radius(
        draft, structure, found, motions, origins, radius_by_body(found, structure.wheels, straight, origins)
    )
    places = wheel_places(draft, structure, motions, (found, radius, origins))
    geometry = None if places is None else Geometry(dict(places), 2 * radius)
    if geometry is None:
        origins = {n: without_size(o, radius) if n.startswith("wheel.") else o for n, o in origins.items()}
    origins = {n: origins[n] for n in raw.canonical_signals() if n in origins}
    machine = replace(
        raw, name=draft.machine.name, geometry=geometry, signals=origins, control=_control(every),
        max_steer=largest_angle(draft, structure, found),
    )  # fmt: skip
    draft.machine = with_speeds(draft, machine, logs)
    return _finished(draft, logs)


def _haulotte_draft(draft: Draft, logs: Sequence[RawLog]) -> Draft:
    """The paper's machine, with every signal that it finds by itself."""
    machine = replace(haulotte(), sources=table_sources(logs, draft), assumed=())
    origins = {name: signal.origin for name, signal in map_signals(logs, machine).items.items()}
    draft.machine = replace(machine, signals=origins)
    return _finished(draft, logs)


def _finished(draft: Draft, logs: Sequence[RawLog]) -> Draft:
    machine = draft.machine
    draft.signals = map_signals(logs, machine)
    draft.questions += draft.signals.questions
    used = {signal.source for signal in draft.signals.items.values()}
    draft.idle = tuple(log.source for log in logs if log.source not in used) if used else ()
    return draft


def _all_channels(logs: Sequence[RawLog]) -> dict[str, Channel]:
    """Channels of all files; of two of one name in several tables both are kept."""
    out: dict[str, Channel] = {}
    for log, channels in zip(logs, named_channels(logs), strict=True):
        for name, channel in channels.items():
            out[name if name not in out else f"{log.source} {name}"] = channel
    return out


def _description(logs: Sequence[RawLog], doubts: list[str]) -> RobotDescription | None:
    for log in logs:
        if log.robot_description:
            try:
                return parse_description(log.robot_description)
            except LogError as error:
                doubts.append(f"{error}; its lengths are not used.")
    return None


def _structure(
    channels: Mapping[str, Channel], description: RobotDescription | None, preset: Preset | None, silent: str
) -> Structure:
    joints = [m[1] for c in channels.values() if (m := re.search(r"\[([^\[\]]+)\]$", c.field)) and c.topic]
    described = None if description is None else described_structure(description, joints)
    if preset is not None:
        motor = one_motor(channels) if preset is Preset.ACKERMANN and named_structure(channels) is None else None
        fixed = motor or preset_structure(preset)
        return described if described is not None and described.wheels == fixed.wheels else fixed
    if described is not None:
        return described
    named = named_structure(channels)
    if named is not None:
        return named
    if odometry(channels) is not None:
        return Structure(ONE, None, how="odometry: no wheel is in the log, the drive is judged as a whole")
    raise LogError(
        f"no wheel speed is in the log: {_nameless(joints, channels)}, and there is no odometry; `mfhca channels LOG --all` lists "
        "what it holds; record /joint_states, or give the structure with --preset and name the signals in [signals]; an arm "
        f'needs a machine file with its joints as wheels and part = "joint"{silent}'
    )


def _nameless(joints: Sequence[str], channels: Mapping[str, Channel]) -> str:
    """What the log holds that may be wheels, whose names tell no place."""
    columns = [c.name for c in channels.values() if not c.topic]
    for what, names in (("joints", [j for j in dict.fromkeys(joints) if not j.isdigit()]), ("columns", columns)):
        if names:
            more = ", …" if len(names) > _SHOWN else ""
            return f"none of its {what} ({', '.join(names[:_SHOWN])}{more}) is called like a wheel (front_left, FL, left) and its speed"
    return "no joint, symbol or column is called like a wheel's speed"


def _name(description: RobotDescription | None, logs: Sequence[RawLog]) -> str:
    if description is not None and description.name:
        return description.name
    return f"machine of {PurePath(logs[0].source).name}"


def _of_one_clock(found: Signals, clocks: Sequence[SourceClock]) -> Signals:
    """Signals without those of files whose clock is not known against the first one's: compared, they would tell of a delay."""
    apart = {c.source for c in clocks if c.reason}
    return replace(found, items={n: s for n, s in found.items.items() if s.source not in apart})


def _motions(found: Signals, wheels: Sequence[str]) -> Mapping[str, WheelMotion]:
    """How each wheel's signals follow the commanded motion."""
    speed, turn, lateral = (found.items.get(f"cmd.{leaf}") for leaf in ("v", "omega", "lateral"))
    out = {}
    for wheel in wheels:
        for leaf in _SPEEDS:
            signal = found.items.get(f"wheel.{wheel}.{leaf}")
            asked = speed or found.items.get(f"wheel.{wheel}.v_ref")
            if signal is None or asked is None or signal is asked:
                continue
            motion = wheel_motion(signal, asked, turn, lateral) if asked is speed else wheel_motion(signal, asked, None)
            if motion is not None:
                out[signal.name] = motion
    return out


def _ask_for_what_is_missing(draft: Draft, found: Signals, channels: Mapping[str, Channel]) -> None:
    """Ask for what nothing can be judged without."""
    leaves = {name.rpartition(".")[2] for name in found.items if name.startswith("wheel.")}
    if not leaves & {"v", "v_true"}:
        draft.ask(
            "signals",
            "where are the speeds of the wheels? No name tells; give each a line as those below (topic and field, or column), "
            f'"wheel.{draft.machine.wheels[0]}.v" = {{ … }} and so on.',
        )
    if "cmd.v" not in found.items and not leaves & {"v_ref", "u", "u_applied", "v_true"}:
        only = (
            "wheels can only be compared with each other" if len(draft.machine.wheels) > 1 else "nothing can be judged"
        )
        used = [signal.origin.label for signal in found.items.values()]
        asked, motions = asked_columns(channels, draft.machine, used), motions_of_body(channels, draft.machine)
        commands = possible_commands((c.topic, c.type_name) for c in channels.values())
        draft.ask("signals", where_commands_are(only, asked, commands, motions))


def _control(found: Signals) -> Control:
    """Law of the paper's kind where valve commands are logged, which is fitted; else another controller."""
    return Control() if any(re.fullmatch(r"wheel\.[^.]+\.u", n) for n in found.items) else Control(law="none")
