"""A valve's fault that begins or ends with a jump of the angle is its sensor's: no axle turns so quickly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.angle_jumps import jumps_of, quickest_of, readings
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, Sentence
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

_EDGE_S = 0.25  # of a fault's beginning or end
_OF_LOSS = 0.5  # of what a loss makes of the angle there: a jump by as much is its own
_TOTAL = 0.03  # rad: by as much jumps an angle that nobody saw for a while, at least
_LEAST_P, _MOST_P = 0.8, 0.9  # that what jumps so is the sensor's; set by hand, not calibrated


def of_sensor(valve: Sequence[Finding], y: Array, fresh: NDArray[np.bool_], dt: float) -> list[Finding]:
    """The losses, and valves that stick or are dead, among findings that begin or end with a jump of the angle: they are the sensor's.

    One of a loss is as large as it is.

    Parameters
    ----------
    valve : Sequence[Finding]
        Of one axle.
    y, fresh, dt : of shape (n,), (n,) and s
        Its angle [rad], as of `diagnosis.estimation.angle_jumps.readings`.
    """
    losses = [f for f in valve if (f.mode is FaultMode.INEFFICIENT or f.mode.total) and f.epsilon is not None]
    quickest = quickest_of(readings(y, fresh, dt)) if losses else None
    if quickest is None:
        return []
    found = jumps_of(readings(y, fresh, dt), quickest)
    out = []
    for f in losses:
        assert f.epsilon is not None
        for edge in (f.start, f.stop):
            near = np.abs(found.at_s - edge * dt) <= _EDGE_S
            about = np.abs(y[max(0, edge - round(_EDGE_S / dt)) : edge + round(_EDGE_S / dt)])
            least = _TOTAL if f.mode.total else _OF_LOSS * f.epsilon.value * float(np.nanmax(about, initial=0.0))
            if near.any() and float(found.size[near].max()) > least:
                out.append(f)
                break
    return out


def as_sensors(finding: Finding) -> Finding:
    """A valve's fault told as its sensor's."""
    p = min(_MOST_P, max(finding.probability, _LEAST_P))
    return replace(
        finding,
        side=Side.SENSOR,
        probability=p,
        hypotheses=(
            Hypothesis(Side.SENSOR.value, finding.mode.value, p),
            Hypothesis(Side.ACTUATOR.value, finding.mode.value, (1.0 - p) / 2.0),
            Hypothesis("none", State.HEALTHY.value, (1.0 - p) / 2.0),
        ),
        evidence=(
            Sentence(
                About.ONSET,
                "The angle jumps where it begins or ends, quicker than an axle turns: it is the reading that is off.",
            ),
            *finding.evidence,
        ),
    )
