"""Faults of wheels that a fault of another part may have made up: they are told, but less surely, while that lasts.

A steering angle that is wrong makes every model of the wheels err; a valve that does not answer lets its wheel stand, be dragged or
slip, so that its sensor may well read what seems wrong; behind a speed sensor that gives nothing the controller opens the valve
further and further, which all other wheels feel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.limited import limited, not_worth_a_check
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

#: A component and its side.
Part = tuple[str, str]

_SURE = 0.9  # of a valve's fault
#: Of what lies beside another fault. Beside wrong angles partial faults were right as often as that; else set by hand.
_MOST = 0.65
_INSIDE = 0.5  # of its time
_SAME = 1e-9  # m/s
_ANGLE = "Meanwhile a steering sensor fails, or may, from whose angle follows what this part should do, which makes the fault less probable."
_VALVE = "Meanwhile the {valve} of this {wheel} does not answer: the {wheel} may stand, be dragged or slip, which makes the fault less probable."
_OTHER_VALVE = (
    "Meanwhile the {valve} of another {wheel} does not answer: the others drag that {wheel} along, or it pulls them, which makes the fault less "
    "probable."
)
_SENSOR = (
    "Meanwhile the speed sensor of another {wheel} gives no speed, so that its controller drives it on, pulls the machine and takes the "
    "others' supply, which makes the fault less probable."
)


def less_sure_beside_wrong_angles(
    assessments: Mapping[Part, Assessment], wheels: Sequence[str], axles: Sequence[str]
) -> dict[Part, Assessment]:
    """Assessments in which partial faults of wheels that only a model shows are less sure while a steering angle is, or may be, wrong.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    wheels, axles : Sequence[str]
        Names of the machine's parts.
    """
    wrong = [f for a in axles for f in _findings(assessments, (a, Side.SENSOR.value))]

    def doubtful(f: Finding) -> bool:
        return (
            f.tier in (Tier.MODEL, Tier.RESPONSE) and not f.mode.total and not f.mode.varying
        )  # nothing dies or shakes by a wrong angle

    return _less_sure(assessments, _sides(wheels), lambda part: wrong, doubtful, _ANGLE)


def less_sure_beside_dead_valves(
    assessments: Mapping[Part, Assessment], wheels: Sequence[str], words: MachineWords
) -> dict[Part, Assessment]:
    """Assessments in which faults are less sure while a wheel's valve does not answer.

    Those of its own sensor that no second sensor shows; and partial ones of other wheels, but of their sensors alone, that only a model shows: right
    were 0 of 11 on simulated machines.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    wheels : Sequence[str]
        Names of the machine's wheels.
    words : MachineWords
        How to speak of the machine.
    """

    def dead(part: Part) -> list[Finding]:
        valve = _findings(assessments, (part[0], Side.ACTUATOR.value))
        return [f for f in valve if f.side is Side.ACTUATOR and f.mode.total and f.probability >= _SURE]

    def doubtful(f: Finding) -> bool:
        return f.tier is not Tier.DIRECT and f.side is Side.SENSOR and not _constant(f)

    def others(part: Part) -> list[Finding]:
        return [f for wheel in wheels if wheel != part[0] for f in dead((wheel, Side.ACTUATOR.value))]

    def dragged(f: Finding) -> bool:
        return _partial_by_model(f) and f.side is not Side.SENSOR

    own = _less_sure(assessments, [(w, Side.SENSOR.value) for w in wheels], dead, doubtful, words.fill(_VALVE))
    return _less_sure(own, _sides(wheels), others, dragged, words.fill(_OTHER_VALVE), made_up=True)


def less_sure_beside_dead_sensors(
    assessments: Mapping[Part, Assessment], wheels: Sequence[str], words: MachineWords
) -> dict[Part, Assessment]:
    """Assessments in which partial faults of wheels that only a model shows are less sure while another wheel's sensor is dead or stuck, or leaps about.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    wheels : Sequence[str]
        Names of the machine's wheels.
    words : MachineWords
        How to speak of the machine.
    """
    sensors = {w: _findings(assessments, (w, Side.SENSOR.value)) for w in wheels}
    dead = {w: [f for f in found if f.side is Side.SENSOR and _gives_no_speed(f)] for w, found in sensors.items()}

    def others(part: Part) -> list[Finding]:
        return [f for wheel, found in dead.items() if wheel != part[0] for f in found]

    why = words.fill(_SENSOR)
    told = _less_sure(assessments, _sides(wheels), others, _partial_by_model, why)

    def sure(part: Part) -> list[Finding]:
        return [f for f in others(part) if f.probability >= _SURE]

    return _less_sure(told, _sides(wheels), sure, _partial_by_model, why, made_up=True)


def _less_sure(
    assessments: Mapping[Part, Assessment],
    parts: Iterable[Part],
    causes: Callable[[Part], Sequence[Finding]],
    doubtful: Callable[[Finding], bool],
    why: str,
    *,
    made_up: bool = False,
) -> dict[Part, Assessment]:
    """Assessments in which doubtful findings of parts are limited where they lie for the most part within one of its causes.

    `made_up`: any fault is, rather than the row alone.
    """
    out = dict(assessments)
    for part in parts:
        by = causes(part)
        found = _findings(assessments, part)
        less = [doubtful(f) and _within(f, by) for f in found]
        if any(less):
            told = tuple(_limited(f, why, made_up=made_up) if x else f for f, x in zip(found, less, strict=True))
            out[part] = replace(assessments[part], findings=told)
    return out


def _limited(f: Finding, why: str, *, made_up: bool) -> Finding:
    if not made_up:
        return limited(f, _MOST, why)
    fewer = replace(f, evidence=tuple(text for text in f.evidence if text != why))
    less = not_worth_a_check(fewer, why)
    return f if less is fewer else less


def _partial_by_model(f: Finding) -> bool:
    return f.tier is Tier.MODEL and not f.mode.total


def _gives_no_speed(f: Finding) -> bool:
    """Whether a controller has no speed to hold: a sensor is dead or stuck, or what it reads leaps about by itself."""
    return f.mode.total or (f.mode is FaultMode.NOISY and f.probability >= _SURE)


def _within(f: Finding, causes: Sequence[Finding]) -> bool:
    return any(min(f.stop, c.stop) - max(f.start, c.start) > _INSIDE * (f.stop - f.start) for c in causes)


def _constant(f: Finding) -> bool:
    """Whether a reading stays at one value to the last digit, as no wheel does that is dragged."""
    return f.mode.total and f.sat is not None and abs(f.sat.rms - abs(f.sat.mean)) <= _SAME


def _sides(wheels: Sequence[str]) -> list[Part]:
    return [(wheel, side.value) for wheel in wheels for side in (Side.SENSOR, Side.ACTUATOR)]


def _findings(assessments: Mapping[Part, Assessment], part: Part) -> tuple[Finding, ...]:
    return assessments[part].findings if part in assessments else ()
