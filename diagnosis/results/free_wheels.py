"""Wheels without a drive: what is found of one is its speed sensor's, unless a brake or a bearing holds the wheel."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Hypothesis
from replay.faults import Side, State

#: That such a wheel which reads otherwise than it should is read wrong, rather than held.
ROLLS_P = 0.92
_HELD = "This {wheel} has no drive: a brake or a bearing that holds it looks the same."
_DRIVE = Side.ACTUATOR.value


def only_rolls(sensor: Assessment) -> Assessment:
    """The assessment of the speed sensor of a wheel without a drive: what would be its drive's fault is its own.

    What the body's motion confirms of a wheel, so that its drive alone could be at fault, is no fault of it.
    """
    named = [f for f in sensor.findings if f.side is not Side.ACTUATOR]
    states = sensor.states
    for f in (f for f in sensor.findings if f.side is Side.ACTUATOR):
        states = states.copy()
        states[f.start : f.stop] = CODE[State.NOT_ASSESSED]
    findings = tuple(_of_sensor(f) for f in named)
    return sensor if findings == sensor.findings else replace(sensor, findings=findings, states=states)


def _of_sensor(f: Finding) -> Finding:
    """A finding of which the share that would be the drive's is the sensor's, but for what holds the wheel."""
    if all(h.side not in (_DRIVE, Side.SENSOR_OR_ACTUATOR.value) for h in f.hypotheses):
        return f
    modes: dict[str, float] = {}
    stated = 0.0
    for h in f.hypotheses:
        if h.side == Side.SENSOR.value:
            stated += h.p
        if h.side in {side.value for side in Side}:
            modes[h.mode] = modes.get(h.mode, 0.0) + h.p
    total = sum(modes.values())
    least = max(stated, ROLLS_P * total)
    modes = {mode: p * least / total for mode, p in modes.items()} if total > 0.0 else modes
    ranked = sorted(modes.items(), key=lambda item: (item[0] != f.mode.value, -item[1]))
    hypotheses = (
        *(Hypothesis(Side.SENSOR.value, mode, p) for mode, p in ranked),
        Hypothesis("none", State.HEALTHY.value, 1.0 - least),
    )
    return replace(
        f,
        side=Side.SENSOR,
        probability=modes.get(f.mode.value, f.probability),
        hypotheses=hypotheses,
        evidence=(*f.evidence, _HELD),
    )
