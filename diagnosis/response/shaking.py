"""Whether something else shakes while a sensor reads noise: then the wheel may really shake, and the side is open.

A drive that shakes its wheel shows in its effort, or in the yaw rate; so does a noisy sensor, by the loop that is closed around it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.wheel import SENSOR_SHARE
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

_ROUGHER = 2.5  # times what changes from reading to reading at other times
_LEAST_INSIDE, _LEAST_OUTSIDE = 8, 40  # readings


def shaken(found: Finding, one: Judged) -> Finding:
    """A finding, with its side left open where it is noise and effort or yaw rate are rougher at its time, too.

    Parameters
    ----------
    found : Finding
        Of the wheel; steps of the timeline.
    one : Judged
        The wheel.
    """
    if found.mode is not FaultMode.NOISY or found.side is not Side.SENSOR:
        return found
    step = one.wheel.samples.step
    channels = (("the effort of its drive", one.data.effort), ("the measured yaw rate", one.yaw))
    rough = [name for name, x in channels if x is not None and _rougher(x[step], step, found)]
    if not rough:
        return found
    p = min(1.0, found.probability / SENSOR_SHARE)
    both, mode = Side.SENSOR_OR_ACTUATOR, found.mode
    text = (
        f"At that time {' and '.join(rough)} {'changes' if len(rough) == 1 else 'change'} from reading to reading as {'it does' if len(rough) == 1 else 'they do'} not otherwise: "
        "a {wheel} that really shakes and a noisy sensor in its loop cannot be distinguished."
    )
    hypotheses = (Hypothesis(both.value, mode.value, p), Hypothesis("none", State.HEALTHY.value, 1.0 - p))
    evidence = (*(x.replace("; the inertia of a {wheel} forbids that.", ".") for x in found.evidence), text)
    return replace(found, side=both, probability=p, hypotheses=hypotheses, evidence=evidence)


def _rougher(x: Array, step: NDArray[np.intp], found: Finding) -> bool:
    """Whether second differences of readings, shape (m,), are larger in a finding's steps than outside of them."""
    white = np.full(x.size, np.nan)
    white[1:-1] = x[2:] - 2.0 * x[1:-1] + x[:-2]
    known = np.isfinite(white)
    inside = (step >= found.start) & (step < found.stop)
    within, others = white[known & inside], white[known & ~inside]
    if within.size < _LEAST_INSIDE or others.size < _LEAST_OUTSIDE:
        return False
    return bool(np.sqrt(np.mean(within**2)) > _ROUGHER * np.sqrt(np.mean(others**2)))
