"""A wheel whose valve is known to fail: it stands, is dragged or slips, so that its sensor may well read what seems wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.limited import limited
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Tier
from replay.faults import Side

#: A component and its side.
Part = tuple[str, str]

_SURE = 0.9  # of the valve's fault
_MOST = 0.65  # of a fault of the sensor beside it; set by hand, not calibrated
_INSIDE = 0.5  # of its time
_SAME = 1e-9  # m/s
_WHY = "Meanwhile the {valve} of this {wheel} does not answer: the {wheel} may stand, be dragged or slip, which makes the fault less probable."


def less_sure_beside_dead_valves(
    assessments: Mapping[Part, Assessment], wheels: Sequence[str], words: MachineWords
) -> dict[Part, Assessment]:
    """Assessments in which faults of sensors that no second sensor shows are less sure while their wheels' valves do not answer.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    wheels : Sequence[str]
        Names of the machine's wheels.
    words : MachineWords
        How to speak of the machine.
    """
    out = dict(assessments)
    for wheel in wheels:
        sensor, valve = (wheel, Side.SENSOR.value), (wheel, Side.ACTUATOR.value)
        if sensor not in out or valve not in out:
            continue
        dead = [f for f in out[valve].findings if _dead(f)]
        if dead and out[sensor].findings:
            told = tuple(limited(f, _MOST, words.fill(_WHY)) if _doubtful(f, dead) else f for f in out[sensor].findings)
            out[sensor] = replace(out[sensor], findings=told)
    return out


def _dead(f: Finding) -> bool:
    return f.side is Side.ACTUATOR and f.mode.total and f.probability >= _SURE


def _constant(f: Finding) -> bool:
    """Whether a reading stays at one value to the last digit, as no wheel does that is dragged."""
    return f.mode.total and f.sat is not None and abs(f.sat.rms - abs(f.sat.mean)) <= _SAME


def _doubtful(f: Finding, dead: Sequence[Finding]) -> bool:
    if f.tier is Tier.DIRECT or f.side is not Side.SENSOR or _constant(f):
        return False
    return any(min(f.stop, d.stop) - max(f.start, d.start) > _INSIDE * (f.stop - f.start) for d in dead)
