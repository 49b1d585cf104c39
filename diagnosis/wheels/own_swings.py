"""A wheel that swings at one frequency does not tell whether its speed is wrong or its motion.

A loop, a tyre or a valve that hunts swings so, and a tone wheel that is bent reads so. Noise of a sensor has no frequency of its own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, is_about
from diagnosis.wheels.blocks import per_sample
from diagnosis.wheels.findings import WheelFindings, WheelPath
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

_LEAST_HZ = 1.0
_PIECE_S, _ENOUGH = 2.5, 0.8  # looked at by itself, for a frequency may wander; share of it that is enough
_BAND, _FLAT = 0.25, 2.2  # about a frequency, to either side; times what lies there of white noise
_SHARE, _SHARE_OF_FEW, _OF_ALL = (
    0.58,
    0.65,
    0.3,
)  # of the power that lies there: of what is not slower than the least, and of all
_FEW = 4  # pieces
_FAULT, _ROW = 0.65, 0.1  # that it is a fault of this wheel, and that it is noise: on tuning seeds 35 and 5 of 52 were


def swing_hz(off: Array, dt: float) -> float | None:
    """Frequency at which a deviation swings [Hz]; None where it has none of its own.

    Parameters
    ----------
    off : Array, shape (n,)
        Deviation; NaN counts as none.
    dt : float
        Step [s].
    """
    length = round(_PIECE_S / dt)
    if off.size < _ENOUGH * length or length * dt * _LEAST_HZ < 2.0:
        return None
    length = min(length, off.size)
    off = np.nan_to_num(off)
    found = np.array(
        [_strongest(off[k : k + length], dt) for k in range(0, off.size - length + 1, max(1, length // 2))]
    )
    hz, share, of_all, of_white = np.median(found, axis=0)
    least = max(_SHARE if len(found) >= _FEW else _SHARE_OF_FEW, _FLAT * of_white)
    return float(hz) if hz > _LEAST_HZ and share > least and of_all > _OF_ALL else None


def _strongest(piece: Array, dt: float) -> tuple[float, float, float, float]:
    """The strongest frequency [Hz], and the share of the power about it: of what is not slower than the least, of all, and of white noise [1]."""
    t = np.linspace(-1.0, 1.0, piece.size)
    piece = piece - piece.mean() - t * float(piece @ t) / float(t @ t)
    power, f = np.abs(np.fft.rfft(piece * np.hanning(piece.size))) ** 2, np.fft.rfftfreq(piece.size, dt)
    whole, quick = float(power.sum()), f >= _LEAST_HZ
    power = np.where(quick, power, 0.0)
    total = float(power.sum())
    if total <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    at = float(f[int(np.argmax(power))])
    near = quick & (np.abs(f - at) <= _BAND * at)
    return at, float(power[near].sum()) / total, float(power[near].sum()) / whole, float(near.sum() / quick.sum())


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
    return opened(
        finding,
        f"It swings at {plain(hz, 2)} Hz: the {{wheel}} may really do so, as where a loop, a tyre or a valve hunts, or its sensor may read so.",
    )


def opened(finding: Finding, why: str) -> Finding:
    """A noisy finding as one outside the tables whose side is left open, with the sentence that says why."""
    fault = min(_FAULT, sum(h.p for h in finding.hypotheses if h.mode != State.HEALTHY.value))
    row = _ROW / _FAULT * fault
    return replace(
        finding,
        side=Side.SENSOR_OR_ACTUATOR,
        mode=FaultMode.OUTSIDE_TABLE,
        probability=fault - row,
        hypotheses=_hypotheses(row, fault),
        epsilon=None,
        sat=None,
        evidence=(why, *(e for e in finding.evidence if not is_about(e, About.CASES))),
    )


def is_opened(finding: Finding) -> bool:
    """Whether a finding is one that `opened` made."""
    either = finding.side is Side.SENSOR_OR_ACTUATOR and finding.mode is FaultMode.OUTSIDE_TABLE
    return either and any(h.mode == FaultMode.NOISY.value for h in finding.hypotheses)


def _hypotheses(row: float, fault: float) -> tuple[Hypothesis, ...]:
    either = Side.SENSOR_OR_ACTUATOR.value
    rows = ((FaultMode.OUTSIDE_TABLE, fault - row), (FaultMode.NOISY, row))
    named = [Hypothesis(either, mode.value, p) for mode, p in rows]
    return tuple(sorted([*named, Hypothesis("none", State.HEALTHY.value, 1.0 - fault)], key=lambda h: -h.p))
