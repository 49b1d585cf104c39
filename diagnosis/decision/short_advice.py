"""What somebody does to have a part judged that was not judged, or not for long enough."""

from __future__ import annotations

from diagnosis.results.assessment import Assessment, Lack
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.plain_numbers import plain
from diagnosis.results.vocabulary import Tier
from replay.faults import Side, State
from replay.machine.config import Limits

#: A component and its side.
Part = tuple[str, str]

_OPENING_UNIT = "correct the unit of {kind}.{{c}}.u and {kind}.{{c}}.u_applied under [signals] in a machine file"
_WITH_COMMAND = "record again, with wheel.{c}.u (the {valve} command) in the log all the time"


def act_of_wheel(
    part: Part, assessment: Assessment, driven: float | None, limits: Limits, words: MachineWords, state: State | None
) -> str:
    """What somebody does to have a part judged; ``{who}`` and ``{c}`` are filled in by the parts that it holds for.

    Parameters
    ----------
    part : Part
        A wheel's.
    assessment : Assessment
        Of it.
    driven : float or None
        Its driving [s].
    limits : Limits
        What counts.
    words : MachineWords
        How to speak of the machine.
    state : State or None
        The commonest state of it that is no judgement.
    """
    sensor, tier, lack = part[1] == Side.SENSOR, assessment.tier, lack_of(assessment, state)
    if lack is Lack.OPENING_UNIT:
        return _OPENING_UNIT.format(kind="wheel")
    faster = f"faster than {plain(limits.driving_speed)} {words.speed_unit}"
    if driven is not None and driven < limits.min_assessed and tier is not Tier.NONE:
        return f"move {words.parts_moved} {faster} for at least {limits.min_assessed:g} s, and diagnose that log"
    second = "wheel.{c}.v_true (a second speed)"
    other = second if sensor else f"wheel.{{c}}.u_applied (the {words.position})"
    if lack is Lack.ANSWER:
        return (
            f"drive for a minute and longer with several speeds, turns and stops, and diagnose that log; or log {other}"
        )
    if lack is Lack.SECOND_OFF:
        return "check the sensor of the second speed (wheel.{c}.v_true), its channel, unit and scale, and record a mission again"
    if tier is Tier.NONE:
        return _of_silent(sensor, state, lack)
    by_state = {
        State.NO_DATA: _WITH_COMMAND
        if lack is Lack.COMMAND
        else "record again, with wheel.{c}.v and its command in the log all the time",
        State.NOT_EXCITED: f"move {words.parts_moved} {faster} for at least {limits.min_assessed:g} s",
        State.MASKED: words.fill("repair the {wheel.sensor} first, then record a mission again"),
        State.SLIP: "drive straight ahead on ground with grip for at least 10 s",
    }
    if state in by_state:
        return words.fill(by_state[state])
    by_tier = {
        Tier.DIRECT: "log both measurements by one clock, with finer steps"
        if sensor
        else words.fill("hold each {valve} command for a second or longer, or log at a higher rate"),
        Tier.DRIVE: "run `mfhca fit` on healthy missions of this machine, and diagnose with the file that it writes (-m)",
        Tier.RESPONSE: f"log {second}"
        if sensor
        else words.fill(
            "lift the machine, run each drive alone at one speed for 10 s, and compare their currents; or log the command of the "
            "{valve} itself (wheel.{c}.u), or name it under [signals] if it is logged"
        ),
        Tier.TRACKING: f"log the commands (/cmd_vel of a ROS robot; cmd.v or wheel.{{c}}.v_ref) or {second}"
        if lack is Lack.BESIDE
        else words.fill("log wheel.{c}.u (the {valve} command) or ") + second,
    }
    if lack is Lack.DRIVE:
        return words.fill(
            "look whether the {wheel} has a {valve} at all: one that has is without power, or its effort is not logged; name one that has "
            "none under [machine] unpowered"
        )
    if lack is Lack.ECHO:
        return words.fill("record what the {wheels} measure (/joint_states, encoder counts) as wheel.{c}.v")
    if lack is Lack.UNIT:
        return "correct the unit or the channel of wheel.{c}.v and of its command under [signals] in a machine file"
    if tier in by_tier:
        return by_tier[tier]
    if lack is Lack.COMMAND:
        return words.fill(_WITH_COMMAND)
    return f"log {other}; without it, drive straight at three steady speeds for 10 s each"


def act_of_axle(side: str, state: State | None, lack: Lack | None, words: MachineWords) -> str:
    """What somebody does to have a part of an axle judged."""
    if state is State.MASKED:
        return "repair the steering sensor first, then record a mission again"
    if lack is Lack.OPENING_UNIT:
        return _OPENING_UNIT.format(kind="steer")
    if lack is Lack.COMMAND:
        return words.fill(
            "log steer.{c}.u (the command of its {valve}), and steer from stop to stop several times while driving"
        )
    if lack is Lack.SECOND:
        second = (
            "phi_true (a second angle)" if side == Side.SENSOR else "u_applied (the second measurement of its command)"
        )
        return f"steer from stop to stop several times while driving, or log steer.{{c}}.{second}"
    return "steer from stop to stop several times while driving"


def _of_silent(sensor: bool, state: State | None, lack: Lack | None) -> str:
    """What to log for a part of which nothing is judged."""
    if state is State.NO_DATA or lack is Lack.COMMAND:
        return (
            "log wheel.{c}.v" if sensor else "log wheel.{c}.u, or name wheels without a drive under [machine] unpowered"
        )
    return "log wheel.{c}.u or wheel.{c}.v_ref" if sensor else "log wheel.{c}.v"


def steering_signals(lack: Lack, words: MachineWords) -> str:
    """What to log of a steering of which nothing is judged: where its angle is there, what turns it alone."""
    if lack is not Lack.COMMAND:
        return "steer.*.phi and steer.*.u"
    return words.fill("steer.*.u (the command of its {valve}) or steer.*.u_applied")


def lack_of(assessment: Assessment, state: State | None) -> Lack | None:
    """What is missing where a state is no judgement."""
    return None if state is None else assessment.lacks.get(state)
