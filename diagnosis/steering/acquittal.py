"""Axles that do not move as any model of theirs says: what their model accuses is then believed no further than a measurement shows it.

Where a mission's motions scatter about the best plant by more than half a per cent even where it fits best, valves creep within
their overlap, axles push each other, oil warms: the filters' evidence, which knows none of that, is sure of faults that are none.
A fault of the sensor must then show between two angles, and one of the valve between its command and its opening, beyond what they
differ by at such motion all through the mission; without a second measurement only a sensor that comes no more is told, one
that never rests and repeats one reading to its last digit, or one that shakes far more than it does elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum
from diagnosis.channels.noise_growth import NoiseGrowth, noise_growth
from diagnosis.results.assessment import Finding
from diagnosis.steering.blocks import SteeringBlocks
from diagnosis.steering.denied import shaken_power, usual_power
from diagnosis.steering.driven import driven_by
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.side_findings import SideFindings, span_of
from replay.arrays.quantiles import quantile_of
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

_WINDOW_S, _END = 0.5, 0.2  # of a motion, and share of it over which its ends are taken
_MOVED = 0.03  # rad that an axle should move in a window
_NEAR = 0.4  # of what it should: further away is a fault, or an end stop
_FEW = 8  # windows
_BEST = 0.3  # quantile of windows
_SCATTER = 0.0045  # of a motion: machines that move as their model says are below
_MOTION_S = 0.05  # to either side
_EVEN_S = 1.0  # over which a command that switches to and fro is its mean
_BEYOND = 2.5  # times what is usual at such motion
_MOSTLY = 0.4  # of a finding: its ends may come late
_READ = 0.5  # of a finding: what delivers less is silent
_TELLING_S = 0.3  # for which a fault would have to show
_FOLLOWED = (
    0.25  # of the power that a fault would leave between a command and its opening: one that leaves less follows
)
_RESTLESS, _FROZEN = (
    0.3,
    0.01,
)  # share of readings that change: of a sensor that never rests, and of one that repeats itself
_FEW_READINGS = 25
_FAR_MORE = 16.0  # times the usual power of what changes from reading to reading
_CALM = 0.1  # quantile of stretches of so many readings: in the others they change more often
_LEFT = 0.5  # of the power between two measurements: what a fault that is believed leaves of it, at most
_LEAST = {Side.SENSOR: 0.012, Side.ACTUATOR: 0.02}  # rad and of full opening: less is nobody's fault
_LEAST_NOISE = (
    0.065  # of full opening: a spool that is slow, or has play, differs by as much from a command that moves fast
)
_BELIEVED = 0.5  # of these, where axles move as their model says


def scatter_of(blocks: SteeringBlocks, plant: SteeringPlant) -> float | None:
    """By how much motions scatter about what the plant says of them, as a share, where it fits best; infinite where it explains none.

    None where there are few motions.

    Parameters
    ----------
    blocks : SteeringBlocks
        The axle.
    plant : SteeringPlant
        As it was identified.
    """
    n = max(5, round(_WINDOW_S / blocks.dt))
    end = max(1, round(_END * n))
    start = np.arange(0, blocks.mean.size - n + 1, n // 2)
    if not start.size:
        return None
    rate = np.nan_to_num(driven_by(plant, blocks).command)
    late = round(plant.lag / blocks.dt)
    driven = np.concatenate([[0.0], np.cumsum(np.concatenate([np.zeros(late), rate])[: rate.size])])
    should = (driven[start + n - end // 2] - driven[start + end // 2]) * blocks.dt
    known = np.where(blocks.count > 0, blocks.mean, 0.0)
    total, count = (np.concatenate([[0.0], np.cumsum(x)]) for x in (known, blocks.count > 0))

    def mean(first: NDArray[np.intp]) -> Array:
        number = count[first + end] - count[first]
        return np.where(number > 0, (total[first + end] - total[first]) / np.maximum(number, 1), np.nan)

    did = mean(start + n - end) - mean(start)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        share = did / should
    share = np.sort(share[(np.abs(should) > _MOVED) & (np.abs(share - 1.0) < _NEAR)])
    if share.size < _FEW:
        return float(np.inf) if np.count_nonzero(np.abs(did) > _MOVED) >= _FEW else None
    half = share.size // 2
    narrowest = int(np.argmin(share[half:] - share[: share.size - half]))
    usual = float(share[narrowest : narrowest + half + 1].mean())
    return float(quantile_of(np.abs(share - usual), _BEST))


def moves_otherwise(scatters: Sequence[float | None]) -> bool:
    """Whether a machine's axles do not move as their models say; faults scatter one axle, the machine's structure all of them."""
    known = [s for s in scatters if s is not None]
    return bool(known) and min(known) > _SCATTER


def acquitted(
    side: Side, found: SideFindings, inputs: AxleInputs, blocks: SteeringBlocks, *, believed: bool
) -> SideFindings:
    """Findings of a side that its own measurements show; the others are left unexplained.

    Parameters
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`.
    found : SideFindings
        By the model.
    inputs : AxleInputs
        The axle's channels.
    blocks : SteeringBlocks
        The same in blocks.
    believed : bool
        Whether the axle moves as its model says, so that the model is believed where nothing is measured twice.
    """
    apart, by, moved = _apart(side, inputs, blocks)
    spans = [span_of(f, blocks.length) for f in found.findings]
    usual = apart**2
    for a, b in spans:
        usual[a:b] = np.nan
    growth = noise_growth(usual, moved, blocks.dt) or NoiseGrowth(0.0, 0.0)
    least = _LEAST[side] * (_BELIEVED if believed else 1.0)
    limit = np.maximum(_BEYOND**2 * growth.variance(moved), least**2)
    kept, open_, refuted = [], list(found.unexplained), list(found.refuted)
    for f, (a, b) in zip(found.findings, spans, strict=True):
        shown = _shown(f, apart[a:b], by[a:b], limit[a:b], blocks.dt, believed=believed)
        if shown or _frozen(f, found, inputs) or _shaken(f, found, inputs, blocks):
            kept.append(f)
        elif side is Side.ACTUATOR and _followed(f, apart[a:b], by[a:b], limit[a:b]):
            refuted.append((a, b))
        else:
            open_.append((a, b))
    return SideFindings(tuple(kept), tuple(open_), tuple(refuted))


def _apart(side: Side, inputs: AxleInputs, blocks: SteeringBlocks) -> tuple[Array, Array, Array]:
    """A channel less its second measurement in each block, what it should be, NaN where there is none, and how fast that moves [1/s]."""
    twice = blocks.redundancy
    if side is Side.SENSOR:
        by = twice.angle if inputs.angle_redundant else np.full(blocks.mean.size, np.nan)
        apart, moves = np.where(blocks.count > 0, blocks.mean, np.nan) - by, blocks.mean
    else:
        by = moves = twice.command
        apart = twice.opening - by
    reach = max(1, round(_MOTION_S / blocks.dt))
    moved = np.full(by.size, np.nan)
    moved[reach:-reach] = np.abs(moves[2 * reach :] - moves[: -2 * reach]) / (2 * reach * blocks.dt)
    return apart, by, np.nan_to_num(moved)


def _shown(finding: Finding, apart: Array, by: Array, limit: Array, dt: float, *, believed: bool) -> bool:
    """Whether most of the blocks in which a fault would show do show it; `believed` where nothing is measured twice."""
    known = np.isfinite(apart)
    if not known.any() or (finding.mode.total and np.mean(known) < _READ):
        return believed or (finding.side is Side.SENSOR and finding.mode is FaultMode.NO_SIGNAL)
    if finding.mode.varying:
        small = finding.side is Side.ACTUATOR and not believed and float(np.mean(apart[known] ** 2)) < _LEAST_NOISE**2
        return not small and _mostly(apart[known] ** 2 > limit[known])
    should = _puts_between(finding, by)
    telling = known & (should**2 > limit)
    if np.count_nonzero(telling) < _TELLING_S / dt:
        return False
    left = float(np.sum((apart - should)[telling] ** 2))
    if finding.side is Side.ACTUATOR and not _mostly(_evened(apart, dt)[telling] ** 2 > limit[telling]):
        return False  # a valve is slower than a command that switches to and fro, and rests at its mean
    return _mostly(apart[telling] ** 2 > limit[telling]) and left < _LEFT * float(np.sum(apart[telling] ** 2))


def _evened(apart: Array, dt: float) -> Array:
    """Mean over `_EVEN_S` of what is known, shape (n,)."""
    width = max(1, round(_EVEN_S / dt))
    known = np.isfinite(apart)
    return moving_sum(np.where(known, apart, 0.0), width) / np.maximum(moving_sum(known, width), 1)


def _puts_between(finding: Finding, by: Array) -> Array:
    """What a fault puts between a channel and its second measurement, which is `by` in health."""
    kept = 0.0 if finding.mode.total or finding.epsilon is None else 1.0 - finding.epsilon.value
    level = finding.sat.mean if finding.sat is not None and finding.mode is FaultMode.STUCK else 0.0
    return kept * by + level - by


def _followed(finding: Finding, apart: Array, by: Array, limit: Array) -> bool:
    """Whether an opening that is known throughout follows its command, and not as the fault would have it."""
    if finding.mode.varying or not np.isfinite(apart).all():
        return False
    power = float(np.mean(apart**2))
    left = float(np.mean((apart - _puts_between(finding, by)) ** 2))
    return power <= min(float(np.mean(limit)), _FOLLOWED * left)


def _frozen(finding: Finding, found: SideFindings, inputs: AxleInputs) -> bool:
    """Whether a sensor repeats one reading although its last digits hardly ever rest, not even while the axle stands."""
    if finding.side is not Side.SENSOR or not finding.mode.total:
        return False
    usual = inputs.fresh & np.isfinite(inputs.angle)
    at = np.flatnonzero(usual[finding.start : finding.stop]) + finding.start
    for f in found.findings:
        usual[f.start : f.stop] = False
    elsewhere = np.abs(np.diff(inputs.angle[usual]))
    if at.size < _FEW_READINGS or elsewhere.size < 2 * _FEW_READINGS or at.size > elsewhere.size:
        return False
    windows = elsewhere[: elsewhere.size // _FEW_READINGS * _FEW_READINGS].reshape(-1, _FEW_READINGS)
    restless = float(quantile_of(np.mean(windows > 0.0, axis=1), _CALM))
    return restless >= _RESTLESS and float(np.mean(np.diff(inputs.angle[at]) != 0.0)) <= _FROZEN


def _shaken(finding: Finding, found: SideFindings, inputs: AxleInputs, blocks: SteeringBlocks) -> bool:
    """Whether a sensor's readings change from one to the next far more than elsewhere in the mission: no axle moves like that.

    Where they do so all through the mission, far more than a healthy sensor's may.
    """
    if finding.side is not Side.SENSOR or finding.mode is not FaultMode.NOISY:
        return False
    usual = usual_power(found, blocks) or inputs.noise.white
    span = span_of(finding, blocks.length)
    known = bool((blocks.count[slice(*span)] > 0).any())
    return known and 0.0 < _FAR_MORE * usual < shaken_power(blocks, *span)


def _mostly(shown: NDArray[np.bool_]) -> bool:
    return bool(shown.size) and bool(np.mean(shown) >= _MOSTLY)
