"""What stands behind an all-clear: checks that a fault of the size that counts would not have passed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from diagnosis.results.clearing_rows import ClearingRow
from diagnosis.results.machine_words import HYDRAULIC, MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import Side


class Check(StrEnum):
    """What is asked of a part; `CHECK_WORDS` has what a value beyond the limit means."""

    SECOND_MEASUREMENT = "second_measurement"
    JITTER = "jitter"
    RESPONSE = "response"
    LASTING_RESPONSE = "lasting_response"
    CHANGE = "change"
    EXCESS = "excess"
    LASTING_EXCESS = "lasting_excess"
    PLANT_RESPONSE = "plant_response"
    SAME_SIDE = "same_side"
    OPENING_OFFSET = "opening_offset"
    EFFORT = "effort"
    CARRIED = "carried"
    BEHIND = "behind"
    TRACKING = "tracking"
    ROUGHNESS = "roughness"
    DELAY = "delay"
    STILL = "still"
    RATE = "rate"
    LASTING_RATE = "lasting_rate"
    PLANT_RATE = "plant_rate"
    YAW = "yaw"
    LASTING_YAW = "lasting_yaw"
    JUMP = "jump"
    ANGLE_SCALE = "angle_scale"
    COMMANDED_ANGLE = "commanded_angle"
    UNSTEERED = "unsteered"


#: What a check compares, and what is said where it is beyond its limit; ``{part}`` and ``{value}`` are filled in, and the
#: machine's words.
CHECK_WORDS: dict[Check, tuple[str, str]] = {
    Check.SECOND_MEASUREMENT: (
        "against its second measurement",
        "the {part} is off its second measurement by {value} of what it should show",
    ),
    Check.JITTER: (
        "noise of its position beside that of its command",
        "the {part} jitters by {value} of full {unit_command} (standard deviation) more than its command",
    ),
    Check.RESPONSE: (
        "speed per {unit_command} below the other {wheels}', for 3 s",
        "the speed of {part} per {unit_command} is {value} the other {wheels}'",
    ),
    Check.LASTING_RESPONSE: (
        "speed per {unit_command} below the other {wheels}', over the mission",
        "the speed of {part} per {unit_command} is {value} the other {wheels}' over the mission",
    ),
    Check.CHANGE: (
        "speed per {unit_command} beside the other {wheels}', from one part of the mission to the next, or growing",
        "the speed of {part} per {unit_command} changes beside the other {wheels}' by a {value} in the mission",
    ),
    Check.EXCESS: (
        "speed per {unit_command} above the other {wheels}', for 3 s",
        "the speed of {part} per {unit_command} is {value} the other {wheels}'",
    ),
    Check.LASTING_EXCESS: (
        "speed per {unit_command} above the other {wheels}', over the mission",
        "the speed of {part} per {unit_command} is {value} the other {wheels}' over the mission",
    ),
    Check.PLANT_RESPONSE: (
        "speed per {unit_command} against that of the machine file's [plant], over the mission",
        "the speed of {part} per {unit_command} is off that of [plant] in the machine file by a {value} over the mission",
    ),
    Check.SAME_SIDE: (
        "speed per {unit_command} against the other {wheel} of its side, for 3 s",
        "the speed of {part} per {unit_command} departs from that of the other {wheel} of its side by a {value}",
    ),
    Check.OPENING_OFFSET: (
        "{unit_command} at a speed against the other {wheels}'",
        "{part} is told {value} of full {unit_command} more or less than the other {wheels} at the same speed",
    ),
    Check.EFFORT: (
        "effort against what the motion takes, beside the other {wheels}'",
        "the effort of {part} is off what its motion takes, beside the other {wheels}', by {value} of it",
    ),
    Check.CARRIED: (
        "share of the speed that the ground gives a {wheel} whose {valve} is dead",
        "the ground carries {part}: by the model of the {wheels} ([plant], or this mission's own) a dead {valve} would leave it {value} of its speed",
    ),
    Check.BEHIND: (
        "what lies behind a {valve} that does as it is told",
        "the speed of {part} does not follow its {unit_command}, so that nothing tells what lies behind its {valve}, such as a brake that drags",
    ),
    Check.TRACKING: (
        "error of tracking, less that of the other {wheels}",
        "the error of {part} against its commanded speed exceeds the other {wheels}' by {value} of that speed",
    ),
    Check.ROUGHNESS: (
        "quick changes of the speed",
        "the speed of {part} changes quickly, in the mean of 3 s by {value} of itself",
    ),
    Check.DELAY: (
        "delay against the other {wheels}",
        "the speed of {part} comes {value} later than the other {wheels}'",
    ),
    Check.STILL: (
        "{valve} command while the axle stands still",
        "the {part} axle stands still while its {valve} is commanded to {value}{percent}",
    ),
    Check.RATE: (
        "steering rate per {unit_command} against the axle's usual one",
        "the steering rate of the {part} axle per {unit_command} is off its usual one by a {value}",
    ),
    Check.LASTING_RATE: (
        "steering rate per {unit_command} against the other axle, over the mission",
        "the steering rate of the {part} axle per {unit_command} is off the other axle's by a {value} over the mission",
    ),
    Check.PLANT_RATE: (
        "steering rate per {unit_command} against that of the machine file's [steering], over the mission",
        "the steering rate of the {part} axle per {unit_command} is off that of [steering] in the machine file by a {value} over the mission",
    ),
    Check.YAW: (
        "yaw rate against that by the steering angles, for 3 s",
        "the machine turns as if the {part} axle were {value} off its measured angle",
    ),
    Check.LASTING_YAW: (
        "yaw rate against that by the steering angles, over the mission",
        "the machine turns as if the {part} axle were {value} off its measured angle over the mission",
    ),
    Check.ANGLE_SCALE: (
        "what tells the scale of the angle",
        "nothing in this log tells whether the angle of the {part} axle is as large as it reads: its loop holds a wrong reading at its command",
    ),
    Check.COMMANDED_ANGLE: (
        "angle against its command while the {valve} rests",
        "the angle of the {part} axle is {value} off its command while its {valve} is told to rest",
    ),
    Check.UNSTEERED: (
        "share of the mission, up to its end, in which the axle is not steered",
        "the {part} axle was not steered in the last {value} of the mission, so that a fault of its sensor or {valve} that began there would not show",
    ),
    Check.JUMP: (
        "jumps of the angle",
        "the angle of the {part} axle jumps by {value}, quicker than it can be steered",
    ),
}


#: The same of a steering rate that changes from one part of the mission to another.
_RATE_CHANGES = "the steering rate of the {part} axle per {unit_command} changes by a {value} in the mission"

#: Share of a window that a fault must cover to explain what deviates over it: means of less are no total loss.
MAY_EXPLAIN = 1 / 3
_AFTER_S = (0.5, 3.0)  # of a fault, in which it still shows, at least and at most
#: Checks whose values and limits are natural logarithms of a ratio: how far below another it is, how far above, or either.
_BELOW = (Check.RESPONSE, Check.LASTING_RESPONSE)
_ABOVE = (Check.EXCESS, Check.LASTING_EXCESS)
_EITHER_WAY = (Check.CHANGE, Check.SAME_SIDE, Check.RATE, Check.LASTING_RATE, Check.PLANT_RATE, Check.PLANT_RESPONSE)


@dataclass(frozen=True)
class Checked:
    """One check of one part.

    Attributes
    ----------
    kind, component, side
        The part; the union where the check does not tell its sides apart.
    check : Check
        What was asked.
    worst : float or None
        Largest value [1, seconds for `Check.DELAY`, radians for the yaw rate, jumps and commanded angles; natural logarithm of the ratio for speeds and
        steering rates per opening]; None: the mission does not show it.
    limit : float
        From here on the part is not cleared.
    start_s, stop_s : float or None
        Where it is largest [s]; None: over the whole mission.
    shows : float or None
        Smallest loss [1] that would have been beyond the limit with 95 %, by how the mission's other windows vary: for three
        seconds, or for the whole mission where the check is of that. None: the check is not of a loss, or shows nothing.
    words : MachineWords
        How to speak of the machine.
    """

    kind: Kind
    component: str
    side: Side
    check: Check
    worst: float | None
    limit: float
    start_s: float | None = None
    stop_s: float | None = None
    shows: float | None = None
    words: MachineWords = HYDRAULIC

    @property
    def asked(self) -> str:
        """What the check compares."""
        return self.words.fill(CHECK_WORDS[self.check][0])

    @property
    def passed(self) -> bool:
        """Whether a fault of the size that counts would have been beyond the limit, and nothing is."""
        return self.worst is not None and self.worst < self.limit

    @property
    def text(self) -> str:
        """Why it does not clear the part; empty where it does."""
        if self.passed:
            return ""
        words = self.words.part_words(self.kind, self.component, self.side)
        if self.worst is None and self.check not in (Check.BEHIND, Check.ANGLE_SCALE):
            return f"{words}: this mission leaves the check “{self.asked}” open"
        two = self.check in (Check.SECOND_MEASUREMENT, Check.JITTER)
        value = "" if self.worst is None else self._value
        changes = self.check is Check.RATE and self.start_s is None
        said = self.words.fill(_RATE_CHANGES if changes else CHECK_WORDS[self.check][1])
        said = said.format(part=words if two else self.component, value=value)
        return said + (f" at {self.start_s:.1f}–{self.stop_s:.1f} s" if self.start_s is not None else "")

    @property
    def _value(self) -> str:
        assert self.worst is not None
        size = size_words(self.check, self.worst)
        size = "less than 1 %" if size == "0 %" else size  # "0 % below" says nothing
        if self.check is Check.STILL:
            return size.removesuffix(" %")
        side = " below" if self.check in _BELOW else " above" if self.check in _ABOVE and size.endswith("%") else ""
        return size + side


def after_s(start_s: float, stop_s: float) -> float:
    """How long a fault still shows after its end [s]: what a loop has wound up in it takes as long to unwind, at most. Both in s."""
    least, most = _AFTER_S
    return min(max(stop_s - start_s, least), most)


def share_covered(start_s: float, stop_s: float, fault: tuple[float, float]) -> float:
    """Share of the window of a check [1] in which a fault lasts, or has just ended and still shows; all times in s."""
    inside = min(stop_s, fault[1] + after_s(*fault)) - max(start_s, fault[0])
    return max(0.0, inside) / max(stop_s - start_s, 1e-9)


def lasts_in(start_s: float, stop_s: float, fault: tuple[float, float]) -> bool:
    """Whether a fault lasts for a good part of the window of a check, rather than having ended before; all times in s."""
    inside = min(stop_s, fault[1]) - max(start_s, fault[0])
    return inside >= MAY_EXPLAIN * (stop_s - start_s)


def size_words(check: str, value: float) -> str:
    """A value of a check in words: ``37 %``, ``3.2 times``, ``factor of 1.6``, ``0.25 s``, ``4.0°``.

    Parameters
    ----------
    check : str
        Which check.
    value : float
        Of it, or its limit, as `Checked.worst` has it.
    """
    if check in (Check.YAW, Check.LASTING_YAW, Check.JUMP, Check.COMMANDED_ANGLE):
        return f"{math.degrees(value):.1f}°"
    if check == Check.DELAY:
        return f"{value:.2f} s"
    if check in _EITHER_WAY:
        return f"factor of {_ratio_words(value)}"
    if check in _ABOVE and value >= math.log(2.0):
        return f"{_ratio_words(value)} times"
    share = -math.expm1(-value) if check in _BELOW else math.expm1(value) if check in _ABOVE else value
    most = 0.99 if check in _BELOW else 9.99
    return f"over {100 * most:.0f} %" if share > most else f"{100 * share:.0f} %"


def _ratio_words(log: float) -> str:
    """A ratio by its natural logarithm."""
    ratio = math.exp(min(log, math.log(100.0)))
    return "over 100" if ratio >= 99.5 else f"{ratio:.1f}" if ratio >= 2.0 else f"{ratio:.2f}"


def clearing_rows(checks: Sequence[Checked]) -> list[ClearingRow]:
    """The checks for ``report.json``."""
    return [
        {
            "component": c.component,
            "side": c.side,
            "check": c.check,
            "asked": c.asked,
            "worst": c.worst,
            "limit": c.limit,
            "start_s": c.start_s,
            "stop_s": c.stop_s,
            "shows": c.shows,
            "passed": c.passed,
            "text": c.text,
        }
        for c in checks
    ]
