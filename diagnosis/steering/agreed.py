"""Sensor faults that a model claims of an angle while a second angle shows the same: the model misses a motion, not the sensor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.results.assessment import Finding
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.side_findings import SideFindings, span_of
from replay.faults import FaultMode, Side

_AGREE = 2.0  # times what is usual between both angles
_LEAST, _MOST = 0.004, 0.02  # rad: differences of less are none, and angles that usually differ by more tell nothing
_PLAY = 0.012  # rad, root mean square: a linkage has so much play between both angles, which shakes neither
_LEAST_USUAL_S = 5.0  # for which both must be known without a fault
_FEW = 5  # pairs of readings in a finding


def without_agreed(found: Mapping[Side, SideFindings], inputs: AxleInputs) -> dict[Side, SideFindings]:
    """Findings of both sides; those of the sensor in which the second angle shows what the first one does are left out.

    What the model did not explain stays unexplained of the valve, unless that is measured twice too; of the sensor it is refuted where
    both angles differ no more than usual, and stays unexplained where they do, by what may be play.

    Parameters
    ----------
    found : Mapping[Side, SideFindings]
        By side.
    inputs : AxleInputs
        The axle's channels.
    """
    out = dict(found)
    sensor, valve = found[Side.SENSOR], found[Side.ACTUATOR]
    if not inputs.angle_redundant or not sensor.findings or inputs.blocks is None:
        return out
    agreed = _agreed(sensor.findings, inputs)
    if not agreed:
        return out
    length = inputs.blocks.length
    out[Side.SENSOR] = sensor._replace(
        findings=tuple(f for f in sensor.findings if f not in agreed),
        unexplained=(*sensor.unexplained, *(span_of(f, length) for f, same in agreed.items() if not same)),
        refuted=(*sensor.refuted, *(span_of(f, length) for f, same in agreed.items() if same)),
    )
    if not inputs.valve_redundant:
        spans = [span_of(f, length) for f in agreed]
        out[Side.ACTUATOR] = valve._replace(unexplained=(*valve.unexplained, *spans))
    return out


def _agreed(findings: tuple[Finding, ...], inputs: AxleInputs) -> dict[Finding, bool]:
    """Findings in which both angles differ by no more than they do without any (True); noise also where only their play is between them (False)."""
    y, x = inputs.values("phi"), inputs.values("phi_true")
    use = inputs.timeline.fresh[inputs.channel("phi")] & np.isfinite(y) & np.isfinite(x)
    sound = use.copy()
    for f in findings:
        sound[f.start : f.stop] = False
    apart = y - x
    if not apart[use].any() or np.count_nonzero(sound) < max(_FEW, _LEAST_USUAL_S * use.mean() / inputs.timeline.dt):
        return {}  # a copy is no second measurement
    usual = float(np.median(apart[sound]))
    rms = float(np.sqrt(np.median((apart[sound] - usual) ** 2))) * 1.4826
    if rms > _MOST:
        return {}
    most = max(_LEAST, _AGREE * rms)
    shaken = float(np.std(np.diff(apart[sound])))

    out = {}
    for f in findings:
        part = (apart[f.start : f.stop] - usual)[use[f.start : f.stop]]
        if part.size < _FEW or f.mode is FaultMode.NO_SIGNAL:
            continue
        calm = f.mode is FaultMode.NOISY and float(np.std(np.diff(part))) <= _AGREE * shaken
        differ = float(np.sqrt(np.mean(part**2)))
        if differ <= (max(most, _PLAY) if calm else most):
            out[f] = differ <= most
    return out
