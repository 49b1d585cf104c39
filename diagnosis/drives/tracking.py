"""Command-tracking evidence: a drive of which only command and response are known.

A servo may lag its command by a second or more and may pause; it is stuck when it stops early and never moves again
while its command goes on. Whether the motor or its sensor stopped cannot be told from such a log.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum, shifted
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits

Array = NDArray[np.float64]

_MAX_LAG_S = 2.5
_MIN_STILL_S = 0.5
_MIN_REMAINING = 0.25
_MOVING = 0.1


class _Tracking(NamedTuple):
    """How a drive was commanded.

    Attributes
    ----------
    asked : Array, shape (n,)
        Commanded speed's magnitude, smoothed, delayed as the response is [m/s].
    driven : NDArray[np.bool_], shape (n,)
        Where it is commanded to move.
    last : int
        Sample after the last one at which it moved.
    lag : int
        Delay of the response [steps].
    """

    asked: Array
    driven: NDArray[np.bool_]
    last: int
    lag: int


def estimate_lag(response: Array, command: Array, dt: float) -> int:
    """Delay of the response against the command in steps, by the largest correlation up to 2.5 s; 0 where none is clear."""
    r, c = np.nan_to_num(response - np.nanmean(response)), np.nan_to_num(command - np.nanmean(command))
    limit = min(round(_MAX_LAG_S / dt), r.size // 3)
    norms = np.sqrt(float(r @ r) * float(c @ c))
    if norms <= 0 or limit < 1:
        return 0
    scores = np.array([float(r[k:] @ c[: c.size - k]) / norms for k in range(limit + 1)])
    best = int(np.argmax(scores))
    return best if scores[best] > 0.3 else 0


def assess_tracking(
    v: Array, v_ref: Array, dt: float, limits: Limits, names: tuple[str, str]
) -> tuple[Assessment, Assessment]:
    """Judge a drive by whether it follows its command at all.

    Parameters
    ----------
    v, v_ref : Array, shape (n,)
        Measured and commanded speed; NaN where not valid.
    dt : float
        Step [s].
    limits : Limits
        ``driving_speed`` is the speed above which the drive is commanded to move.
    names : tuple[str, str]
        Names of the two signals, for the text.

    Returns
    -------
    tuple[Assessment, Assessment]
        Sensor and actuator; the same finding stands on both, as ``sensor_or_actuator``.
    """
    lag = estimate_lag(v, v_ref, dt)
    reference = shifted(v_ref, lag)
    width = max(1, round(0.1 / dt))
    speed = moving_sum(np.nan_to_num(np.abs(v)), width) / width
    asked = moving_sum(np.nan_to_num(np.abs(reference)), width) / width
    driven = asked > limits.driving_speed
    scale = float(np.quantile(asked[driven], 0.5)) if driven.any() else 0.0
    still = speed < max(_MOVING * scale, 0.2 * limits.driving_speed)
    states = np.where(driven, CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED]).astype(np.int8)
    states[~np.isfinite(v) | ~np.isfinite(v_ref)] = CODE[State.NO_DATA]
    moving = np.flatnonzero(~still)
    last = int(moving[-1]) + 1 if moving.size else 0
    found = _standstill(v, _Tracking(asked, driven, last, lag), dt, names)
    findings = () if found is None else (found,)
    for finding in findings:
        states[finding.start :] = CODE[State.NO_SIGNAL]
    series = (("residual", np.where(np.isfinite(v), v - reference, np.nan)), ("expected", reference))
    pictured = Pictured.of(steps_of(findings, v.size, dt), series)
    reasons = {
        State.NOT_ASSESSED: "without a valve command or a second measurement, only a standstill under command can be detected",
        State.NOT_EXCITED: "nothing is commanded",
        State.NO_DATA: "no samples",
    }
    note = f"{names[0]} against {names[1]}: lag {lag * dt:.3g} s."
    one = Assessment(states, reasons, findings, pictured.columns, Tier.TRACKING, (note,), closeups=pictured.closeups)
    return one, Assessment(states.copy(), reasons, findings, {}, Tier.TRACKING, (note,))


def _standstill(v: Array, tracking: _Tracking, dt: float, names: tuple[str, str]) -> Finding | None:
    """The drive that stopped for good while its command went on; None where it did not."""
    asked, driven, last, lag = tracking
    remaining = driven[last:]
    travel = float(asked[last:][remaining].sum()) * dt
    whole = float(asked[driven].sum()) * dt
    if remaining.sum() * dt < _MIN_STILL_S or whole <= 0 or travel < _MIN_REMAINING * whole:
        return None
    start = last + int(np.flatnonzero(remaining)[0])
    level = float(np.nanmean(v[start:])) if np.isfinite(v[start:]).any() else 0.0
    share = travel / whole
    p = min(0.99, 0.8 + 0.25 * share)
    mode, side = FaultMode.NO_SIGNAL, Side.SENSOR_OR_ACTUATOR
    return Finding(
        start=start,
        stop=v.size,
        side=side,
        mode=mode,
        probability=p,
        hypotheses=(Hypothesis(side.value, mode.value, p), Hypothesis("none", State.HEALTHY.value, 1 - p)),
        epsilon=Epsilon(1.0, 0.0, 1.0),
        sat=Sat(level, abs(level), level, level, "m/s"),
        evidence=(
            f"{names[0]} stopped and never moved again while {names[1]} went on for {remaining.sum() * dt:.2f} s: "
            f"{100 * share:.0f} % of all commanded travel was still to come.",
            f"The response lags its command by {lag * dt:.2f} s (estimated and taken out).",
            "Without a second measurement, a drive at standstill and a dead sensor cannot be distinguished.",
        ),
        tier=Tier.TRACKING,
    )
