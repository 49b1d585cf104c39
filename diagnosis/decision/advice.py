"""What a technician can do about a part: connector, supply, swap test, expected value and tool, by part and fault row.

The machine file's own instructions (``[advice]``) take the place of these. Values that a data sheet gives are named as such:
the tool does not know them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Kind
from replay.faults import FaultMode, Side

_MAY_BE = 0.15  # probability of a row of the other part that is worth a check
_STUCK, _NO_SIGNAL, _INEFFICIENT, _NOISY = (
    FaultMode.STUCK,
    FaultMode.NO_SIGNAL,
    FaultMode.INEFFICIENT,
    FaultMode.NOISY,
)
_PLUG = "Unplug the connector and look for water, corrosion and bent pins."
_SUPPLY = "Measure the supply at the plug with a multimeter: expected the rated voltage within 10 %."
_CABLE = "Measure each wire's continuity: expected below 1 Ω, and no connection to ground."
_SWAP_SENSOR = (
    "Swap test: exchange the sensor itself with that of another {place}, while the cables stay; if the other {place} is then the faulty one, "
    "replace the sensor; if this one still is, repair the cable or the controller's input."
)
_SWAP_PLUG = (
    "Swap test, with the machine secured: exchange the plug alone with that of another valve of the type, while the valves stay; if the other "
    "{place} is then the faulty one, repair cable or controller output; if this one still is, the valve."
)
_SWAP_MOTOR = (
    "Swap test, with the supply off: exchange the cables alone with those of another motor of the type, while the motors stay; if the other "
    "{place} is then the faulty one, repair the controller; if this one still is, motor, gear or brake."
)

_SENSOR: Mapping[FaultMode, str] = {
    _STUCK: f"{{turn}}: the reading must follow, and come to rest with it. If it does not, check the sensor's coupling or target. {_PLUG} "
    f"{_SWAP_SENSOR}",
    _NO_SIGNAL: f"{_PLUG} {_SUPPLY} {_CABLE} {_SWAP_SENSOR}",
    _INEFFICIENT: "Compare the reading with {reference}: expected within 2 %. Measure the gap between sensor and target with a feeler "
    "gauge (data sheet), and check its mount and the scaling in the controller. " + _SWAP_SENSOR,
    _NOISY: "Watch the reading while moving cable and plug by hand: it must stay calm. Check that the shield is connected at one end, and "
    "with an oscilloscope that the supply's ripple is below 5 %. " + _SWAP_SENSOR,
}
_VALVE: Mapping[FaultMode, str] = {
    _STUCK: "With the pressure off, actuate the valve's manual override: the spool must move freely and return. Unplug the coil: the valve "
    f"must go to neutral. Check the oil filter. {_SWAP_PLUG}",
    _NO_SIGNAL: f"{_PLUG} Measure the coil's resistance with a multimeter: expected the data sheet's value, and within 10 % of the other "
    f"valves'. Measure its current at half command with a clamp meter: expected half of the rated one. {_SWAP_PLUG}",
    _INEFFICIENT: "Measure the pressure at ports A and B with a gauge at half command: expected within 10 % of the other {place}s'. Then "
    "check the oil filter, the spool's travel, and internal leakage; where a position is logged, hold the travel against it, for its sensor may read "
    f"wrong. {_SWAP_PLUG}",
    _NOISY: "Move the command's cable and plug by hand while watching the valve. Check with an oscilloscope that the command is calm and the "
    f"dither as set, and vent the pilot. {_SWAP_PLUG}",
}
_MOTOR: Mapping[FaultMode, str] = {
    _STUCK: f"With the supply off and the brake released, turn the {{part}} by hand: it must turn freely; else check brake, gear and bearings. "
    f"Read the motor controller's fault memory. {_SWAP_MOTOR}",
    _NO_SIGNAL: "Read the motor controller's fault memory; check fuse, enable signal and emergency stop. Measure its supply with a multimeter: "
    f"expected the rated voltage within 10 %, also under load. Measure the windings: expected equal within 5 %. {_SWAP_MOTOR}",
    _INEFFICIENT: "Measure the motor's current at a constant speed with a clamp meter: expected within 20 % of the other motors' under the same "
    f"load. Check the supply under load, the current limit, whether the brake drags, and the gear. {_SWAP_MOTOR}",
    _NOISY: "Move the motor's and encoder's plugs by hand while it runs slowly. Check coupling and gear for play, the shields, and with an "
    f"oscilloscope that the command is calm. {_SWAP_MOTOR}",
}
_DRIVE: Mapping[FaultMode, str] = {
    _STUCK: "With the supply off, move the {part} by hand or by the manual override: it must move freely. Read the controller's fault memory. "
    f"{_PLUG}",
    _NO_SIGNAL: f"Check fuse, enable signal and emergency stop. {_PLUG} {_SUPPLY} Command it slowly and measure the command at the plug: it must "
    "follow. Swap test: exchange the plug with that of another drive of the type.",
    _INEFFICIENT: "Compare current or pressure at a constant speed with the other drives': expected within 20 %. Check supply, brake and gear.",
    _NOISY: "Move the command's cable and plug by hand while the drive runs slowly, and check its shield. Check coupling and gear for play.",
}
_ACTUATOR = {"valve": _VALVE, "motor": _MOTOR, "drive": _DRIVE}
_GAIN = (
    "Compare scaling and sign of the channel in controller and machine file. Then compare the reading with {reference}: expected "
    "within 2 %."
)
_ZERO = (
    "Command it to its middle, and to a third of its range both ways, and compare its position with the command: expected within 3 % of full "
    "opening. Then compare zero, scaling and sign of the command and of the position in controller and machine file, and adjust the {valve}'s zero."
)
_EITHER = (
    "First tell the two apart: command a slow motion and watch the {part}. If it moves and the reading does not follow, the sensor is "
    "faulty; if it does not move, the {valve} is. "
)


def check_of_all(
    kind: Kind,
    component: str,
    side: Side,
    mode: FaultMode,
    hypotheses: Sequence[Hypothesis],
    words: MachineWords,
    own: Mapping[str, str] | None = None,
) -> str:
    """How to check one part with one fault, and then the other part where that may well be the faulty one.

    Parameters
    ----------
    kind, component, side, mode, words, own
        As for `check_of`.
    hypotheses : Sequence[Hypothesis]
        Its explanations with their probabilities.
    """
    first = check_of(kind, component, side, mode, words, own)
    beside = {s.value for s in Side.SENSOR_OR_ACTUATOR.sides if s not in side.sides}
    others = [h for h in hypotheses if h.side in beside and h.p >= _MAY_BE]
    if not others:
        return first
    worst = max(others, key=lambda h: h.p)
    other, p = Side(worst.side), sum(h.p for h in others if h.side == worst.side)
    name = words.part_words(kind, component, other)
    second = check_of(kind, component, other, FaultMode(worst.mode), words, own)
    return f"{first} If that is in order: the {name} may be it as well ({100 * p:.0f} %). {second}"


def check_of(
    kind: Kind, component: str, side: Side, mode: FaultMode, words: MachineWords, own: Mapping[str, str] | None = None
) -> str:
    """How to check one part with one fault.

    Parameters
    ----------
    kind, component, side, mode
        The part, and its fault row.
    words : MachineWords
        How to speak of the machine.
    own : Mapping[str, str] or None
        The machine file's ``[advice]``, by ``PART.SIDE.MODE`` or ``PART.SIDE``, with PART a wheel, joint or axle, or ``wheel`` or ``steer`` for
        all; the most specific one is given instead.
    """
    for who in (component, kind.value):
        for key in (f"{who}.{side}.{mode}", f"{who}.{side}"):
            if own and key in own:
                return own[key]
    steering = kind is Kind.STEER
    if side is Side.SENSOR_OR_ACTUATOR:
        text = _EITHER + _PLUG + " " + _SUPPLY
    elif mode not in _SENSOR:
        text = _ZERO if side is Side.ACTUATOR else _GAIN
    else:
        text = (_SENSOR if side is Side.SENSOR else _ACTUATOR[words.drive])[mode]
    part = "axle" if steering else words.part
    for key, word in (
        ("{part}", part),
        ("{place}", part),
        ("{turn}", _turn(steering, words)),
        ("{reference}", _reference(steering, words)),
    ):
        text = text.replace(key, word)
    return words.fill(text)


def _turn(steering: bool, words: MachineWords) -> str:
    """How a technician moves what the sensor measures."""
    if steering:
        return "Steer slowly from stop to stop"
    return (
        "Turn the wheel by hand, jacked up"
        if words.part == "wheel"
        else "Move the joint by hand with its brake released"
    )


def _reference(steering: bool, words: MachineWords) -> str:
    """What a technician measures a sensor against."""
    if steering:
        return "a protractor at both stops and straight ahead"
    return (
        "a hand tachometer at a constant speed"
        if words.part == "wheel"
        else "a protractor or dial gauge over a known move"
    )
