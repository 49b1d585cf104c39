"""A first machine from the files of one mission: structure, signals, lengths and speeds, and what a person must still say."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath

import numpy as np

from replay.errors import ConfigError, LogError
from replay.log.raw_log import Channel, RawLog
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import Control, Limits, Machine, haulotte
from replay.machine.geometry import Geometry, WheelGeometry
from replay.machine.units import known_unit
from replay.setup.motion import WheelMotion, backwards, wheel_motion
from replay.setup.robot_description import RobotDescription, parse_description
from replay.setup.structure import ONE, Preset, Structure, described_structure, named_structure, preset_structure
from replay.signals.mapping import map_signals
from replay.signals.signal import Signal, Signals
from replay.signals.to_si import peak_of

_SPEEDS = ("v", "v_true", "v_ref")
_RADII, _TRACKS = (0.02, 2.5), (0.05, 10.0)  # m
_HEADROOM = 1.2
_DIFFERS = 0.15
_LEAST_SPEED = 0.05  # m/s
_WHEEL_SIZES = (0.04, 1.0)  # m; of a radius that explains a speed without a unit
_JOINT_TYPES = ("JointState", "DynamicJointState")


@dataclass
class Draft:
    """A machine as far as a log shows it.

    Attributes
    ----------
    machine : Machine
        The machine, with every signal that was found.
    found : list[str]
        Where its structure and lengths come from, and which wheels count backwards: one sentence each.
    questions : list[str]
        What the log does not tell and a person must check or fill in: one sentence each.
    signals : Signals
        As the machine finds them in the log.
    notes : dict[str, list[str]]
        Comments by section of the machine file.
    """

    machine: Machine
    found: list[str] = field(default_factory=list)
    questions: list[str] = field(default_factory=list)
    signals: Signals = field(default_factory=lambda: Signals({}, {}))
    notes: dict[str, list[str]] = field(default_factory=dict)

    def say(self, section: str, text: str) -> None:
        """Add a sentence, also as a comment of a section."""
        self.found.append(text)
        self.notes.setdefault(section, []).append(text)

    def ask(self, section: str, text: str) -> None:
        """Add a question, also as a comment of a section."""
        self.questions.append(text)
        self.notes.setdefault(section, []).append(f"QUESTION: {text}")


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
    channels = {name: channel for log in logs for name, channel in log.channels.items()}
    doubts: list[str] = []
    description = _description(logs, doubts)
    structure = _structure(channels, description, preset)
    draft = Draft(Machine(_name(description, logs), "", structure.wheels, None))
    draft.say("machine", f"Wheels {', '.join(structure.wheels)}, from {structure.how}.")
    if "numbers" in structure.how:
        draft.ask("machine", "which wheel has which number? The names do not say; put the wheels into their order.")
    for doubt in doubts:
        draft.ask("geometry", doubt)
    given = _given(structure, channels, logs)
    sources = _sources(logs, draft)
    raw = replace(structure.machine(1.0), signals=given, sources=sources)
    found = map_signals(logs, raw)
    motions = _motions(found, structure.wheels)
    origins = _in_one_direction(draft, structure, found, motions)
    radius = _radius(draft, structure, found, motions, origins)
    places = _places(draft, structure, motions)
    geometry = None if places is None or radius is None else Geometry(dict(places), 2 * radius)
    machine = replace(
        raw, name=draft.machine.name, geometry=geometry, signals=origins, control=_control(preset),
        max_steer=_steer(draft, structure, found),
    )  # fmt: skip
    if preset is Preset.HAULOTTE:
        machine = replace(haulotte(), signals=origins, sources=sources)
    else:
        machine = _with_speeds(draft, machine, logs)
    draft.machine = machine
    draft.signals = map_signals(logs, machine)
    draft.questions += draft.signals.questions
    return draft


def _description(logs: Sequence[RawLog], doubts: list[str]) -> RobotDescription | None:
    for log in logs:
        if log.robot_description:
            try:
                return parse_description(log.robot_description)
            except LogError as error:
                doubts.append(f"{error}; its lengths are not used.")
    return None


def _structure(
    channels: Mapping[str, Channel], description: RobotDescription | None, preset: Preset | None
) -> Structure:
    joints = [m[1] for c in channels.values() if (m := re.search(r"\[([^\[\]]+)\]$", c.field)) and c.topic]
    described = None if description is None else described_structure(description, joints)
    if preset is not None:
        fixed = preset_structure(preset)
        return described if described is not None and described.wheels == fixed.wheels else fixed
    if described is not None:
        return described
    named = named_structure(channels)
    if named is not None:
        return named
    if _odometry(channels) is not None:
        return Structure(ONE, None, how="odometry: no wheel is in the log, the drive is judged as a whole")
    raise LogError(
        "no wheel speed is in the log: no joint, symbol or column is called like a wheel's speed, and there is no odometry; "
        "`mfhca channels LOG --all` lists what it holds; record /joint_states, or give the structure with --preset and name "
        "the signals in [signals]"
    )


def _name(description: RobotDescription | None, logs: Sequence[RawLog]) -> str:
    if description is not None and description.name:
        return description.name
    return f"robot of {PurePath(logs[0].source).name}"


def _odometry(channels: Mapping[str, Channel]) -> Channel | None:
    """Speed of the body by odometry."""
    found = [c for c in channels.values() if c.field == "twist.twist.linear.x" and len(c.values) > 1]
    return min(found, key=lambda c: ("filter" in c.topic, len(c.topic)), default=None)


def _given(structure: Structure, channels: Mapping[str, Channel], logs: Sequence[RawLog]) -> dict[str, SignalSource]:
    """Signals that rules for names would not find: joints of a description, a drive as a whole, tables called cmd_vel."""
    given: dict[str, SignalSource] = {}
    for wheel, joint in structure.joints.items():
        for c in channels.values():
            if c.type_name.rpartition("/")[2] not in _JOINT_TYPES or re.search(r"cmd|command|ref|target", c.topic):
                continue
            where = SignalSource(topic=c.topic, field=c.field)
            if c.field == f"velocity[{joint.joint}]":
                given.setdefault(f"wheel.{wheel}.v", replace(where, unit="rad/s"))
            elif c.field == f"effort[{joint.joint}]":
                given.setdefault(f"wheel.{wheel}.effort", replace(where, unit="N·m"))
            elif c.field == f"position[{joint.steering}]" and joint.steering:
                given.setdefault(f"steer.{wheel}.phi", replace(where, unit="rad"))
    odometry = _odometry(channels)
    if structure.wheels == ONE and "odometry" in structure.how and odometry is not None:
        given["wheel.D.v"] = SignalSource(topic=odometry.topic, field=odometry.field, unit="m/s")
    for log in logs:
        if len({c.topic for c in log.channels.values()}) == 1 and re.search(
            r"cmd|command", PurePath(log.source).stem, re.I
        ):
            given |= _commands(log)
    if structure.wheels == ONE and "wheel.D.v_ref" not in given:
        given |= {"wheel.D.v_ref": c for c in [given.pop("cmd.v", None) or _command(channels)] if c is not None}
    return given


def _commands(log: RawLog) -> dict[str, SignalSource]:
    """Commands in a table of their own, such as one topic of a bag written as CSV."""
    words = {
        "cmd.v": r"(linear[._]x|v|vx|speed|velocity)",
        "cmd.omega": r"(angular[._]z|w|wz|omega|yaw_?rate)",
    }
    source = PurePath(log.source).name
    found = {}
    for signal, pattern in words.items():
        for c in log.channels.values():
            if not c.topic and re.fullmatch(rf"(.*\.)?{pattern}", c.name.strip(), re.I):
                unit = "m/s" if signal == "cmd.v" else "rad/s"
                found.setdefault(signal, SignalSource(column=c.name, unit=c.unit or unit, source=source))
    return found


def _command(channels: Mapping[str, Channel]) -> SignalSource | None:
    """Commanded speed of the whole machine."""
    for c in channels.values():
        kind = c.type_name.rpartition("/")[2]
        asked = kind.startswith("Twist") and re.search(r"cmd|command", c.topic.lower())
        if (asked and c.field in ("linear.x", "twist.linear.x")) or (
            kind.startswith("AckermannDrive") and c.field in ("speed", "drive.speed")
        ):
            return SignalSource(topic=c.topic, field=c.field, unit="m/s")
    return None


def _sources(logs: Sequence[RawLog], draft: Draft) -> dict[str, SourceOptions]:
    """Several tables with dated stamps are taken to come from one recorder."""
    tables = [log for log in logs if all(not c.topic for c in log.channels.values())]
    if len(tables) < 2 or any(t.summary.start_ns < 10**18 for t in tables):
        return {}
    draft.ask(
        "sources", "were all tables stamped by one computer? It is taken so; else remove clock, and it is estimated."
    )
    return {f"*{PurePath(tables[0].source).suffix}": SourceOptions(clock="as recorded")}


def _motions(found: Signals, wheels: Sequence[str]) -> dict[str, WheelMotion]:
    """How each wheel's signals follow the commanded motion."""
    speed, turn = found.items.get("cmd.v"), found.items.get("cmd.omega")
    out = {}
    for wheel in wheels:
        for leaf in _SPEEDS:
            signal = found.items.get(f"wheel.{wheel}.{leaf}")
            asked = speed or found.items.get(f"wheel.{wheel}.v_ref")
            if signal is None or asked is None or signal is asked:
                continue
            motion = wheel_motion(signal, asked, turn if asked is speed else None)
            if motion is not None:
                out[signal.name] = motion
    return out


def _in_one_direction(
    draft: Draft, structure: Structure, found: Signals, motions: Mapping[str, WheelMotion]
) -> dict[str, SignalSource]:
    """Origins of all signals, those of wheels that count backwards with a negative gain."""
    flipped: dict[str, str] = {}
    for wheel in structure.wheels:
        motion = motions.get(f"wheel.{wheel}.v")
        if motion is not None:
            if motion.gain < 0:
                flipped[wheel] = "it turns against the command"
        elif wheel in structure.joints and structure.joints[wheel].mirrored:
            flipped[wheel] = "the axis of its joint says so"
    if not motions and not structure.joints:
        flipped |= _by_signs(structure, found)
    if flipped:
        why = "; ".join(dict.fromkeys(flipped.values()))
        draft.say("signals", f"Mirrored, written with gain = -1: {', '.join(flipped)} ({why}).")
    if any("taken" in why for why in flipped.values()):
        draft.ask(
            "signals", "which side counts backwards? The log shows only that left and right count against each other."
        )
    origins = {}
    for name, signal in found.items.items():
        group, part, leaf = (*name.split("."), "", "")[:3]
        against = part in flipped and leaf in ("v", "v_true", "effort")
        if leaf == "v_ref" and name in motions:
            against = motions[name].gain < 0
        origin = signal.origin
        origins[name] = replace(origin, gain=-origin.gain) if group == "wheel" and against else origin
    return origins


def _by_signs(structure: Structure, found: Signals) -> dict[str, str]:
    """Wheels of the right side, where they count against those of the left although the robot hardly turns."""
    speeds = {w: found.items[f"wheel.{w}.v"] for w in structure.wheels if f"wheel.{w}.v" in found.items}
    sides = structure.places or {}
    left = [w for w in speeds if w in sides and sides[w].y > 0]
    right = [w for w in speeds if w in sides and sides[w].y < 0]
    if left and right and backwards(speeds, left, right, found.items.get("imu.yaw_rate")):
        return dict.fromkeys(
            right, "left and right turn against each other; the right side is taken to be the mirrored one"
        )
    return {}


def _radius(
    draft: Draft, structure: Structure, found: Signals, motions: Mapping[str, WheelMotion],
    origins: dict[str, SignalSource],
) -> float | None:  # fmt: skip
    """Wheel radius [m]; signals without a unit get the one with which they follow the command."""
    turning = []
    for wheel in structure.wheels:
        name = f"wheel.{wheel}.v"
        motion, origin = motions.get(name), origins.get(name)
        if origin is None:
            continue
        unit = known_unit(origin.unit)
        if unit in ("rad/s", "rpm", "rev/s", "deg/s") or (unit == "rad" and origin.derivative):
            turning.append(1 / abs(motion.gain) if motion is not None else math.nan)
        elif not origin.unit and motion is not None and abs(abs(motion.gain) - 1) > _DIFFERS:
            turning += _unit_by_size(draft, structure, name, origin, motion, origins)
    known = [r for r in turning if math.isfinite(r) and _RADII[0] <= r <= _RADII[1]]
    measured = float(np.median(known)) if known else None
    if structure.radius is not None:
        draft.say("geometry", f"Wheel radius {structure.radius:g} m from {structure.how}.")
        if measured is not None and abs(measured / structure.radius - 1) > _DIFFERS:
            draft.ask(
                "geometry",
                f"is the wheel radius {structure.radius:g} m? By commanded and measured speeds it would be {measured:.3g} m.",
            )
        return structure.radius
    if measured is not None:
        draft.say(
            "geometry",
            f"Wheel radius {_round(measured)} m, from commanded speed over measured rotation: a slip or scale that all wheels "
            "share does not show with it; measure the wheel.",
        )
        return float(_round(measured))
    if turning:
        draft.ask(
            "geometry",
            "how large are the wheels? Nothing in the log tells it; 0.1 m radius stands in, and with it every speed.",
        )
        return 0.1
    return 0.1 if structure.places is not None else None


def _unit_by_size(
    draft: Draft, structure: Structure, name: str, origin: SignalSource, motion: WheelMotion,
    origins: dict[str, SignalSource],
) -> list[float]:  # fmt: skip
    """Give a speed without a unit the one that makes its wheel a usual size; return the radius, if one fits."""
    for unit, turn in (("rad/s", 1.0), ("rpm", 2 * math.pi / 60)):
        radius = 1 / (abs(motion.gain) * turn)
        if structure.places is not None and _WHEEL_SIZES[0] <= radius <= _WHEEL_SIZES[1]:
            origins[name] = replace(origin, unit=unit)
            draft.ask(
                "signals",
                f"is {origin.label} in {unit}? No unit is stated; with it the wheel's radius is {radius:.3g} m.",
            )
            return [radius]
    scale = float(f"{1 / motion.gain:.6g}")
    origins[name] = replace(origin, unit="m/s", gain=scale)
    draft.ask("signals", f"is {scale:g} the scale of {origin.label} to m/s? It is what makes it follow the command.")
    return []


def _round(value: float) -> str:
    return f"{value:.3g}"


def _places(
    draft: Draft, structure: Structure, motions: Mapping[str, WheelMotion]
) -> Mapping[str, WheelGeometry] | None:
    """Places with the track that turns show, where no description gives them."""
    places = structure.places
    if places is None:
        if structure.wheels != ONE:
            draft.ask("geometry", "where are the wheels? Their names do not say; without places no turn is compared.")
        return None
    tracks = [2 * m.y * (1 if places[n.split(".")[1]].y > 0 else -1) for n, m in motions.items() if m.y is not None]
    tracks = [t for t in tracks if _TRACKS[0] <= t <= _TRACKS[1]]
    fixed = all(p.axle == "fixed" for p in places.values())
    track = max(p.y for p in places.values()) - min(p.y for p in places.values())
    if "track" in structure.measured:
        draft.say("geometry", f"Track {track:.4g} m from {structure.how}.")
    elif tracks and fixed:
        track = float(_round(float(np.median(tracks))))
        draft.say("geometry", f"Track {track:g} m, from commanded turns over the wheels' speeds; measure it.")
    else:
        draft.ask("geometry", f"how far are left and right wheels apart? Nothing tells it; {track:g} m stand in.")
    base = max(p.x for p in places.values()) - min(p.x for p in places.values())
    if "wheelbase" in structure.measured:
        draft.say("geometry", f"Wheelbase {base:.4g} m from {structure.how}.")
    elif base:
        matters = "fixed wheels do not need it" if fixed else "steering angles need it"
        draft.ask(
            "geometry", f"how far are front and rear wheels apart? Nothing tells it ({matters}); {base:g} m stand in."
        )
    scale = track / max(max(p.y for p in places.values()) - min(p.y for p in places.values()), 1e-9)
    return {w: replace(p, y=round(p.y * scale, 4)) for w, p in places.items()}


def _control(preset: Preset | None) -> Control:
    return Control() if preset is Preset.HAULOTTE else Control(law="none")


def _steer(draft: Draft, structure: Structure, found: Signals) -> float:
    usual = haulotte().max_steer
    angles = [
        s for n, s in found.items.items() if n.startswith("steer.") and n.rpartition(".")[2] in ("phi", "phi_ref")
    ]
    if structure.max_steer is not None:
        return min(structure.max_steer, 3.2)
    if not any(p.axle != "fixed" for p in (structure.places or {}).values()):
        return usual
    reached = max((peak_of(s.values) for s in angles), default=0.0)
    value = float(_round(min(max(_HEADROOM * reached, 0.1), 1.6))) if reached else round(usual, 4)
    draft.ask(
        "geometry", f"how far do the wheels steer? max_steer = {value:g} rad is a fifth more than this log shows."
    )
    return value


def _with_speeds(draft: Draft, machine: Machine, logs: Sequence[RawLog]) -> Machine:
    """The machine with the top speed that the log shows, and the limits that go with it."""
    found = map_signals(logs, machine).items
    wheels = [s for n, s in found.items() if n.startswith("wheel.") and n.rpartition(".")[2] in ("v", "v_ref")]
    asked = _asked(found, machine)
    reached = max([_top(s) for s in wheels] + [asked], default=0.0)
    top = float(_round(max(_HEADROOM * reached, _LEAST_SPEED)))
    draft.ask(
        "geometry",
        f"how fast can it go? max_speed = {top:g} m/s is a fifth more than this log shows; limits grow and shrink with it.",
    )
    usual, share = Limits(), top / haulotte().max_speed
    limits = replace(
        usual, driving_speed=round(usual.driving_speed * share, 4), min_sat=round(usual.min_sat * share, 4)
    )
    return replace(machine, max_speed=top, limits=limits)


def _asked(found: Mapping[str, Signal], machine: Machine) -> float:
    v, omega = found.get("cmd.v"), found.get("cmd.omega")
    side = max((abs(p.y) for p in machine.geometry.wheels.values()), default=0.0) if machine.geometry else 0.0
    return (0.0 if v is None else _top(v)) + (0.0 if omega is None else side * _top(omega) / 2)


def _top(signal: Signal) -> float:
    return peak_of(signal.values)


def check_draft(draft: Draft) -> None:
    """Raise a `ConfigError` where no wheel of a draft has a speed."""
    if not any(re.fullmatch(r"wheel\.[^.]+\.(v|v_true|u_applied)", name) for name in draft.signals.items):
        raise ConfigError(
            "no wheel of the structure has a speed in the log; `mfhca channels LOG --all` lists what it holds"
        )
