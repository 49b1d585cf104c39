"""What departs slowly is no noise.

A gain that creeps, a second measurement that wanders, and wheels that creep differ from a healthy channel by more than its noise;
the noisy row, whose disturbance may walk, adopts them all. Noise of a sensor changes from reading to reading, so that means over
a quarter of a second keep little of it. Of valves this tells nothing: their disturbance is slow by nature.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

_WINDOW_S, _READINGS = 0.25, 5.0  # of a mean, at least so many readings
_FEW_WINDOWS = 6
_SLOW = (
    0.7  # of the power, from which on it is no noise: sensors' noise of other machines keeps .54 at most, tuning seeds
)
_P, _NOISY_P = 0.6, 0.1  # of what no row explains, and of noise: it may as well be the reference that departs
_SENTENCE = "It departs slowly: means over {0:.2f} s keep {1:.0f} % of what a gain and an offset leave, of noise they keep little."


def not_noise(finding: Finding, measured: Measured, hold: float) -> Finding:
    """A finding of a sensor's noise, as one that no row explains where it departs slowly.

    Parameters
    ----------
    finding : Finding
        Any; those of other rows and of valves stay as they are.
    measured : Measured
        The channel beside its reference.
    hold : float
        Time for which either of them holds a value [s].
    """
    if finding.mode is not FaultMode.NOISY or finding.side is not Side.SENSOR or finding.probability <= _P:
        return finding
    span = slice(finding.start, finding.stop)
    use = measured.use[span] & np.isfinite(measured.y[span]) & np.isfinite(measured.x[span])
    width = max(1, round(max(_WINDOW_S, _READINGS * max(hold, measured.dt)) / measured.dt))
    kept = slow_share(measured.y[span][use], measured.x[span][use], width)
    if kept is None or kept < _SLOW:
        return finding
    side = finding.side.value
    hypotheses = (
        Hypothesis(side, FaultMode.OUTSIDE_TABLE.value, _P),
        Hypothesis(side, "healthy", 1.0 - _P - _NOISY_P),
        Hypothesis(side, FaultMode.NOISY.value, _NOISY_P),
    )
    return replace(
        finding,
        mode=FaultMode.OUTSIDE_TABLE,
        probability=_P,
        hypotheses=hypotheses,
        evidence=(_SENTENCE.format(width * measured.dt, 100.0 * kept), *finding.evidence),
    )


def slow_share(y: Array, x: Array, width: int) -> float | None:
    """Share of what a gain and an offset leave of y beside x, both of shape (n,), that means over `width` samples keep; None if too short."""
    count = y.size // width
    if count < _FEW_WINDOWS:
        return None
    beside = np.column_stack([x, np.ones(x.size)])
    left = y - beside @ np.linalg.lstsq(beside, y, rcond=None)[0]
    power = float(np.mean(left**2))
    return (
        float(np.mean(left[: count * width].reshape(count, width).mean(axis=1) ** 2)) / power if power > 0.0 else None
    )
