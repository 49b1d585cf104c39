"""Jumps of a steering angle: no axle turns quicker than it ever does for a while, so that what jumps is a reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

READINGS = 3  # on either side of a jump: the middle of them is no spike
LEAST_RAD, LARGEST_RAD = 0.06, 0.24  # of what a jump is a share: an offset counts whatever the angle
_FEW = 100  # readings
_WRAP = 0.3  # rad: a jump of a whole turn, give or take, is none
_LASTING_S = 0.15  # for which a rate must last to be an axle's own
_QUICKER, _SLOWEST = 1.3, 0.1  # times that rate, and rad/s at least
_NOISES, _STEPS = 8.0, 2.0  # times the noise, and the smallest step, of readings
_BEYOND = 1.5  # times what an axle may turn meanwhile, and noise may add
_GAP = 1.5  # times the usual time between readings, over which nothing is said
_COARSE_S = 0.03  # readings further apart show no jumps
_MOVING = 0.02  # rad in `_LASTING_S`
_EDGE_S = 0.25  # of a fault's beginning or end
_OF_LOSS = 0.5  # of what a loss makes of the angle there: a jump by as much is its own
_P = 0.9  # that what jumps so is the sensor's: none of 12 was not on tuning seeds


def readings_of(y: Array, fresh: NDArray[np.bool_], dt: float) -> tuple[Array, Array] | None:
    """Times [s] and angles [rad] of an axle's readings; None for too few, or too rare ones.

    Parameters
    ----------
    y : Array, shape (n,)
        Angle [rad]; NaN where unknown.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new reading.
    dt : float
        Step [s].
    """
    at = np.flatnonzero(fresh & np.isfinite(y))
    if at.size < _FEW or float(np.median(np.diff(at))) * dt > _COARSE_S:
        return None
    return at * dt, np.asarray(y[at], dtype=np.float64)


def quickest_of(t: Array, y: Array) -> float:
    """Largest rate that lasts [rad/s]: over two spans on end, in one of which a jump would be alone."""
    n = max(1, round(_LASTING_S / float(np.median(np.diff(t)))))
    rate = (y[n:] - y[:-n]) / (t[n:] - t[:-n])
    before, after = rate[:-n], rate[n:]
    both = np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
    return float(both.max(initial=0.0))


def _held(t: Array, y: Array) -> float:
    """Time between readings that differ, while an axle turns [s]: a channel may repeat each of its readings."""
    changes = np.flatnonzero(np.diff(y) != 0.0) + 1
    if changes.size < 2:
        return float(np.median(np.diff(t)))
    apart, moved = np.diff(t[changes]), np.abs(np.diff(y[changes]))
    turning = (apart < _LASTING_S) & (moved > _MOVING * apart / _LASTING_S)
    return float(np.quantile(apart[turning], 0.95)) if turning.any() else float(np.median(np.diff(t)))


def jumps(t: Array, y: Array, quickest: float) -> tuple[Array, Array, Array]:
    """How far an angle jumps where it does so further than it can be turned, what that is a share of, and when.

    Parameters
    ----------
    t, y : Array, shape (n,)
        Times [s] and angles [rad] of readings.
    quickest : float
        Largest rate of the machine's axles [rad/s].

    Returns
    -------
    Array, Array, Array : shape (m,)
        Jumps [rad], 0 where there is none, sizes of `LEAST_RAD` to `LARGEST_RAD` [rad], and times [s].
    """
    usual, held = float(np.median(np.diff(t))), _held(t, y)
    if y.size < 2 * READINGS + 1 or held > _COARSE_S:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    windows: NDArray[np.float64] = np.lib.stride_tricks.sliding_window_view(y, READINGS)
    middle = np.median(windows, axis=1)
    before, after = middle[:-READINGS], middle[READINGS:]
    span = t[2 * READINGS - 1 :] - t[: -2 * READINGS + 1]
    moved = np.abs(after - before)
    moved = np.where(np.abs(moved - 2.0 * np.pi) < _WRAP, 0.0, moved)
    noise = float(np.median(np.abs(np.diff(y, 2)))) / 0.6745 / np.sqrt(6.0)
    steps = np.abs(np.diff(y))
    step = float(np.min(steps[steps > 0.0], initial=np.inf))
    step = step if np.isfinite(step) else 0.0
    may = max(_QUICKER * quickest, _SLOWEST) * (READINGS * usual + held) + max(_NOISES * noise, _STEPS * step)
    whole = span <= _GAP * (2 * READINGS - 1) * usual
    beyond = np.where(whole & (moved > _BEYOND * may), moved, 0.0)
    size = np.clip(np.maximum(np.abs(before), np.abs(after)), LEAST_RAD, LARGEST_RAD)
    return beyond, size, t[READINGS : READINGS + beyond.size]


def of_sensor(valve: Sequence[Finding], y: Array, fresh: NDArray[np.bool_], dt: float) -> list[Finding]:
    """The losses among a valve's findings that begin or end with a jump of the angle as large as they are: they are the sensor's.

    Parameters
    ----------
    valve : Sequence[Finding]
        Of one axle.
    y, fresh, dt
        Its angle, as of `readings_of`.
    """
    losses = [f for f in valve if f.mode is FaultMode.INEFFICIENT and f.epsilon is not None]
    read = readings_of(y, fresh, dt) if losses else None
    if read is None:
        return []
    jumped, _, at = jumps(*read, quickest_of(*read))
    out = []
    for f in losses:
        assert f.epsilon is not None
        for edge in (f.start * dt, f.stop * dt):
            near = np.abs(at - edge) <= _EDGE_S
            about = np.abs(read[0] - edge) <= _EDGE_S
            least = _OF_LOSS * f.epsilon.value * float(np.max(np.abs(read[1][about]), initial=0.0))
            if near.any() and float(jumped[near].max()) > max(least, 0.0):
                out.append(f)
                break
    return out


def as_sensors(finding: Finding) -> Finding:
    """A valve's loss told as its sensor's."""
    p = min(_P, max(finding.probability, 0.8))
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
            "The angle jumps where it begins or ends, quicker than an axle turns: it is the reading that is off.",
            *finding.evidence,
        ),
    )
