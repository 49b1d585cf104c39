"""Drives that pull away from their command, harder than they otherwise do: the wheel runs as its motor says, whatever it is told.

A loop pulls against what its speed is off the command, be that a load, a slope or its own wrong sensor; and what is only read wrong takes
its usual effort. Neither pulls hard in the direction in which the speed has left the command.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.spells import spans_of
from diagnosis.results.assessment import Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, Sentence, lasting
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_S, _GAP_BLOCKS = 2.0, 2  # for which it does so, and within which it is the same time
_FAR, _OFF = 3.0, 0.08  # usual misfits, and share of the top speed, off its command
_HARD, _USUAL, _LEAST_BLOCKS = 1.5, 0.9, 80  # times that quantile of its effort in the rest of so much driving
_FARTHER, _HARDER = 0.2, 2.0  # of the top speed, or as many times its effort, that tell it from an offset or a friction
_BOTH_WAYS = 0.02  # of the blocks, in which an effort that has a direction is positive, and negative
_P, _LONE_P, _SENSOR = 0.93, 0.75, 0.03  # set by hand; a lone drive may have another source of commands


def runaways(judged: Mapping[str, Judged], efforts: Mapping[str, Array], block_s: float) -> dict[str, list[Finding]]:
    """Times in which a drive pulls away from its command, by wheel; none that two of them do together, as with other commands.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    efforts : Mapping[str, Array], each of shape (b,)
        Mean effort of each block, in any unit; wheels without one are left out.
    block_s : float
        Length of a block [s].
    """
    spans = {
        w: _spans(judged[w], e, block_s) for w, e in efforts.items() if w in judged and judged[w].response.answered
    }
    return {
        w: [
            _finding(judged[w], s, efforts[w], block_s)
            for s in own
            if not any(a < s[1] and s[0] < b for o, others in spans.items() if o != w for a, b in others)
        ]
        for w, own in spans.items()
    }


def _spans(one: Judged, effort: Array, block_s: float) -> list[tuple[int, int]]:
    """Blocks [start, stop) in which a drive pulls away from its command."""
    b = one.wheel.blocks
    known = one.driving & np.isfinite(effort) & np.isfinite(b.mean)
    if np.count_nonzero(known) < _LEAST_BLOCKS:
        return []
    if min(np.mean(effort[known] > 0.0), np.mean(effort[known] < 0.0)) < _BOTH_WAYS:
        return []  # it may have no direction
    top = float(np.nanquantile(np.abs(b.mean), 0.99))
    off = b.mean - np.clip(b.mean, b.low, b.high)
    far = np.abs(off) > np.maximum(_FAR * b.noise, _OFF * top)
    near = known & ~far  # a wheel whose loop has wound up is braked at many times the usual speed
    way = float(np.sign(np.sum((effort * b.mean)[near])))
    away = known & far & (way * effort * off > 0.0)
    out = []
    for start, stop in spans_of(away, _GAP_BLOCKS):
        rest = known.copy()
        rest[start:stop] = False
        if (stop - start) * block_s < _LEAST_S or np.count_nonzero(rest) < _LEAST_BLOCKS:
            continue
        usual = float(np.quantile(np.abs(effort[rest]), _USUAL))
        hard = start + np.flatnonzero(np.abs(effort[start:stop]) > usual)
        if usual == 0.0 or not hard.size or (hard[-1] + 1 - hard[0]) * block_s < _LEAST_S:
            continue
        part = slice(int(hard[0]), int(hard[-1]) + 1)
        pulled = float(np.median(np.abs(effort[part]))) / usual
        left = float(np.median(np.abs(off[part]))) / top
        if pulled > _HARD and (left > _FARTHER or pulled > _HARDER):
            out.append((part.start, part.stop))
    return out


def _finding(one: Judged, span: tuple[int, int], effort: Array, block_s: float) -> Finding:
    start, stop = span
    b, width = one.wheel.blocks, int(one.wheel.blocks.start[1])
    middle = 0.5 * (b.low + b.high)[start:stop]
    rest = np.r_[effort[:start], effort[stop:]]
    times = float(np.nanmedian(np.abs(effort[start:stop])) / np.nanquantile(np.abs(rest), _USUAL))
    text = (
        f"For {lasting((stop - start) * block_s, 1)} {one.data.name} is at {plain(np.nanmedian(b.mean[start:stop]), 2)} {{speed_unit}} where its command makes it "
        f"{plain(np.nanmedian(middle), 2)} {{speed_unit}}, and its drive pulls that way, {times:.1f} times as hard as it usually does: it runs away. A loop that "
        "believes a wrong sensor would pull the other way, and a reading that is only wrong takes the usual effort."
    )
    p = _LONE_P if one.alone else _P
    evidence = [Sentence(About.EFFORT, text)]
    if one.alone:
        evidence.append(
            Sentence(
                About.EFFORT,
                "With a single drive, another source of commands, such as a driver's override, looks the same.",
            )
        )
    return Finding(
        start=start * width, stop=min(stop * width, one.data.y.size), side=Side.ACTUATOR, mode=FaultMode.STUCK, probability=p,
        hypotheses=(
            Hypothesis(Side.ACTUATOR.value, FaultMode.STUCK.value, p),
            Hypothesis(Side.SENSOR.value, FaultMode.OUTSIDE_TABLE.value, _SENSOR),
            Hypothesis("none", State.HEALTHY.value, 1.0 - p - _SENSOR),
        ),
        epsilon=Epsilon(1.0, 1.0, 1.0), sat=None, evidence=tuple(evidence), tier=Tier.RESPONSE,
    )  # fmt: skip
