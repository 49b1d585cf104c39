"""A speed that reads −1 times what it should for a while: no scale of the tables, and no motion that a drive which follows makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.spells import spans_of
from diagnosis.response.wheel import sensor_finding
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import lasting
from replay.faults import FaultMode, State

Array = NDArray[np.float64]
Sides = tuple[Assessment, Assessment]

_LEAST_S, _GAP_BLOCKS = 3.0, 3  # for which it does, and within which it is the same time
_MOVES = 0.1  # of the top speed
_NEAR, _MISFITS = 0.2, 3.0  # of what is asked, or usual misfits, as near to the reverse of it
_MOSTLY = 0.8  # of the moving blocks in between
_MOST = 0.5  # of the mission: more is the machine file's sign
_EDGE_S, _WHOLE = 1.5, 1.5  # around either end; of the speed, by which a reading leaps that changes its sign
_JUMPED, _NO_JUMP, _EITHER = (
    0.95,
    0.85,
    0.5,
)  # probabilities that it is a fault, and of its side without a leap; set by hand


def reversed_spans(judged: Mapping[str, Judged], block_s: float) -> dict[str, list[tuple[int, int]]]:
    """Blocks [start, stop) in which a wheel reads the reverse of what is asked, by wheel; none that two of them do together.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    block_s : float
        Length of a block [s].
    """
    spans = {w: _spans(j, block_s) for w, j in judged.items() if j.response.answered}
    return {
        w: [s for s in own if not any(a < s[1] and s[0] < b for o, x in spans.items() if o != w for a, b in x)]
        for w, own in spans.items()
    }


def told_reversed(sides: Sides, one: Judged, spans: list[tuple[int, int]]) -> Sides:
    """Sensor and drive of a wheel, with the times in which it reads the reverse, where nothing else is said of them.

    Parameters
    ----------
    sides : tuple[Assessment, Assessment]
        As judged by other means.
    one : Judged
        The wheel.
    spans : list[tuple[int, int]]
        Of `reversed_spans`.
    """
    sensor, drive = sides
    width = int(one.wheel.blocks.start[1]) if one.wheel.blocks.start.size > 1 else 1
    met = [(f.start, f.stop) for f in (*sensor.findings, *drive.findings) if f.probability >= _EITHER]
    free = [(a, b) for a, b in spans if not any(x < b * width and a * width < y for x, y in met)]
    if not free:
        return sides
    found = [_finding(one, a * width, min(b * width, one.data.y.size)) for a, b in free]
    states = sensor.states.copy()
    for f in found:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    kept = [f for f in sensor.findings if not any(f.start < g.stop and g.start < f.stop for g in found)]
    findings = tuple(sorted((*kept, *found), key=lambda f: f.start))
    return replace(sensor, states=states.astype(np.int8), findings=findings), drive


def _spans(one: Judged, block_s: float) -> list[tuple[int, int]]:
    b = one.wheel.blocks
    asked = 0.5 * (b.low + b.high)
    known = np.isfinite(asked) & np.isfinite(b.mean)
    if not known.any():
        return []
    moves = known & (np.abs(asked) > _MOVES * float(np.quantile(np.abs(asked[known]), 0.99)))
    near = np.maximum(_NEAR * np.abs(asked), _MISFITS * b.noise) + 0.5 * (b.high - b.low)
    other = moves & (np.abs(b.mean + asked) < near) & (np.abs(b.mean - asked) > np.abs(asked))
    if not other.any() or np.count_nonzero(other) > _MOST * np.count_nonzero(moves):
        return []
    return [
        (a, c)
        for a, c in spans_of(other, _GAP_BLOCKS)
        if (c - a) * block_s >= _LEAST_S and np.mean(other[a:c][moves[a:c]]) >= _MOSTLY
    ]


def _finding(one: Judged, start: int, stop: int) -> Finding:
    begin, end = _leap(one, start), _leap(one, stop)
    leapt = begin is not None or end is not None
    name = one.data.name
    texts = [
        f"{name} is −1 × what its command makes it do for {lasting((stop - start) * one.wheel.dt, 1)}, at whatever speed."
    ]
    texts.append(
        "It changed its sign from one reading to the next: no {wheel} does."
        if leapt
        else "It changed its sign while the {wheel} hardly moved: a sensor with a wrong sign and a drive that turns the other way look the same."
    )
    first, last = start if begin is None else begin, stop if end is None else end
    p = _JUMPED if leapt else _NO_JUMP
    return sensor_finding(
        first,
        max(last, first + 1),
        FaultMode.OUTSIDE_TABLE,
        p,
        Epsilon(2.0, 1.9, 2.1),
        None,
        tuple(texts),
        1.0 if leapt else _EITHER,
    )


def _leap(one: Judged, at: int) -> int | None:
    """Step of the reading near one that leaps from a speed to its reverse; None where none does."""
    s, reach = one.wheel.samples, round(_EDGE_S / one.wheel.dt)
    before = s.value - s.change
    leaps = (np.abs(s.step - at) <= reach) & (before * s.value < 0.0)
    leaps &= np.abs(s.change) > _WHOLE * np.maximum(np.abs(before), np.abs(s.value))
    top = float(np.nanquantile(np.abs(s.value), 0.99)) if np.isfinite(s.value).any() else np.inf
    places = np.flatnonzero(leaps & (np.abs(s.change) > _MOVES * top))
    return int(s.step[places[np.argmin(np.abs(s.step[places] - at))]]) if places.size else None
