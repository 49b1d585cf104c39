"""State of every sample of a steering axle's side: faults, healthy where something shows it, else why nothing does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum
from diagnosis.estimation.fault_models import PAIR
from diagnosis.results.assessment import CODE, Finding
from diagnosis.steering import model_bank as sr
from diagnosis.steering.filter import SteeringPath
from diagnosis.steering.path_refinement import SteeringData
from replay.faults import Side, State

Array = NDArray[np.float64]
Span = tuple[int, int]

BLIND_ROWS = (CODE[State.STUCK], CODE[State.NO_SIGNAL])
_ALONE_S, _BETWEEN_S = 6.0, 30.0
REASONS: dict[Side, Mapping[State, str]] = {
    Side.SENSOR: {
        State.NOT_EXCITED: "the axle was not steered, and the sensor's rounding hides its noise",
        State.NOT_ASSESSED: "no valve command to compare with, or no single fault explains the angle well enough",
        State.NO_DATA: "no samples",
    },
    Side.ACTUATOR: {
        State.NOT_EXCITED: "the axle was not steered: nothing shows whether its valve answers",
        State.MASKED: "the steering sensor that would show it delivers nothing usable",
        State.NOT_ASSESSED: "the steering model does not hold here, or no single fault explains the angle",
        State.NO_DATA: "no samples",
    },
}


def exercised(data: SteeringData) -> NDArray[np.bool_]:
    """Blocks in which the command moves the axle by much more than the sensor's noise. Shape (m,)."""
    width = max(1, round(0.5 / data.blocks.dt))
    travel = np.abs(moving_sum(np.nan_to_num(data.driven), width)) * data.blocks.dt
    noise = data.model.noise
    least = 10 * np.sqrt(noise.white / max(1.0, width * float(np.median(data.blocks.count)))) + noise.lsb
    return np.asarray(travel > max(least, 0.5 * data.model.load, 1e-3 * data.model.stop))


def vouched(healthy: NDArray[np.bool_], shown: NDArray[np.bool_], dt: float) -> NDArray[np.bool_]:
    """Healthy blocks for which a movement nearby speaks.

    Between two movements that were obeyed a fault would have had to come and go, which is believed for half a minute;
    before the first and after the last one for as long as a fault is improbable at one in a minute. Shape (m,).
    """
    out = shown & healthy
    idle = healthy & ~shown
    cut = np.flatnonzero(np.diff(np.concatenate([[0], idle.astype(np.int8), [0]])))
    alone = round(_ALONE_S / dt)
    for a, b in zip(cut[::2].tolist(), cut[1::2].tolist(), strict=True):
        left, right = a > 0 and out[a - 1], b < idle.size and healthy[b] and shown[b]
        if left and right and (b - a) * dt <= _BETWEEN_S:
            out[a:b] = True
            continue
        if left:
            out[a : min(b, a + alone)] = True
        if right:
            out[max(a, b - alone) : b] = True
    return out


def states_of(
    side: Side,
    data: SteeringData,
    path: SteeringPath,
    findings: Sequence[Finding],
    open_runs: Sequence[Span],
    masked: Sequence[Span],
    y: Array,
    u: Array,
    reliable: bool,
) -> tuple[NDArray[np.int8], int]:
    """States of one side, and the number of samples that deviate without an explanation.

    Parameters
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`.
    data : SteeringData
        The axle.
    path : SteeringPath
        Most probable models.
    findings : Sequence[Finding]
        Faults of this side.
    open_runs : Sequence[tuple[int, int]]
        Blocks whose fault may not be stated.
    masked : Sequence[tuple[int, int]]
        Samples in which the sensor gives nothing usable.
    y, u : Array, shape (n,)
        Angle and valve command.
    reliable : bool
        Whether valves can be judged by the plant.
    """
    blocks = data.blocks
    rows = path.sensor if side is Side.SENSOR else path.actuator
    shown = exercised(data)
    if side is Side.SENSOR and data.model.noise.resolved:
        shown[:] = True
    well = vouched(rows == sr.OK, shown, blocks.dt)
    by_block = np.where(well, CODE[State.HEALTHY], CODE[State.NOT_EXCITED]).astype(np.int8)
    if side is Side.ACTUATOR and not reliable:
        by_block[:] = CODE[State.NOT_ASSESSED]
    if side is Side.SENSOR:
        unseen = blocks.blind & (blocks.status == PAIR) & ~np.isfinite(blocks.second).any(axis=1)
        by_block[unseen & (by_block == CODE[State.HEALTHY])] = CODE[State.NOT_ASSESSED]
    doubt = 0
    for a, b in open_runs:
        by_block[a:b] = CODE[State.NOT_ASSESSED]
        doubt += (b - a) * blocks.length
    states = np.repeat(by_block, blocks.length)[: y.size].astype(np.int8)
    if side is Side.ACTUATOR:
        for a, b in masked:
            states[a:b] = CODE[State.MASKED]
        states[~np.isfinite(u) & (states == CODE[State.HEALTHY])] = CODE[State.NO_DATA]
    states[~np.isfinite(y) & (states == CODE[State.HEALTHY])] = CODE[State.NO_DATA]
    for f in findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    return states, doubt
