"""A wheel that swings at one frequency does not tell whether its speed is wrong or its motion.

A loop, a tyre or a valve that hunts swings so, and a tone wheel that is bent reads so. Noise of a sensor has no frequency of its own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.wheels.blocks import per_sample
from diagnosis.wheels.findings import WheelFindings, WheelPath
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

_LEAST_HZ, _CYCLES = 1.0, 8
_BAND, _FLAT = 0.25, 2.2  # about a frequency, to either side; times what lies there of white noise
_SHARE, _OF_ALL = 0.5, 0.35  # of the power that lies there: of what is not slower than the least, and of all
_PIECE = 16  # cycles of the slowest swing, that are looked at together: it may wander
_P = 0.85  # that it is a fault, and no way of the machine


def swing_hz(off: Array, dt: float) -> float | None:
    """Frequency at which a deviation swings [Hz]; None where it has none of its own.

    Parameters
    ----------
    off : Array, shape (n,)
        Deviation; NaN counts as none.
    dt : float
        Step [s].
    """
    length = min(off.size, round(_PIECE / (_LEAST_HZ * dt)))
    if length * dt * _LEAST_HZ < _CYCLES / 4:
        return None
    n = off.size // length
    pieces = np.nan_to_num(off[: n * length]).reshape(n, length)
    t = np.linspace(-1.0, 1.0, length)
    pieces = pieces - pieces.mean(axis=1, keepdims=True) - np.outer(pieces @ t / (t @ t), t)
    power = np.mean(np.abs(np.fft.rfft(pieces * np.hanning(length), axis=1)) ** 2, axis=0)
    f = np.fft.rfftfreq(length, dt)
    whole = float(power.sum())
    power[f < _LEAST_HZ] = 0.0
    at = float(f[int(np.argmax(power))])
    near = np.abs(f - at) <= _BAND * at
    least = max(max(_SHARE, _FLAT * float(np.mean(near))) * float(power.sum()), _OF_ALL * whole)
    return at if at * length * dt >= _CYCLES and float(power[near].sum()) > least else None


def with_open_side(path: WheelPath, found: WheelFindings) -> WheelFindings:
    """Findings of a noisy sensor or valve, their side left open where the wheel swings at one frequency.

    Parameters
    ----------
    path : WheelPath
        The wheel.
    found : WheelFindings
        What its segments say.
    """
    if not any(f.mode is FaultMode.NOISY for f in found.findings):
        return found
    expected: Array = np.asarray(per_sample(path.expected, path.width, path.y.size), dtype=np.float64)
    return replace(found, findings=[_opened(f, path, expected) for f in found.findings])


def _opened(finding: Finding, path: WheelPath, expected: Array) -> Finding:
    part = slice(finding.start, finding.stop)
    if finding.mode is not FaultMode.NOISY or finding.side is Side.SENSOR_OR_ACTUATOR:
        return finding
    hz = swing_hz(path.y[part] - expected[part], path.dt)
    if hz is None:
        return finding
    p = min(_P, sum(h.p for h in finding.hypotheses if h.mode != State.HEALTHY.value))
    return replace(
        finding,
        side=Side.SENSOR_OR_ACTUATOR,
        probability=p,
        hypotheses=_hypotheses(p),
        evidence=(
            f"It swings at {hz:.2g} Hz: the {{wheel}} may really do so, as where a loop, a tyre or a valve hunts, or its sensor may read so.",
            *finding.evidence,
        ),
    )


def _hypotheses(p: float) -> tuple[Hypothesis, ...]:
    either = Hypothesis(Side.SENSOR_OR_ACTUATOR.value, FaultMode.NOISY.value, p)
    return either, Hypothesis("none", State.HEALTHY.value, 1.0 - p)
