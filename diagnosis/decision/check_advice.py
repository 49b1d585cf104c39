"""What somebody does about a check of the all-clear that is open."""

from __future__ import annotations

from collections.abc import Collection

from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

STEER = "steer from stop to stop twice at standstill, and watch whether the axle follows"
_STEERED = (Check.STILL, Check.RATE, Check.LASTING_RATE)
TURNED = (Check.YAW, Check.LASTING_YAW)
#: Of parts of which both measurements are in the log: which of them is right, they do not tell.
COMPARE = "compare both measurements of each with a third one, such as a hand tachometer or a protractor"


def act_of(check: Checked, twice: Collection[str]) -> str:
    """What shows whether a part is sound that a check does not clear, to follow *to clear it*.

    Parameters
    ----------
    check : Checked
        The check.
    twice : Collection[str]
        Components with a second measurement of their speed or angle in the log.
    """
    words: MachineWords = check.words
    if check.check in TURNED:
        return "set the axles straight, compare their angles with the marks on the machine, and drive ten seconds straight ahead"
    if check.check is Check.ANGLE_SCALE:
        return words.fill(
            f"log steer.{check.component}.u (the {{valve}} command), steer.{check.component}.phi_true (a second angle) or imu.yaw_rate"
        )
    if check.check is Check.COMMANDED_ANGLE:
        return f"steer to both stops and straight ahead, and compare steer.{check.component}.phi in the log with what the loop reads and with a protractor"
    if check.check is Check.UNSTEERED:
        return "record a mission in which it is steered to both sides until shortly before the end"
    if check.check is Check.PLANT_RATE and check.worst is None:
        return (
            "run `mfhca fit` on healthy missions, and diagnose with the file that it writes (-m), or log "
            f"steer.{check.component}.phi_true and .u_applied (second measurements)"
        )
    if check.check in (Check.SECOND_MEASUREMENT, Check.JITTER) and check.worst is not None:
        return _third_one(check, words)
    if check.check in _STEERED or check.kind == Kind.STEER:
        return STEER
    if check.check is Check.CARRIED:
        return (
            f"log wheel.*.u_applied (the {words.drive}'s own measurement), or lift the machine, give every {words.part} the same "
            "command for 10 s, and diagnose that log"
        )
    if check.check is Check.EFFORT:
        return words.fill(
            "lift the machine, give every {wheel} the same command for 10 s, and compare the currents of their {valve}s; then turn every {wheel} by hand with the brakes released"
        )
    if check.check is Check.BEHIND:
        return (
            f"lift the machine, release the brakes and turn every {words.part} by hand; no log of these "
            "signals clears this"
        )
    if check.check is Check.ROUGHNESS and check.worst is not None:
        return words.fill(
            "check the connector, the cable and the target of the {wheel.sensor}, and drive the same again"
        ) + ("" if check.component in twice else "; a log with wheel.*.v_true (a second speed) settles it")
    if check.worst is None:
        return f"move all {words.parts} together at one steady speed for at least 10 s, and diagnose that log"
    lifted = f"lift the machine, give every {words.part} the same command for 10 s, and compare their speeds with a hand tachometer"
    return lifted if check.component in twice else f"{lifted}; a log with wheel.*.v_true (a second speed) settles it"


def _third_one(check: Checked, words: MachineWords) -> str:
    """What tells which of two measurements of a part is off; of a drive the one is its command."""
    if check.side is Side.ACTUATOR:
        return words.fill(
            "with the machine secured, give the {valve} a few steady commands and compare each with the {position}, then repair what is off: "
            "the {valve}, or what measures it"
        )
    if check.kind == Kind.STEER:
        return "compare both angles with a protractor at both stops and straight ahead, then repair or rescale the one that is off"
    return "compare both measurements at one steady speed with a third one, such as a hand tachometer, then repair or rescale the one that is off"
