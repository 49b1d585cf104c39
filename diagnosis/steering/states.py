"""State of every sample of a steering axle's side: faults, healthy where something shows it, else why nothing does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.results.assessment import CODE
from diagnosis.steering.excitation import exercised
from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.model_bank import HEALTHY
from diagnosis.steering.path import AxleFilter
from diagnosis.steering.side_findings import SideFindings, Span
from replay.arrays.runs import runs_of
from replay.faults import Side, State

_ALONE_S, _BETWEEN_S = 4.0, 10.0
_SEEN_ALONE_S, _SEEN_BETWEEN_S = 6.0, 30.0  # where the valve's opening is measured: a fault shows at rest too
_REASONS: dict[Side, Mapping[State, str]] = {
    Side.SENSOR: {
        State.NOT_EXCITED: "the axle was not steered, and the sensor's rounding hides its noise",
        State.NO_DATA: "no samples",
    },
    Side.ACTUATOR: {
        State.NOT_EXCITED: "the axle was not steered, so there is no evidence on its {valve}",
        State.MASKED: "the steering sensor, which is needed for it, delivers nothing usable",
        State.NO_DATA: "no samples",
    },
}
_UNEXPLAINED = "something deviates there that no single fault explains well enough"
_NO_COMMAND = "there is no {valve} command to compare with"
_NO_MODEL = "the steering model does not hold here"
_MISSING = "{name}, the command of its {{valve}}, is not in the log, and what the replayed loop commands instead does not fit the angle"


def reasons_of(side: Side, axle: AxleFilter, *, judged: bool, missing: str = "") -> dict[State, str]:
    """Why a side has states that are no judgement: of what is not assessed, the reason that holds in this mission.

    Parameters
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`.
    axle : AxleFilter
        Its filters.
    judged : bool
        Whether this side can be judged by the plant.
    missing : str
        The command's channel where that is not in the log; else empty.
    """
    unseen = side is Side.SENSOR and bool(_unseen(axle).any())
    why = _UNEXPLAINED if judged else _MISSING.format(name=missing) if missing else _NO_MODEL
    return {**_REASONS[side], State.NOT_ASSESSED: f"{_NO_COMMAND}, or {why}" if unseen else why}


def vouched(
    healthy: NDArray[np.bool_], shown: NDArray[np.bool_], dt: float, *, seen: bool, shortest: float = np.inf
) -> NDArray[np.bool_]:
    """Healthy blocks for which a movement nearby speaks.

    Between two movements that were obeyed a fault would have had to come and go, which is not believed within some
    seconds; before the first and after the last one health is believed for fewer. Both for longer where the valve's
    opening is `seen`, but for no longer than the `shortest` fault [s] that did come and go in this mission. Shape (m,).
    """
    out = shown & healthy
    idle = healthy & ~shown
    alone = round(min(_SEEN_ALONE_S if seen else _ALONE_S, shortest) / dt)
    between = min(_SEEN_BETWEEN_S if seen else _BETWEEN_S, shortest)
    for a, b in runs_of(idle):
        left, right = a > 0 and out[a - 1], b < idle.size and healthy[b] and shown[b]
        if left and right and (b - a) * dt <= between:
            out[a:b] = True
            continue
        if left:
            out[a : min(b, a + alone)] = True
        if right:
            out[max(a, b - alone) : b] = True
    return out


def states_of(
    side: Side,
    inputs: AxleInputs,
    axle: AxleFilter,
    path: SteeringPath,
    found: SideFindings,
    masked: Sequence[Span],
    *,
    judged: bool,
) -> NDArray[np.int8]:
    """States of one side, shape (n,).

    Parameters
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`.
    inputs : AxleInputs
        The axle's channels.
    axle : AxleFilter
        Its filters.
    path : SteeringPath
        Most probable models.
    found : SideFindings
        Faults of this side.
    masked : Sequence[tuple[int, int]]
        Samples in which the sensor gives nothing usable.
    judged : bool
        Whether this side can be judged by the plant.
    """
    y = inputs.angle
    states = _of_blocks(side, axle, path, found, judged)
    states = np.repeat(states, axle.blocks.length)[: y.size].astype(np.int8)
    if side is Side.ACTUATOR:
        for a, b in masked:
            states[a:b] = CODE[State.MASKED]
        states[~np.isfinite(inputs.command) & (states == CODE[State.HEALTHY])] = CODE[State.NO_DATA]
    states[~np.isfinite(y) & (states == CODE[State.HEALTHY])] = CODE[State.NO_DATA]
    for f in found.findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    return states


def _of_blocks(side: Side, axle: AxleFilter, path: SteeringPath, found: SideFindings, judged: bool) -> NDArray[np.int8]:
    """States of blocks without faults, shape (m,)."""
    blocks = axle.blocks
    fine = (path.sensor if side is Side.SENSOR else path.actuator) == HEALTHY
    for a, b in found.refuted:
        fine[a:b] = True
    shown = exercised(axle)
    if side is Side.SENSOR and axle.model.noise.resolved:
        shown[:] = True
    shortest = min(((f.stop - f.start) / blocks.length * blocks.dt for f in found.findings), default=np.inf)
    healthy = vouched(fine, shown, blocks.dt, seen=axle.model.opening_measured, shortest=shortest)
    states = np.where(healthy, CODE[State.HEALTHY], CODE[State.NOT_EXCITED]).astype(np.int8)
    states[~fine & shown] = CODE[
        State.NOT_ASSESSED
    ]  # it was steered, or trembles: what deviates there is not explained
    if not judged:
        states[:] = CODE[State.NOT_ASSESSED]
    if side is Side.SENSOR:
        states[_unseen(axle) & (states == CODE[State.HEALTHY])] = CODE[State.NOT_ASSESSED]
    for a, b in found.unexplained:
        states[a:b] = CODE[State.NOT_ASSESSED]
    return states


def _unseen(axle: AxleFilter) -> NDArray[np.bool_]:
    """Blocks in which nothing tells what the angle should be, shape (m,)."""
    blocks = axle.blocks
    return np.asarray(blocks.blind & (blocks.status == PAIR) & ~blocks.redundancy.known, dtype=np.bool_)
