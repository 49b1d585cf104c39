"""A lone speed beside an inertial unit: what the body does not do, and how it shakes while the speed reads nothing.

A speed that becomes nothing, or a share of itself, from one reading to the next, while the body's acceleration has nothing of that
change, is wrong. The unit alone accuses nothing: where it is dead, on another axis, or held by something else, its relation to the speed,
or its own noise about the change, is missing. Nothing is healthy for it, for steady driving has no acceleration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.acceleration import ENOUGH, Relation, acceleration_of
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.vibration import Unit, Vibration, vibration_of
from diagnosis.response.wheel import SENSOR_SHARE, sensor_finding
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import lasting
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_JUMP = 0.25  # of the usual speed, between two readings or over one in between
_NOTHING, _SHARES = 0.03, ((0.1, 0.75), (1.35, 6.0))  # of the speed before
_LEVEL = 3  # readings to each side of a jump
_STEADY = 0.35  # of a jump, by which the readings next to it differ from their levels
_BACK = 0.25  # by which the product of both jumps may differ from 1
_LEAST_S = 1.0
_MOST = 12  # such times: more are the habit of a channel
_GOES_ON_S = (
    2.0  # for which the unit shakes on after a speed that does not come back at once: a locked wheel slides for less
)
_AGAINST = -1.0  # nats by which one end may say the body's
_P = 0.85, 0.94  # that the speed is wrong, by one end and by both
_AROUND_S = 0.75  # of a jump, in which the unit has to be alive
_ALIVE = 0.5  # of what it shakes by in slow motion
_TOLD = 0.5  # of a finding's time; of the speed before, that is asked for in so much of it


class Jump(NamedTuple):
    """A change of a speed from one reading to the next: its step, and the levels before and behind it [m/s]."""

    step: int
    before: float
    behind: float


def beside_the_acceleration(data: FollowerData, unit: Unit | None, dt: float) -> tuple[Finding, ...]:
    """Times in which a lone speed is nothing, or a share, of what the body does by its acceleration and its shaking.

    Parameters
    ----------
    data : FollowerData
        The only drive.
    unit : Unit or None
        The inertial unit.
    dt : float
        Step [s].
    """
    if unit is None:
        return ()
    jumps = jumps_of(data)
    spans = _between(jumps, round(_LEAST_S / dt), data.y.size)
    if not spans or len(spans) > _MOST:
        return ()
    width = cell_of(dt)
    y, a = filled(cells(data.y, width)), filled(cells(unit.acceleration, width))
    shaking = vibration_of(unit, np.abs(data.y), [(s, e) for s, e, *_ in spans], dt)
    found = []
    for span in spans:  # what other jumps of this channel are beside the body is its habit
        aside = np.zeros(y.size, np.bool_)
        aside[span[0] // width : span[1] // width + 1] = True
        related = acceleration_of(y, a, aside, width * dt)
        found.append(_finding(data, span, related, shaking, width, dt))
    return tuple(f for f in found if f is not None)


def with_the_acceleration(
    sides: tuple[Assessment, Assessment], data: FollowerData, unit: Unit | None, dt: float
) -> tuple[Assessment, Assessment]:
    """Sensor and drive of a lone drive, with what the unit shows beside what is found of it already.

    Parameters
    ----------
    sides : tuple[Assessment, Assessment]
        As judged without it.
    data, unit, dt
        As for `beside_the_acceleration`.
    """
    found = beside_the_acceleration(data, unit, dt)
    new, gone = merged(sides[0].findings, found)
    if not new:
        return sides
    both = []
    for part, mine in zip(sides, (True, False), strict=True):
        states = part.states.copy()
        for f in gone:
            states[f.start : f.stop] = CODE[State.NOT_ASSESSED]
        for f in new:
            states[f.start : f.stop] = CODE[State(f.mode.value) if mine else State.MASKED]
        kept = [f for f in part.findings if f not in gone]
        findings = tuple(sorted((*kept, *(new if mine else ())), key=lambda f: f.start))
        both.append(replace(part, states=states, findings=findings, reasons={**_MASKED, **part.reasons}))
    return both[0], both[1]


_MASKED = {State.MASKED: "its {wheel.sensor} is faulty"}


def merged(known: Sequence[Finding], found: Sequence[Finding]) -> tuple[list[Finding], list[Finding]]:
    """New findings that say more than the known ones, and those of the known ones that they take the place of: their side was left open."""
    open_ = [f for f in known if f.side is Side.SENSOR_OR_ACTUATOR]
    new = [f for f in found if not any(_same(f, k) for k in known if k not in open_)]
    return new, [k for k in open_ if any(_same(f, k) for f in new)]


def _same(one: Finding, other: Finding) -> bool:
    """Whether two findings are about one time."""
    both = min(one.stop, other.stop) - max(one.start, other.start)
    return both > _TOLD * min(one.stop - one.start, other.stop - other.start)


def filled(x: Array) -> Array:
    """A series of cells, shape (cells,), in which single ones without a reading have that of the one before."""
    out = x.copy()
    gap = np.isnan(out[1:]) & np.isfinite(out[:-1])
    out[1:][gap] = out[:-1][gap]
    return out


def jumps_of(data: FollowerData) -> list[Jump]:
    """Where a speed changes by much from one reading to the next, or over one in between, from one level to another of the same sign or to nothing."""
    step = np.flatnonzero(data.fresh & np.isfinite(data.y))
    value = data.y[step]
    if step.size < 4 * _LEVEL:
        return []
    usual = float(np.quantile(np.abs(value[value != 0.0]), 0.9)) if np.any(value) else 0.0
    out: list[Jump] = []
    at = np.flatnonzero(np.abs(np.diff(value)) > 0.5 * _JUMP * usual) + 1
    at = at[(at >= _LEVEL) & (at < value.size - _LEVEL)]
    near = np.arange(1, _LEVEL + 1)
    befores, behinds = (np.median(value[at[:, np.newaxis] + side * near], axis=1) for side in (-1, 1))
    size = np.abs(behinds - befores)
    from_levels = np.maximum(np.abs(value[at - 1] - befores), np.abs(value[at + 1] - behinds))
    sharp = (size >= _JUMP * usual) & (befores * behinds >= 0.0) & (from_levels <= _STEADY * size)
    for k, before, behind in zip(at[sharp].tolist(), befores[sharp].tolist(), behinds[sharp].tolist(), strict=True):
        if out and out[-1].step >= step[k - 1]:  # one jump over two readings
            continue
        out.append(Jump(int(step[k]), before, behind))
    return out


def _between(jumps: Sequence[Jump], least: int, size: int) -> list[tuple[int, int, float, tuple[Jump, ...]]]:
    """Steps [start, stop), share of the speed, and the jumps that bound them, of times in which a reading is nothing or a share of itself."""
    out: list[tuple[int, int, float, tuple[Jump, ...]]] = []
    k = 0
    while k < len(jumps):
        one, other = jumps[k], jumps[k + 1] if k + 1 < len(jumps) else None
        share = _share(one.behind, one.before)
        back = np.nan if other is None else _share(other.before, other.behind)
        if other is not None and other.step - one.step >= least and _alike(share, back):
            out.append((one.step, other.step, 0.5 * (share + back), (one, other)))
            k += 2
            continue
        if share == 0.0:
            out.append((one.step, size if other is None else other.step, 0.0, (one,)))
        k += 1
    return out


def _share(part: float, whole: float) -> float:
    """Share of a speed [1]; 0 where it is next to nothing, NaN where the whole is."""
    if abs(whole) <= 0.0:
        return np.nan
    share = part / whole
    return 0.0 if abs(share) < _NOTHING else share


def _alike(share: float, back: float) -> bool:
    """Whether a second jump takes back the first: both from and to nothing, or by one factor."""
    if not np.isfinite([share, back]).all():
        return False
    if share == 0.0 or back == 0.0:
        return share == back
    return abs(share / back - 1.0) < _BACK and any(low < share < high for low, high in _SHARES)


def _finding(
    data: FollowerData,
    span: tuple[int, int, float, tuple[Jump, ...]],
    related: Relation | None,
    shaking: Vibration | None,
    width: int,
    dt: float,
) -> Finding | None:
    """What is told of a time between jumps; None where neither acceleration nor shaking contradicts the reading."""
    start, stop, share, jumps = span
    if len(jumps) == 1:
        stop = _goes_on_until(data.y, shaking, start, stop, abs(jumps[0].before), dt)
        if (stop - start) * dt < _GOES_ON_S:
            return None
    said = [] if related is None else [related.says(j.step // width) for j in jumps if lives_about(shaking, j.step, dt)]
    nats = [s[0] for s in said if np.isfinite(s[1])]
    by_change = len(nats) == len(jumps) and sum(nats) >= 2.0 * ENOUGH and min(nats) >= 0.0
    asked = np.abs(data.asked[start:stop])
    told = bool(np.mean(np.nan_to_num(asked) > _TOLD * abs(jumps[0].before)) > _TOLD)
    goes_on = (
        told if np.isfinite(asked).any() else bool(nats) and sum(nats) >= ENOUGH
    )  # what works at rest shakes it, too
    shakes = share == 0.0 and shaking is not None and shaking.moves(start, stop)
    by_shaking = shakes and goes_on and min(nats, default=0.0) > _AGAINST
    if not by_change and not by_shaking:
        return None
    mode = FaultMode.NO_SIGNAL if share == 0.0 else FaultMode.INEFFICIENT if share < 1.0 else FaultMode.OUTSIDE_TABLE
    loss = 1.0 - share
    what = "nothing" if share == 0.0 else f"{share:.2f} × what it was"
    text = f"{data.name} reads {what} from one reading to the next"
    text += (
        f", and is back {(stop - start) * dt:.1f} s later in the same way"
        if len(jumps) > 1
        else f", while the inertial unit shakes on as that of a body that moves, for {lasting((stop - start) * dt, 1)}"
    )
    if by_change and related is not None:
        whole = sum(abs(s[1]) for s in said)
        part = sum(s[2] * np.sign(s[1]) for s in said) / whole
        text += (
            f"; the body's acceleration (imu.acceleration) has {part:.2f} × of {'these changes' if len(jumps) > 1 else 'this change'}, of others 1 ± {plain(related.spread, 2)} × "
            f"and {plain(related.noise / abs(related.gain), 2)} {{speed_unit}}"
        )
    if by_shaking:
        text += "; all the time the inertial unit shakes as it does in motion, and not as at rest"
    size = Epsilon(loss, loss, loss) if share < 1.0 else None
    p = _P[len(jumps) - 1]
    return sensor_finding(start, stop, mode, p, size, None, (f"{text}: the reading is wrong.",), SENSOR_SHARE)


def _goes_on_until(y: Array, shaking: Vibration | None, start: int, stop: int, speed: float, dt: float) -> int:
    """Step until which a speed that fell to nothing stays there while the unit shakes on as that of a moving body."""
    if shaking is None:
        return start
    back = np.flatnonzero(np.abs(np.nan_to_num(y[start + 1 : stop])) > _NOTHING * speed)
    stop = start + 1 + int(back[0]) if back.size else stop
    first = start // shaking.width + 1
    level = shaking.level[first : stop // shaking.width]
    quiet = np.flatnonzero(~(level > _ALIVE * shaking.motion))
    return min(stop, (first + (int(quiet[0]) if quiet.size else level.size)) * shaking.width)


def lives_about(shaking: Vibration | None, step: int, dt: float) -> bool:
    """Whether the unit shakes about a jump as that of a body that goes on."""
    if shaking is None:
        return False
    reach = round(_AROUND_S / dt)
    first, last = max(0, step - reach) // shaking.width, (step + reach) // shaking.width + 1
    part = shaking.level[first:last]
    return bool(part.size and np.isfinite(part).all() and np.min(part) > _ALIVE * shaking.motion)
