"""Axles that do not move as any model of theirs says: what their model accuses is then believed no further than a measurement shows it.

Where a mission's motions scatter about the best plant by more than half a per cent even where it fits best, valves creep within
their overlap, axles push each other, oil warms: the filters' evidence, which knows none of that, is sure of faults that are none.
A fault of the sensor must then show between two angles, and one of the valve between its command and its opening, beyond what they
differ by at such motion all through the mission; without a second measurement only a sensor that comes no more is told.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise_growth import NoiseGrowth, noise_growth
from diagnosis.results.assessment import Finding
from diagnosis.steering.blocks import SteeringBlocks
from diagnosis.steering.driven import driven_by
from diagnosis.steering.findings import SideFindings
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.plant import SteeringPlant
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

_WINDOW_S, _END = 0.5, 0.2  # of a motion, and share of it over which its ends are taken
_MOVED = 0.03  # rad that an axle should move in a window
_NEAR = 0.4  # of what it should: further away is a fault, or an end stop
_FEW = 8  # windows
_BEST = 0.3  # quantile of windows
_SCATTER = 0.0045  # of a motion: machines that move as their model says are below
_MOTION_S = 0.05  # to either side
_BEYOND = 2.5  # times what is usual at such motion
_MOSTLY = 0.4  # of a finding: its ends may come late
_LEAST = {Side.SENSOR: 0.012, Side.ACTUATOR: 0.02}  # rad and of full opening: less is nobody's fault


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
    with np.errstate(divide="ignore", invalid="ignore"):
        share = did / should
    share = np.sort(share[(np.abs(should) > _MOVED) & (np.abs(share - 1.0) < _NEAR)])
    if share.size < _FEW:
        return float(np.inf) if np.count_nonzero(np.abs(did) > _MOVED) >= _FEW else None
    half = share.size // 2
    narrowest = int(np.argmin(share[half:] - share[: share.size - half]))
    usual = float(share[narrowest : narrowest + half + 1].mean())
    return float(np.quantile(np.abs(share - usual), _BEST))


def moves_otherwise(scatters: Sequence[float | None]) -> bool:
    """Whether a machine's axles do not move as their models say; faults scatter one axle, the machine's structure all of them."""
    known = [s for s in scatters if s is not None]
    return bool(known) and min(known) > _SCATTER


def acquitted(side: Side, found: SideFindings, inputs: AxleInputs, blocks: SteeringBlocks) -> SideFindings:
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
    """
    apart, moved = _apart(side, inputs, blocks)
    growth = noise_growth(apart**2, moved, blocks.dt) or NoiseGrowth(0.0, 0.0)
    limit = np.maximum(_BEYOND**2 * growth.variance(moved), _LEAST[side] ** 2)
    kept, open_ = [], list(found.unexplained)
    for f in found.findings:
        a, b = f.start // blocks.length, -(-f.stop // blocks.length)
        if _shown(f, apart[a:b], limit[a:b]):
            kept.append(f)
        else:
            open_.append((a, b))
    return SideFindings(tuple(kept), tuple(open_))


def _apart(side: Side, inputs: AxleInputs, blocks: SteeringBlocks) -> tuple[Array, Array]:
    """A channel less its second measurement in each block, NaN where there is none, and how fast it moves there [1/s]."""
    twice = blocks.redundancy
    if side is Side.SENSOR:
        by = np.where(blocks.count > 0, blocks.mean, np.nan)
        apart = by - twice.angle if inputs.angle_redundant else np.full(by.size, np.nan)
    else:
        apart, by = twice.opening - twice.command, twice.command
    reach = max(1, round(_MOTION_S / blocks.dt))
    moved = np.full(by.size, np.nan)
    moved[reach:-reach] = np.abs(by[2 * reach :] - by[: -2 * reach]) / (2 * reach * blocks.dt)
    return apart, np.nan_to_num(moved)


def _shown(finding: Finding, apart: Array, limit: Array) -> bool:
    known = np.isfinite(apart)
    if known.any():
        return bool(np.mean(apart[known] ** 2 > limit[known]) >= _MOSTLY)
    return finding.side is Side.SENSOR and finding.mode is FaultMode.NO_SIGNAL
