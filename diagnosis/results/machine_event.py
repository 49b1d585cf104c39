"""What happened to the machine as a whole and is no part's fault."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from diagnosis.results.machine_words import MachineWords
from diagnosis.results.plain_numbers import with_minus_signs

#: What a sentence on a gyro has in it where it is off by a constant, and where the ground is named already.
GYRO_CONSTANT, GYRO_SLIP = "more than the {wheels} make", "unless the ground let them slip"
GYRO_OTHERWISE = "Gyro and steering angles contradict each other"
GYRO_REST = ", where they rest as well"  # so that no slip makes it


@dataclass(frozen=True)
class MachineEvent:
    """What happened to a machine, and is no part's fault.

    Attributes
    ----------
    title : str
        The verdict's title where no part's fault stands before it.
    text : str
        One sentence, or two.
    doubt : str
        Why a mission with faults to watch is not cleared; continues "check before it goes out: …".
    act : str
        What to do before a mission may be judged again.
    model : bool
        Whether the wheel model alone is in doubt: what axles show without it stands.
    body : bool
        Whether it is that a sensor of the body, as a gyro, contradicts what wheels or axles read: an axle that does not answer its own command is
        not explained by it, but may be why.
    supply : bool
        Whether it is that all wheels give less than they should: what supplies them may be why, of whatever else it drives as well.
    spans : tuple[tuple[float, float], ...]
        Begin and end of each time at which it was so [s], by time; empty where it was so throughout.
    """

    title: str
    text: str
    doubt: str
    act: str
    model: bool = False
    body: bool = False
    supply: bool = False
    spans: tuple[tuple[float, float], ...] = ()

    def at(self, spans: Sequence[tuple[float, float]]) -> MachineEvent:
        """The same with the times at which it was so [s]."""
        return replace(self, spans=tuple((float(a), float(b)) for a, b in spans))

    def worded(self, words: MachineWords) -> MachineEvent:
        """With the machine's own words."""
        return replace(
            self,
            title=words.fill(self.title),
            text=with_minus_signs(words.fill(self.text)),
            doubt=with_minus_signs(words.fill(self.doubt)),
            act=with_minus_signs(words.fill(self.act)),
        )


def not_following(text: str) -> MachineEvent:
    """Commands went on, and no wheel, or none that nobody else explains, followed them."""
    title = "The machine did not follow its commands"
    doubt = "the machine did not follow its commands for a time"
    return MachineEvent(title, text, doubt, "enable the drives, release the emergency stop, and record a mission again")


def not_related(text: str) -> MachineEvent:
    """Speeds and commands are of sizes that nothing relates, from start to end."""
    title = "The machine did not follow its commands"
    doubt = "the machine did not follow its commands"
    act = (
        "give wheel diameter, gear ratio and units in a machine file (`mfhca config init --log LOG`), check which topic or symbol commands the "
        "machine, and diagnose again; if it was held or its drives were off, record a mission in which they are on"
    )
    return MachineEvent(title, text, doubt, act)


def not_shown(text: str) -> MachineEvent:
    """The machine went as it was told, by a receiver, and its speeds do not show it."""
    title = "The speeds do not show how the machine went"
    doubt = "the speeds did not show how the machine went for a time"
    act = "check unit, mapping and supply of the speed channels, and record a mission again"
    return MachineEvent(title, text, doubt, act)


def swinging(text: str) -> MachineEvent:
    """All wheels swing about their expected speeds together."""
    doubt = "the {wheels} swing together for a time"
    act = "lower the gains of the speed loop, inspect the supply of the drives, and record a mission again"
    return MachineEvent("The {wheels} swing together", text, doubt, act)


def other_yaw_rate(text: str) -> MachineEvent:
    """The measured yaw rate alone contradicts the wheels, which follow their commands and each other."""
    doubt = "the gyro contradicts the {wheels}"
    act = "compare the gyro with turns of the machine that you count: its axis, its unit (rad/s or degrees), its plug"
    return MachineEvent("The gyro contradicts the {wheels}", text, doubt, act, body=True)


def gyro_or_slip(text: str) -> MachineEvent:
    """The measured yaw rate and the wheels contradict each other, where slip may make it: a constant, or a share, of a time in which they turn the machine."""
    slips = any(words in text for words in (GYRO_CONSTANT, GYRO_SLIP))
    if not slips or GYRO_REST in text:
        return other_yaw_rate(text)
    if GYRO_SLIP not in text:
        text = (
            f"{text.removesuffix('.')}; slip of the {{wheels}}, as on a slope, or where steering or another {{wheel}} turns the machine otherwise, "
            "looks the same."
        )
    doubt = "gyro and {wheels} contradict each other"
    act = (
        "look whether the {wheels} slipped there (slope, kerb, wet or loose ground); if not, compare the gyro with turns of the machine that you "
        "count: its axis, its unit (rad/s or degrees), its plug"
    )
    return MachineEvent("Gyro and {wheels} contradict each other", text, doubt, act, body=True)


def other_angle(text: str) -> MachineEvent:
    """A steering angle alone contradicts how the machine turns, all through."""
    act = "turn the steering to angles that you measure at the {wheels}, compare its sensor with them (zero, scale, unit), and diagnose again"
    return MachineEvent(
        "The steering angle contradicts the gyro", text, "the steering angle contradicts how the machine turns", act
    )


def other_turn(text: str) -> MachineEvent:
    """A yaw rate is another share of the turns than wheels and steering make, all through, and their speeds are not meant."""
    act = (
        "compare the gyro with turns of the machine that you count (its axis, its unit), measure steering angle, wheelbase or track against the "
        "machine file, and diagnose again"
    )
    return MachineEvent(
        "The gyro contradicts the turns", text, "gyro and turns contradict each other by a factor throughout", act
    )


def one_side_otherwise(text: str) -> MachineEvent:
    """The measured yaw rate shows one side going otherwise than it reads, while all keep to their commands."""
    act = (
        "mark the {wheels}, let each make ten turns by its encoder and count them, and measure the tyres; a speed over ground (gnss.speed) in the "
        "log would tell slip apart"
    )
    doubt = "the gyro contradicts the speed of one side"
    return MachineEvent("The gyro contradicts one side's speed", text, doubt, act, body=True)


def wheels_apart(sentences: Sequence[str]) -> tuple[MachineEvent, ...]:
    """Wheels that read another share of the motion than others make of it, or nothing, from start to end; a sentence each, one event at most."""
    if not sentences:
        return ()
    one = len(sentences) == 1
    act = (
        "mark the {wheels}, let each make ten turns by its encoder and count them, measure the tyres, check the mapping of the speeds, and record the "
        "commands as well (cmd.v, cmd.omega)"
    )
    title = "One {wheel} contradicts the others" if one else "The {wheels} contradict each other"
    return (MachineEvent(title, " ".join(sentences), f"{title[0].lower()}{title[1:]} throughout", act),)


def turns_otherwise(text: str) -> MachineEvent:
    """Gyro and odometry turn otherwise, and nothing else measures how the machine turns."""
    doubt = "gyro and odometry contradict each other"
    act = "turn the machine by a counted number of turns and compare both with them, then check the gyro's axis and unit, and the encoders"
    return MachineEvent("Gyro and odometry contradict each other", text, doubt, act, body=True)


def less_than_told(text: str) -> MachineEvent:
    """All wheels make another share of their commands throughout, or after some moment; `text` without its stop."""
    if text.endswith("throughout"):
        more = ": what supplies or loads them all, or the scale of commands or speeds, is not as it should be; no part is blamed for it."
        act = "check the unit and scale of commanded and measured speeds, and what all {wheels} share (supply, oil, load), and diagnose again"
        doubt = "the machine makes another share of its commands throughout"
        return MachineEvent("The {wheels} do not make their commands", text + more, doubt, act, supply=True)
    act = "look for what all {wheels} share (supply, oil, load, a slope, limits of the controller), and record a mission on level ground again"
    more = (
        ": what supplies or loads them all has changed, or all their speeds read otherwise; no part is blamed for it."
    )
    doubt = "the machine made another share of its commands for a part of the mission"
    title = "The {wheels} make another share of their commands for a time"
    return MachineEvent(title, text + more, doubt, act, supply=True)


def other_response(text: str) -> MachineEvent:
    """All wheels make another speed of the same openings from some moment on; `text` without its stop."""
    more = ": what supplies or loads them all, or the gear, has changed, or all their speeds read otherwise; no part is blamed for it."
    act = "look for what all {wheels} share (supply, oil, load, gear), and record a mission under one load and in one gear"
    doubt = "all {wheels} make another speed of the same openings for a part of the mission"
    return MachineEvent("The {wheels} answer otherwise for a part of the mission", text + more, doubt, act, supply=True)


def beyond_the_top(text: str) -> MachineEvent:
    """All wheels are faster than the machine can be; `text` without its stop."""
    more = ": unit or scale of the speeds, or max_speed in the machine file, is wrong."
    act = "correct the unit of the speeds under [signals], or max_speed under [geometry], in the machine file, and diagnose again"
    return MachineEvent(
        "The speeds do not fit the machine", text + more, "the {wheels}' speeds do not fit the machine", act
    )


def not_at_rest(text: str) -> MachineEvent:
    """All wheels read a speed where they should stand; `text` without its stop."""
    more = ": the machine rolls or creeps, or all speeds read too much; no part is blamed for it."
    act = "stop the machine on level ground and look whether its {wheels} stand while their speeds read something; mend what holds it, or the sensors' zero"
    doubt = "the {wheels} read a speed where they should stand"
    return MachineEvent("The {wheels} read a speed while told to stand", text + more, doubt, act)


def body_otherwise(text: str) -> MachineEvent:
    """A sensor of the body shows another share of the wheels' speed for a time; `text` without its stop."""
    act = "look whether all {wheels} slipped there; if not, compare that sensor, and the {wheel} speeds, with a measured way"
    more = ": all {wheels} slip there, or all speeds, or that sensor, are wrong; no part is blamed for it."
    doubt = "{wheels} and the sensor of the machine's speed contradict each other for a time"
    return MachineEvent("The {wheels} contradict the machine's measured speed", text + more, doubt, act, body=True)


def gyro_otherwise(text: str) -> MachineEvent:
    """The measured yaw rate is another share of the turns for a time; `text` without its stop."""
    event = other_yaw_rate(text)
    more = ": the gyro, or what it is held against, is wrong there; no part is blamed for it."
    doubt = "gyro and steering angles contradict each other for a time"
    return replace(event, title=GYRO_OTHERWISE, text=text + more, doubt=doubt)


def openings_doubted(text: str, act: str) -> MachineEvent:
    """All valves share what can only be a wrong unit of their openings; `text` and `act` without their stops."""
    doubt = "the unit of the {valve} openings is in doubt, and no {valve} was judged"
    return MachineEvent("The unit of the {valve} openings is in doubt", f"{text}.", doubt, f"{act}, and diagnose again")


def speeds_doubted(text: str, act: str) -> MachineEvent:
    """All wheels share what can only be a wrong size or unit of their speeds; `text` and `act` without their stops."""
    doubt = "the scale of the {wheel} speeds is in doubt"
    return MachineEvent("The machine's settings do not fit the log", f"{text}.", doubt, f"{act}, and diagnose again")


def foreign(text: str) -> MachineEvent:
    """Most wheels deviate now and then from a wheel model that does not fit the machine."""
    doubt = "most {wheels} deviate now and then from what the {wheel} model expects"
    act = "record {valve} positions (wheel.*.u_applied), or give the machine's [plant], and diagnose again"
    return MachineEvent("The {wheel} model does not fit this machine", text, doubt, act, model=True)
