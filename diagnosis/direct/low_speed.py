"""What the speed sensors of a machine do whenever it starts, stops or turns round is their habit, and no fault of one of them.

Sensors that count edges see few at low speed: they read 0 before the first one, hold the last, and come late. How far they are
off then is taken from all passages of all wheels through low speed; a finding there that is no further off is left open. One that
lasts longer than any passage is held to what they are off by in the middle of their time, and not to their worst moment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum
from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.results.assessment import CODE, Assessment, Finding
from replay.arrays.numeric import without_nan
from replay.arrays.quantiles import median_of, quantile_of
from replay.arrays.runs import runs_of
from replay.faults import State

Array = NDArray[np.float64]

_LOW, _TOP = 0.2, 0.98  # of the speed that is reached, by this quantile
_EVEN_S = 0.1  # over which a deviation is evened
_SENSORS, _PASSAGES = 3, 8  # fewer show no habit
_USUAL, _BEYOND = 0.7, 1.7  # quantile of passages, and times it
_SLOWEST = 0.25  # of low speed, that a passage reaches
_MOSTLY = 0.9  # of a finding at low speed
_LASTS_S = 3.0  # longer than any passage through low speed


def without_low_speed_habit(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment]
) -> dict[str, Assessment]:
    """Assessments of speed sensors without findings that all of them would have at low speed.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Sensors beside their references, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    """
    if len(found) < _SENSORS or not any(a.findings for a in assessments.values()):
        return dict(assessments)
    speeds = {w: np.abs(without_nan(one.samples.x)) for w, one in found.items()}
    low = _LOW * max(float(quantile_of(x, _TOP)) for x in speeds.values())
    off = {w: evened_off(one) for w, one in found.items()}
    sound = {w: ~in_lasting(assessments[w].findings, off[w].size, found[w].pair.dt) for w in found}
    passages = np.concatenate([_passages(off[w], speeds[w], sound[w], low) for w in found])
    if len(passages) < _PASSAGES:
        return dict(assessments)
    most, middle = _BEYOND * quantile_of(passages, _USUAL, axis=0)
    out = {}
    for w, a in assessments.items():
        slow, brief = speeds[w] < low, round(_LASTS_S / found[w].pair.dt)
        out[w] = left_open(a, [f for f in a.findings if _is_habit(f, off[w], slow, (most, middle), brief)])
    return out


def evened_off(one: IdentifiedPair) -> Array:
    """How far readings are off their reference, evened over a tenth of a second [unit], shape (n,)."""
    known = one.samples.status == PAIR
    width = max(1, round(_EVEN_S / one.pair.dt))
    count = moving_sum(known, width)
    total = moving_sum(np.where(known, one.samples.y - one.samples.x, 0.0), width)
    return np.asarray(np.abs(total) / np.maximum(count, 1))


def in_lasting(findings: Sequence[Finding], size: int, dt: float) -> NDArray[np.bool_]:
    """Steps, shape (size,), in findings that last longer than a passage, of which a fault makes no habit; `dt` in s."""
    out = np.zeros(size, np.bool_)
    for f in findings:
        if (f.stop - f.start) * dt > _LASTS_S:
            out[f.start : f.stop] = True
    return out


def _passages(off: Array, speed: Array, sound: NDArray[np.bool_], low: float) -> Array:
    """Largest deviation of each passage that comes near standstill and begins or ends with motion, and the median while it moves, (passages, 2).

    Of sound ones alone.
    """
    spans = [(a, b) for a, b in runs_of(speed < low) if a > 0 or b < speed.size]
    near = [(a, b) for a, b in spans if speed[a:b].min() < _SLOWEST * low and sound[a:b].all()]
    moves = speed > _SLOWEST * low
    return np.array(
        [(off[a:b].max(), median_of(off[a:b][moves[a:b]]) if moves[a:b].any() else 0.0) for a, b in near]
    ).reshape(-1, 2)


def _is_habit(finding: Finding, off: Array, low: NDArray[np.bool_], limits: tuple[float, float], brief: int) -> bool:
    """Whether a finding at low speed is off by no more than passages; `limits` of its largest deviation and, beyond `brief` steps, its median."""
    part = slice(finding.start, finding.stop)
    most, middle = limits
    if low[part].mean() < _MOSTLY or off[part].max(initial=0.0) > most:
        return False
    return finding.stop - finding.start <= brief or bool(median_of(off[part]) <= middle)


def left_open(a: Assessment, findings: Sequence[Finding], state: State = State.NOT_ASSESSED) -> Assessment:
    """An assessment that leaves open what some findings said, or calls it another state."""
    if not findings:
        return a
    states = a.states.copy()
    for f in findings:
        inside = states[f.start : f.stop]
        inside[inside == CODE[State(f.mode.value)]] = CODE[state]
    return replace(a, states=states, findings=tuple(f for f in a.findings if f not in findings))
