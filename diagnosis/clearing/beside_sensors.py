"""Wheels beside one whose speed sensor gives nothing: its controller opens the valve further and further, which all others feel."""

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

_MOST = 0.65  # of a partial fault of another wheel that only a model shows; set by hand, not calibrated
_INSIDE = 0.5  # of its time
_WHY = (
    "Meanwhile the speed sensor of another {wheel} gives no speed, so that its controller drives it on, pulls the machine and takes the "
    "others' supply, which makes the fault less probable."
)


def less_sure_beside_dead_sensors(
    assessments: Mapping[Part, Assessment], wheels: Sequence[str], words: MachineWords
) -> dict[Part, Assessment]:
    """Assessments in which partial faults of wheels that only a model shows are less sure while another wheel's sensor is dead or stuck.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    wheels : Sequence[str]
        Names of the machine's wheels.
    words : MachineWords
        How to speak of the machine.
    """
    dead = {
        wheel: [f for f in assessments[wheel, Side.SENSOR.value].findings if f.side is Side.SENSOR and f.mode.total]
        for wheel in wheels
        if (wheel, Side.SENSOR.value) in assessments
    }
    out = dict(assessments)
    for (wheel, side), a in assessments.items():
        beside = [f for other, fs in dead.items() if other != wheel for f in fs]
        if wheel in wheels and any(_doubtful(f, beside) for f in a.findings):
            told = tuple(limited(f, _MOST, words.fill(_WHY)) if _doubtful(f, beside) else f for f in a.findings)
            out[wheel, side] = replace(a, findings=told)
    return out


def _doubtful(f: Finding, dead: Sequence[Finding]) -> bool:
    if f.tier is not Tier.MODEL or f.mode.total:
        return False
    return any(min(f.stop, d.stop) - max(f.start, d.start) > _INSIDE * (f.stop - f.start) for d in dead)
