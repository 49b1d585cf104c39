"""Readings that are held while nothing changes: a coarse channel, a simulated one, and a machine that goes on as it does.

A speed that is rounded, filtered or simulated gives one value for as long as it changes by less than a step: on a steady drive, or creeping
down a slope, for many seconds. All wheels then do, or a lone one does so again and again; neither is stuck by that alone, nor proved by it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from diagnosis.response.channel import Samples, holds_of
from diagnosis.response.machine import Judged
from diagnosis.response.models import Blocks
from diagnosis.response.spells import Spell
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, Side, State
from replay.signals.resolution import rounding_step

_HELD, _MOSTLY = 0.9, 0.5  # of a block's readings; of the blocks
_MOST = 0.1, 0.85  # of what is asked: its ends may have what comes before and after
_CHANGES = 0.05  # of the top speed, by which what is asked changes: then wheels would, too
_NEAR = 2.5  # usual misfits off the command
_FEW = 16.0  # counts in a sample: of more, noise makes one more or less now and then
_ANSWER_S = 0.5  # in which a reading answers a command that is another one
_LEAST_HOLD_S, _LONG_S = 1.0, 8.0  # of a hold that shows a habit; of what it is a share of
_SENSOR, _DRIVE = 0.55, 0.35  # that such a time is the sensor's, or the machine's that goes on
_JUMP, _NO_JUMP, _USUAL = 2.0, 0.25, 0.99  # times the changes of that quantile: at the end of a stuck time, and of none
_AGAIN, _AS_LONG = 3, 0.25  # other holds, of that share of its length


def calm_hold(spell: Spell, wheel: str, judged: Mapping[str, Judged], still: float) -> bool:
    """Whether a held reading is no sign of a stuck sensor: what its command makes of it hardly changes, and all wheels hold theirs, or it often does.

    A lone channel must hold what its command makes of it; its other holds may be anywhere. So must one of few counts, which no other one need hold.

    Parameters
    ----------
    spell : Spell
        Of the wheel.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    still : float
        What counts as standstill [m/s].
    """
    if spell.mode is not FaultMode.STUCK or spell.own or spell.kin:
        return False
    part, one = slice(spell.start, spell.stop), judged[wheel].wheel
    if _on_a_count(judged[wheel], part):
        return True
    if not _calm(one.blocks, part):
        return False
    others = [j.wheel.blocks for w, j in judged.items() if w != wheel]
    if others:
        return all(np.mean(b.same[part] >= _HELD * np.maximum(b.readings[part], 1.0)) > _MOSTLY for b in others)
    b = one.blocks
    off = np.abs(b.mean - np.clip(b.mean, b.low, b.high))[part]
    holds = holds_of(one.samples, still, one.dt)
    long = np.count_nonzero(holds > _AS_LONG * (spell.stop - spell.start) * int(b.start[1]) * one.dt)
    return bool(np.nanmedian(off) <= _NEAR * np.nanmedian(b.noise[part]) and long > _AGAIN)


def either(sensor: Assessment, one: Judged, still: float) -> Assessment:
    """A lone sensor whose stuck times may as well be a machine that goes on at one speed whatever it is told: its channel holds steady speeds anyway.

    So may one that ends where it was held. Where the reading jumps at the end, as none of a moving machine does, it stays the sensor's.

    Parameters
    ----------
    sensor : Assessment
        The sensor.
    one : Judged
        Its wheel.
    still : float
        What counts as standstill [m/s].
    """
    return replace(sensor, findings=tuple(_either(f, one, still) for f in sensor.findings))


def _either(f: Finding, one: Judged, still: float) -> Finding:
    wheel, samples = one.wheel, one.wheel.samples
    if f.mode is not FaultMode.STUCK or f.side is not Side.SENSOR:
        return f
    least = max(_LEAST_HOLD_S, _AS_LONG * min((f.stop - f.start) * wheel.dt, _LONG_S))
    often = np.count_nonzero(holds_of(samples, still, wheel.dt) > least) > _AGAIN
    back = _back(f, samples)
    if back > _JUMP or (not often and back > _NO_JUMP):
        return f
    text = (
        "Its channel holds steady speeds anyway, so that"
        if often
        else "It comes back where it was held, as a stuck sensor seldom does:"
    ) + " a drive that keeps its speed whatever it is told looks the same."
    return replace(
        f,
        probability=_SENSOR,
        hypotheses=(
            Hypothesis(Side.SENSOR.value, f.mode.value, _SENSOR),
            Hypothesis(Side.ACTUATOR.value, f.mode.value, _DRIVE),
            Hypothesis("none", State.HEALTHY.value, 1.0 - _SENSOR - _DRIVE),
        ),
        evidence=(*f.evidence, text),
    )


def _back(f: Finding, samples: Samples) -> float:
    """Change of the reading at the end of a hold, by the largest ones that a moving machine usually makes [1]; infinite where the log ends in it."""
    change = np.abs(np.nan_to_num(samples.change))
    inside = (samples.step >= f.start) & (samples.step < f.stop)
    at, outside = np.flatnonzero(inside), change[~inside & (change > 0.0)]
    if not at.size or not outside.size or at[-1] + 1 >= change.size:
        return np.inf
    return float(change[at[-1] + 1]) / float(np.quantile(outside, _USUAL))


def _on_a_count(one: Judged, part: slice) -> bool:
    """Whether a reading of few counts is held where its command rests, at that command: at such a speed every sample has the same number of them."""
    blocks, asked = one.wheel.blocks, one.data.asked
    width = int(blocks.start[1]) if blocks.start.size > 1 else 1
    steps = slice(part.start * width, part.stop * width)
    known, told = one.wheel.samples.value, asked[steps]
    told = told[round(_MOST[0] * told.size) : max(told.size - round(_ANSWER_S / one.wheel.dt), 1)]
    count = rounding_step(known[np.isfinite(known)])
    inside = (one.wheel.samples.step >= steps.start) & (one.wheel.samples.step < steps.stop)
    if count <= 0.0 or not inside.any() or not told.size or not np.isfinite(told).all():
        return False
    held = float(np.nanmedian(known[inside]))
    rests = float(np.ptp(told)) <= _CHANGES * abs(held)
    return bool(rests and abs(held) <= _FEW * count and abs(held - float(np.median(told))) <= count)


def _calm(blocks: Blocks, part: slice) -> bool:
    """Whether what the command makes of a wheel stays where it is."""
    low, high = blocks.low[part], blocks.high[part]
    if not (np.isfinite(low) & np.isfinite(high)).all() or not np.isfinite(blocks.mean).any():
        return False
    told = 0.5 * (low + high)
    top = float(np.nanquantile(np.abs(blocks.mean), 0.95))
    return bool(np.ptp(np.quantile(told, _MOST)) <= _CHANGES * top)
