"""A wheel with everything that its findings are made from, and a finding that is its sensor's or its drive's by a share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples
from diagnosis.response.jumps import Jumps
from diagnosis.response.models import Blocks
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

SENSOR_SHARE = 0.96  # that what a channel alone shows is the sensor's
EITHER = 0.6  # that it is the sensor's, up to which its side is left open
_SHARP_S = 0.012  # between readings: a wheel that jams, or comes free, takes longer


class Wheel(NamedTuple):
    """A wheel with everything that its findings are made from.

    Attributes
    ----------
    name : str
        Of its channel.
    samples, blocks, jumps
        Its readings, by blocks, and where they jump.
    dt : float
        Step of the timeline [s].
    compared : str
        Channels that show the same speed, in words; empty where there are none.
    habit : float
        How long healthy channels of this machine stay at one value [s].
    own : bool
        Whether those channels show how this wheel itself turns; others only how it should.
    pull : Array or None, shape (b,)
        Effort of its drive by its share of the load [1]; NaN where nothing is pulled, None where it is not logged.
    spiky : bool
        Whether single readings are far off more often than those of the other wheels.
    lone : bool
        Whether nothing but this wheel moves its side of the machine.
    """

    name: str
    samples: Samples
    blocks: Blocks
    jumps: Jumps
    dt: float
    compared: str
    habit: float = 0.0
    own: bool = False
    pull: Array | None = None
    spiky: bool = True
    lone: bool = False

    @property
    def sharp(self) -> bool:
        """Whether readings follow each other so fast that a jump between two of them is none that a drive could make."""
        step = self.samples.step
        return step.size > 1 and float(np.median(np.diff(step))) * self.dt <= _SHARP_S


def sensor_finding(
    start: int,
    stop: int,
    mode: FaultMode,
    p: float,
    epsilon: Epsilon | None,
    sat: Sat | None,
    evidence: tuple[str, ...],
    sensor: float = 1.0,
) -> Finding:
    """A finding with probability p of any fault, of which `sensor` is the sensor's share."""
    side = Side.SENSOR if sensor > EITHER else Side.ACTUATOR if sensor < 1.0 - EITHER else Side.SENSOR_OR_ACTUATOR
    share = {Side.SENSOR: sensor, Side.ACTUATOR: 1.0 - sensor}.get(side, 1.0)
    other = Side.ACTUATOR if side is Side.SENSOR else Side.SENSOR
    stated = p * share
    rest = (Hypothesis(other.value, mode.value, p - stated),) if p > stated else ()
    return Finding(
        start=start,
        stop=stop,
        side=side,
        mode=mode,
        probability=stated,
        hypotheses=(
            Hypothesis(side.value, mode.value, stated),
            *rest,
            Hypothesis("none", State.HEALTHY.value, 1.0 - p),
        ),
        epsilon=epsilon,
        sat=sat,
        evidence=evidence,
        tier=Tier.RESPONSE,
    )
