"""A speed that falls to zero through all that lies between: its wheel may have been held, while a sensor that dies is cut off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.channels.one_value import TURNS
from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, is_about
from diagnosis.wheels.inputs import WheelsData
from replay.arrays.quantiles import median_known
from replay.faults import FaultMode, Side, State

_PASS_S, _SLOWED_S, _PASSED_S = 0.8, 0.5, 0.3  # before the onset, likewise, and after it
_PASSES_S, _FEW = 0.06, 3  # for so long; readings
_BETWEEN, _TURNED = (0.15, 0.7), 0.4  # of what it read before, by itself and beside the others; of what they did
_OTHERS = 2  # wheels beside this one
_PASSED = "Its reading passed through the speeds between before it fell to zero, as that of a wheel that is held does; a sensor's is cut off."
_TOGETHER_S, _MOST_TOGETHER = 0.3, 0.6  # from one onset, and one end, to another; set by hand
_BOTH = "Another wheel slows down and comes back in the same moments: what holds both, such as the ground, may be neither's fault."
_MOST = 0.45  # of a sensor, where the valve's position tells that its wheel was driven
#: Of any fault: the sensor is silent, the valve is, or it is stuck nearly closed.
_SHARES = (
    (Side.ACTUATOR, FaultMode.NO_SIGNAL, 0.4),
    (Side.SENSOR, FaultMode.NO_SIGNAL, 0.35),
    (Side.ACTUATOR, FaultMode.STUCK, 0.25),
)


def or_held(data: WheelsData, i: int, f: Finding, told: Sequence[Finding]) -> Finding:
    """A silent sensor as one of its wheel, which may be held instead, where its reading slows down to zero, or stays there since it did.

    Parameters
    ----------
    data : WheelsData
        Channels.
    i : int
        The wheel.
    f : Finding
        The finding.
    told : Sequence[Finding]
        All of the wheel.
    """
    if (f.side, f.mode) != (Side.SENSOR, FaultMode.NO_SIGNAL) or data.y.shape[1] <= _OTHERS:
        return f
    before = [g for g in told if (g.side, g.mode) == (f.side, f.mode) and g.start < f.start]
    since = [g for g in before if _rests(data, i, g.stop, f.start)]
    if not any(_slows(data, i, g) for g in (f, *since)):
        return f
    return limited(f, _MOST, _PASSED) if data.measured[i] else _of_either(f)


def or_held_together(found: Sequence[Sequence[Finding]], dt: float) -> list[list[Finding]]:
    """Findings of wheels that slow down to zero, less sure where another one does so from the same moment to the same.

    Parameters
    ----------
    found : Sequence[Sequence[Finding]]
        Of each wheel.
    dt : float
        Step [s].
    """
    held = [[f for f in own if _PASSED in f.evidence] for own in found]

    def together(i: int, f: Finding) -> bool:
        others = (g for j, own in enumerate(held) if j != i for g in own)
        return any(max(abs(f.start - g.start), abs(f.stop - g.stop)) * dt <= _TOGETHER_S for g in others)

    return [
        [limited(f, _MOST_TOGETHER * f.probability, _BOTH) if f in held[i] and together(i, f) else f for f in own]
        for i, own in enumerate(found)
    ]


def _of_either(f: Finding) -> Finding:
    fault = sum(h.p for h in f.hypotheses if h.mode != State.HEALTHY.value)
    rows = [Hypothesis(side.value, mode.value, share * fault) for side, mode, share in _SHARES]
    hypotheses = sorted([*rows, Hypothesis("none", State.HEALTHY.value, 1.0 - fault)], key=lambda h: -h.p)
    p = sum(h.p for h in rows if h.mode == f.mode.value)
    return replace(
        f,
        side=Side.SENSOR_OR_ACTUATOR,
        probability=p,
        hypotheses=tuple(hypotheses),
        evidence=(_PASSED, *(e for e in f.evidence if not is_about(e, About.CASES, About.RIVAL))),
    )


def _rests(data: WheelsData, i: int, start: int, stop: int) -> bool:
    """Whether nothing but rest is read in samples [start, stop)."""
    part = np.abs(data.y[start:stop, i])
    return float(np.max(part, where=np.isfinite(part), initial=0.0)) <= TURNS * data.span


def _slows(data: WheelsData, i: int, f: Finding) -> bool:
    """Whether a speed, by itself and beside the others', passes through what lies between what it was and zero."""
    start, cut = (max(0, f.start - round(s / data.dt)) for s in (_PASS_S, _SLOWED_S))
    part = data.y[start : min(f.stop, f.start + round(_PASSED_S / data.dt))]
    others = np.delete(part, i, axis=1)
    known = np.isfinite(part[:, i]) & np.isfinite(others).any(axis=1)
    speed, share = np.abs(part[:, i]), np.full(len(part), np.nan)
    share[known] = speed[known] / np.maximum(np.abs(median_known(others[known], axis=1)), TURNS * data.span)
    if np.isfinite(share[: cut - start]).sum() < _FEW:
        return False
    least, most = _BETWEEN
    inside, levels = np.ones(len(part) - (cut - start), np.bool_), []
    for x in (speed, share):
        levels.append(float(median_known(x[: cut - start])))
        inside &= (x[cut - start :] > least * levels[-1]) & (x[cut - start :] < most * levels[-1])
    return bool(levels[-1] > _TURNED and np.count_nonzero(inside) >= max(_FEW, round(_PASSES_S / data.dt)))
