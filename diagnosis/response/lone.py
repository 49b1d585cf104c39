"""A drive of which no answer to its command is found, by what its channel shows alone: frozen, wild, noisy, or no readings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.answering import MOVES, in_blocks
from diagnosis.response.by_channel import LEAST_SPIKES, SPIKE_GAP_S, broken_off, lost_of
from diagnosis.response.by_share import shares_at_once
from diagnosis.response.channel import Samples, holds_of, samples_of
from diagnosis.response.identification import without_command
from diagnosis.response.inputs import FollowerData, cell_of
from diagnosis.response.models import BLOCK_S
from diagnosis.response.sides import by_itself, sides_of, without_doubles
from diagnosis.response.states import judge
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, State
from replay.machine.config import Limits

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_BY_CHANNEL = FaultMode.STUCK, FaultMode.NOISY  # what needs no command
_OWN = 2  # of the channel's longest holds, that may be faults
_STEADY_S, _LEAST = 1.0, 40  # for which a command rests; readings meanwhile that show how the channel changes
_BEYOND = 2.0  # times the fastest of the driving, or of what is asked for: so far off is a wild reading
_MOVING = 0.1  # of that speed: a reading of driving
_LIVES = 0.5  # of them: so many change
_ONLY_ASKED = (
    0.85  # that it is stuck, by a command that changed meanwhile, of a channel not known to change under one that rests
)


def by_its_channel(data: FollowerData, yaw: Array | None, limits: Limits, dt: float) -> tuple[Finding, ...]:
    """Findings of a drive by its channel alone, in order of time; none says anything healthy.

    Parameters
    ----------
    data : FollowerData
        The drive.
    yaw : Array or None, shape (n,)
        Measured yaw rate [rad/s].
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    """
    width, cell = max(1, round(BLOCK_S / dt)), cell_of(dt)
    size = data.y.size
    samples = samples_of(data.y, data.fresh)
    if samples.step.size < _LEAST or not np.isfinite(samples.value).any():
        return ()
    samples = _beyond_driving(samples, data, dt)
    one = in_blocks(data, without_command(-(-size // cell)), (data.y, samples), (), (cell, width), limits, dt)
    holds = holds_of(samples, MOVES * limits.driving_speed, dt)
    habit = float(holds[_OWN]) if holds.size > _OWN else 0.0
    wheel = one.wheel._replace(habit=habit, blocks=one.wheel.blocks._replace(habitual=False))
    one = judge(one._replace(wheel=wheel, yaw=yaw), None, dt, width)
    nowhere = np.zeros(size, np.bool_), np.zeros(one.driving.size, np.bool_)
    sensor, _ = sides_of(one, [s for s in one.spells if s.mode in _BY_CHANNEL], ((), ()), nowhere, limits, dt)
    steady = _steady(data.asked, dt)[samples.step]
    found = [_as_sure(f, samples, data.asked, steady, limits) for f in sensor.findings]
    asked = np.abs(np.nan_to_num(data.asked)) > limits.driving_speed
    found += [by_itself(f) for f in broken_off(one.wheel, (), limits.driving_speed, data.asked)]
    found += shares_at_once(data, samples, limits.driving_speed, dt)
    return tuple(without_doubles([*(f for f in found if f is not None), *lost_of(wheel, data.lost, asked)]))


def not_shared(found: Mapping[str, Sequence[Finding]]) -> dict[str, tuple[Finding, ...]]:
    """Findings of several drives without those that another one has of the same kind at that time: the ground's, or the recorder's.

    `found` by wheel; so is what is returned.
    """
    return {
        w: tuple(
            f
            for f in mine
            if not any(
                f.mode is g.mode and f.start < g.stop and g.start < f.stop for o in found if o != w for g in found[o]
            )
        )
        for w, mine in found.items()
    }


def _beyond_driving(samples: Samples, data: FollowerData, dt: float) -> Samples:
    """Samples of which only wild readings count as such that are far beyond all others, and the command, and come again and again.

    What is read now and then leaves few readings of a short motion; neighbours count once, for a wrong position makes two wrong speeds.
    """
    top = max(float(np.nanmax(np.abs(samples.value))), float(np.nanmax(np.abs(data.asked), initial=0.0)))
    far = samples.wild & (np.abs(data.y[samples.step]) > _BEYOND * top)
    if np.count_nonzero(np.abs(samples.value[~samples.wild]) > _MOVING * top) < _LEAST:
        far[:] = False  # of a channel that hardly moves beside them, nothing tells how fast it may be
    first = np.flatnonzero(np.diff(np.r_[False, far].astype(np.int8)) == 1)
    groups = np.split(first, np.flatnonzero(np.diff(samples.step[first]) * dt > SPIKE_GAP_S) + 1)
    wild = np.zeros_like(samples.wild)
    for group in groups:
        wild[group] = group.size >= LEAST_SPIKES
    return samples._replace(wild=wild)


def _steady(asked: Array, dt: float) -> Flags:
    """Steps at which a command has rested for a while, shape (n,)."""
    changes = np.flatnonzero(np.diff(np.nan_to_num(asked), prepend=np.nan) != 0.0)
    since = np.arange(asked.size) - changes[np.searchsorted(changes, np.arange(asked.size), side="right") - 1]
    return np.asarray(since * dt > _STEADY_S)


def _as_sure(f: Finding, samples: Samples, asked: Array, steady: Flags, limits: Limits) -> Finding | None:
    """A finding as sure as the channel shows it: a value that is held says nothing where the channel holds it by its nature.

    So do a simulated one, and odometry that is made from commands, while the command rests.
    """
    if f.mode is not FaultMode.STUCK:
        return f
    inside = (samples.step >= f.start) & (samples.step < f.stop)
    other = steady & ~inside & (np.abs(samples.value) > MOVES * limits.driving_speed)
    if np.count_nonzero(other) >= _LEAST and np.mean(~samples.same[other]) >= _LIVES:
        return f
    told = asked[f.start : f.stop]
    if not np.isfinite(told).any() or np.nanmax(told) - np.nanmin(told) < limits.driving_speed:
        return None
    share = _ONLY_ASKED
    rest = tuple(replace(h, p=share * h.p) for h in f.hypotheses if h.side != "none")
    none = Hypothesis("none", State.HEALTHY.value, 1.0 - sum(h.p for h in rest))
    return replace(f, probability=share * f.probability, hypotheses=(*rest, none))
