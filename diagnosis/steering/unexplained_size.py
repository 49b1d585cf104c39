"""How large what no fault explains is on a steering axle: an angle off its second measurement or its model, an opening off its command."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.sizes import amount
from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.path import AxleFilter
from diagnosis.steering.side_findings import SideFindings
from replay.arrays.runs import united
from replay.faults import Side
from replay.machine.quantities import OPENING

Array = NDArray[np.float64]

_LONG_S = 1.0
_SPREADS = 3.0  # standard deviations of an angle about its model
_LEAST = {
    Side.SENSOR: 0.004,
    Side.ACTUATOR: 0.02,
}  # rad and of full opening between two measurements, of which less is none


def size_words(side: Side, found: SideFindings, inputs: AxleInputs, axle: AxleFilter, path: SteeringPath) -> str:
    """How far a side is off where no fault explains it, to follow its name; empty where that is brief, or hardly anything.

    Parameters
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`.
    found : SideFindings
        What is left unexplained of it.
    inputs : AxleInputs
        The axle's channels.
    axle : AxleFilter
        Its filters.
    path : SteeringPath
        Most probable models, with the angle along them.
    """
    dt = axle.blocks.dt
    measured = inputs.angle_redundant if side is Side.SENSOR else inputs.valve_redundant
    if side is Side.ACTUATOR and not measured:
        return ""
    off, limit = _off(side, axle, path, measured=measured)
    spans = [(a, b) for a, b in united(found.unexplained) if (b - a) * dt >= _LONG_S]
    peaks = [(_peak(off[a:b], limit[a:b]), a, b) for a, b in spans]
    told = sorted((p for p in peaks if p[0] != 0.0), key=lambda p: -abs(p[0]))
    if not told:
        return ""
    most, a, b = told[0]
    end = min(b * dt, inputs.timeline.size * inputs.timeline.dt)
    by = "its second measurement" if side is Side.SENSOR and measured else "what its model expects"
    by = "its command" if side is Side.ACTUATOR else by
    size = amount(most, "rad" if side is Side.SENSOR else OPENING, 2).replace("-", "−")
    more = f", and at {len(told) - 1} other time{'s' if len(told) > 2 else ''} by less" if len(told) > 1 else ""
    return f"off {by} by up to {size} at {a * dt:.1f}–{end:.1f} s{more}"


def _off(side: Side, axle: AxleFilter, path: SteeringPath, *, measured: bool) -> tuple[Array, Array]:
    """What a side is off by in each block, and what hardly counts, each of shape (m,) [rad or fraction]."""
    blocks, least = axle.blocks, np.full(axle.blocks.mean.size, _LEAST[side])
    if side is Side.ACTUATOR:
        return blocks.redundancy.opening - blocks.redundancy.command, least
    angle = np.where(blocks.count > 0, blocks.mean, np.nan)
    if measured:
        return angle - blocks.redundancy.angle, least
    spread = np.sqrt(axle.model.noise.white + np.maximum(path.variance[:, 0], 0.0))
    return angle - path.mean[:, 0], np.maximum(_SPREADS * spread, least)


def _peak(off: Array, limit: Array) -> float:
    """The value that is furthest off, beyond its limit; 0 where none is."""
    beyond = np.where(np.abs(np.nan_to_num(off)) > limit, np.nan_to_num(off), 0.0)
    return float(beyond[np.argmax(np.abs(beyond))]) if beyond.size else 0.0
