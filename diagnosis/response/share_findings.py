"""A speed channel that becomes another share of its own joint's position: one encoder makes both, so that one of the channels is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.spells import spans_of
from diagnosis.response.wheel import sensor_finding
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Epsilon
from replay.faults import FaultMode, State

Array = NDArray[np.float64]

_P, _IN_ITS_LOOP_P = (
    0.95,
    0.85,
)  # that the speed channel is wrong, where its command says so, and where the drive obeys it; set by hand
_REACH_S = 2.0  # around the end of a stretch that blocks show, in which its sample is looked for
_LEAST = 3  # samples on each side
_OVERLAP = 0.5  # of a stretch that others have told


def told_share(sides: tuple[Assessment, Assessment], one: Judged) -> tuple[Assessment, Assessment]:
    """Sensor and drive of a wheel, with the stretches in which its speed is no longer its position's, unless they are told already.

    Parameters
    ----------
    sides : tuple[Assessment, Assessment]
        As judged by blocks.
    one : Judged
        The wheel.
    """
    sensor, drive = sides
    share, rolled = one.data.joint_share, one.data.rolled
    if share is None or rolled is None:
        return sides
    found = []
    for a, b in spans_of(share != 1.0):
        told = np.zeros(share.size, np.bool_)
        for f in sensor.findings:
            told[f.start : f.stop] = True
        if np.mean(told[a:b]) < _OVERLAP:
            found.append(_finding(_onset(one, a, float(share[a])), b, float(share[a]), one))
    if not found:
        return sides
    states = sensor.states.copy()
    for f in found:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    kept = [f for f in sensor.findings if not any(g.start <= f.start and f.stop <= g.stop for g in found)]
    findings = tuple(sorted((*kept, *found), key=lambda f: f.start))
    return replace(sensor, states=states.astype(np.int8), findings=findings), drive


def _onset(one: Judged, at: int, share: float) -> int:
    """First step of a stretch: where 1 before and the share from there on explain the samples around it best."""
    d, rolled = one.data, one.data.rolled
    assert rolled is not None
    reach = round(_REACH_S / one.wheel.dt)
    near = np.arange(max(0, at - reach), min(d.y.size, at + reach))
    near = near[d.fresh[near] & np.isfinite(d.y[near]) & np.isfinite(rolled[near])]
    if near.size < 2 * _LEAST:
        return at
    before = np.cumsum(np.abs(d.y[near] - rolled[near]))
    behind = np.cumsum(np.abs(d.y[near] - share * rolled[near])[::-1])[::-1]
    return int(near[int(np.argmin(np.r_[0.0, before[:-1]] + behind))])


def _finding(start: int, stop: int, share: float, one: Judged) -> Finding:
    mode = FaultMode.INEFFICIENT if share < 1.0 else FaultMode.OUTSIDE_TABLE
    name, loss = one.data.name, 1.0 - share
    texts = [
        f"{name} is {share:.2f} × the slope of its own joint's position in this time, and 1 × in the rest: one encoder makes both."
    ]
    if one.data.share is not None:
        texts.append("The position goes on as the command asks, so that the position is right and the speed is not.")
    else:
        texts.append(
            "The drive holds this speed at its command, so that its loop believes it; the position may be the wrong one instead."
        )
    p = _P if one.data.share is not None else _IN_ITS_LOOP_P
    bound = 0.02 * share
    return sensor_finding(
        start, max(stop, start + 1), mode, p, Epsilon(loss, loss - bound, loss + bound), None, tuple(texts)
    )
