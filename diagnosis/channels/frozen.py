"""Speed sensors that give one value through a whole mission while the machine drives: no filter is needed for them.

Left to the wheel model such a sensor would have no healthy time to be identified in, and would pull the other wheels along.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.vocabulary import Tier
from replay.arrays.blocks import blocks
from replay.faults import FaultMode, Side, State
from replay.signals.resolution import rounding_step, white_noise

Array = NDArray[np.float64]

_LEAST_S = 5.0  # commanded to drive for so long
_LEAST_CHANGE = 0.1  # by which the command, and another wheel's speed, change meanwhile [m/s]
_SURE, _LIKELY = 0.97, 0.7
_SAMPLES = 1 << 16


def frozen_speeds(v: Array, v_ref: Array, driving_speed: float, dt: float) -> dict[int, float]:
    """Wheels whose speed never changed although they were commanded to move and others did, with the value that they give.

    Parameters
    ----------
    v, v_ref : Array, shape (n, wheels)
        Measured and commanded speeds [m/s].
    driving_speed : float
        Command from which a wheel is driving [m/s].
    dt : float
        Step [s].
    """
    wheels = v.shape[1]
    low, high = np.full((2, wheels), np.inf), np.full((2, wheels), -np.inf)
    driven = np.zeros(wheels)
    for part in blocks(len(v)):
        moving = np.abs(v_ref[part]) > driving_speed
        driven += moving.sum(axis=0) * dt
        for k, values in enumerate((v[part], np.where(moving, v_ref[part], np.nan))):
            known = np.isfinite(values)
            low[k] = np.minimum(low[k], np.where(known, values, np.inf).min(axis=0, initial=np.inf))
            high[k] = np.maximum(high[k], np.where(known, values, -np.inf).max(axis=0, initial=-np.inf))
    others = high[0] - low[0] > _LEAST_CHANGE
    asked = (driven >= _LEAST_S) & (high[1] - low[1] > _LEAST_CHANGE)
    return {i: float(low[0, i]) for i in range(wheels) if asked[i] and others.any() and high[0, i] == low[0, i]}


def frozen_sensor(y: Array, value: float, others: Array, name: str, dt: float) -> Assessment:
    """Judge such a sensor: stuck, or without signal where that value is zero.

    Zero is also what a wheel reads that stands still, unless the other sensors' noise shows even then.

    Parameters
    ----------
    y : Array, shape (n,)
        Its readings [m/s]; NaN where there is no sample.
    value : float
        The value [m/s].
    others : Array, shape (n, k)
        Speeds of the other wheels [m/s].
    name : str
        Of the signal.
    dt : float
        Step [s].
    """
    known = np.flatnonzero(np.isfinite(y))
    start, stop = int(known[0]), int(known[-1]) + 1
    states = np.full(y.size, CODE[State.NO_DATA], np.int8)
    mode = FaultMode.STUCK if value else FaultMode.NO_SIGNAL
    states[start:stop] = CODE[State(mode.value)]
    p = _SURE if value or _noisy(others, dt) else _LIKELY
    silent = Hypothesis(Side.ACTUATOR.value, FaultMode.NO_SIGNAL.value, 1.0 - p)
    sentences = (
        f"{name} read {plain(value, 4)} {{speed_unit}} in all {known.size} samples of the mission, while the {{wheel}} was commanded to move and "
        "other {wheels} moved.",
        *(() if p == _SURE else ("A {wheel} at standstill gives the same reading, so its drive may be dead instead.",)),
    )
    finding = Finding(
        start=start,
        stop=stop,
        side=Side.SENSOR,
        mode=mode,
        probability=p,
        hypotheses=(Hypothesis(Side.SENSOR.value, mode.value, p), silent),
        epsilon=Epsilon(1.0, 1.0, 1.0),
        sat=Sat(value, abs(value), value, value, "m/s"),
        evidence=sentences,
        tier=Tier.SIGNAL,
        detected=min(stop - 1, start + round(_LEAST_S / dt)),
    )
    return Assessment(states, {State.NO_DATA: "no samples"}, (finding,), tier=Tier.SIGNAL)


def _noisy(others: Array, dt: float) -> bool:
    """Whether the other sensors' noise exceeds their rounding, so that no living one repeats a number for long."""
    shown = []
    for column in others[:_SAMPLES].T:
        known = column[np.isfinite(column)]
        if known.size > 100 and np.ptp(known) > 0:
            shown.append(white_noise(known, dt) > rounding_step(known))
    return bool(shown) and all(shown)
