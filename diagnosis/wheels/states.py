"""Condition of a wheel's sensor and valve at every sample: findings, and why there is no judgement elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.debounce import FLICKER_S, debounced
from diagnosis.channels.sample_status import SILENT
from diagnosis.results.assessment import CODE, Assessment, Lack, Reason
from diagnosis.wheels.findings import WheelFindings, WheelPath
from diagnosis.wheels.inputs import WheelsData
from replay.faults import Side, State

_REASONS = {
    State.NOT_EXCITED: "the {wheel} is neither commanded nor moving",
    State.MASKED: "the {wheel.sensor}, which is needed for it, delivers nothing usable",
    State.NO_DATA: "no samples",
    State.SLIP: "the {wheel}'s speed contradicts the other {wheels} while it follows its {valve}: it slips, or its sensor is faulty",
}
_NO_COMMAND = "no {valve} command to compare with"
_UNCERTAIN = "the {wheel} model is too uncertain in this mission"
_UNEXPLAINED = "the signals fit a healthy part and a faulty one alike"


@dataclass(frozen=True)
class WheelStates:
    """Codes of states by side, shape (n,), and where the wheel is quiet."""

    codes: dict[Side, NDArray[np.int8]]
    quiet: NDArray[np.bool_]


def states_of(data: WheelsData, i: int, path: WheelPath, found: WheelFindings) -> WheelStates:
    """States of sensor and actuator of wheel i."""
    gap, least = (round(s / data.dt) for s in (FLICKER_S, FLICKER_S / 2))
    quiet = debounced(np.ascontiguousarray(data.quiet[:, i]), gap, 1)
    no_opening, healthy = ~np.isfinite(data.u[:, i]), CODE[State.HEALTHY]
    sensor = np.where(quiet, CODE[State.NOT_EXCITED], healthy).astype(np.int8)
    sensor[~np.isfinite(path.y) & (data.status[:, i] != SILENT)] = CODE[State.NO_DATA]
    actuator = sensor.copy()
    actuator[no_opening] = CODE[State.NO_DATA]
    sensor[(found.opened[Side.SENSOR] | no_opening) & (sensor == healthy)] = CODE[State.NOT_ASSESSED]
    if path.model.grip_most > 0:  # wheels in the air obey their own valves, not the body
        slips = debounced(np.ascontiguousarray(data.slip[:, i]), gap, least)
        sensor[slips & (sensor == CODE[State.NOT_ASSESSED])] = CODE[State.SLIP]
    actuator[found.opened[Side.ACTUATOR] & (actuator == healthy)] = CODE[State.NOT_ASSESSED]
    for f in found.of(Side.ACTUATOR):
        actuator[f.start : f.stop] = CODE[State(f.mode.value)]
    for f in found.of(Side.SENSOR):
        sensor[f.start : f.stop] = CODE[State(f.mode.value)]
        if f.side is Side.SENSOR and f.mode.total:
            actuator[f.start : f.stop] = CODE[State.MASKED]
    return WheelStates({Side.SENSOR: sensor, Side.ACTUATOR: actuator}, quiet)


def with_reasons(one: Assessment, no_opening: NDArray[np.bool_], dt: float, *, gains: bool) -> Assessment:
    """The same with why states that are no judgement were given.

    Parameters
    ----------
    one : Assessment
        One side, its states of shape (n,).
    no_opening : NDArray[np.bool_], shape (n,)
        Where nobody knows the valve's opening.
    dt : float
        Step [s].
    gains : bool
        Whether the wheel model is good enough to judge gains and the valve by.
    """
    absent = Reason(_NO_COMMAND + _times_of(no_opening, dt), Lack.COMMAND)
    commanded = Reason(_UNEXPLAINED if gains else _UNCERTAIN)
    reason = absent if _mostly(one, State.NOT_ASSESSED, no_opening) else commanded
    out = replace(one, reasons=_REASONS).reasoned(State.NOT_ASSESSED, reason)
    return out.reasoned(State.NO_DATA, absent) if _mostly(one, State.NO_DATA, no_opening) else out


def _mostly(one: Assessment, state: State, where: NDArray[np.bool_]) -> bool:
    """Whether a state is given mostly where something holds, shape (n,)."""
    there = one.states == CODE[state]
    return bool(2 * np.count_nonzero(there & where) > np.count_nonzero(there))


def _times_of(there: NDArray[np.bool_], dt: float) -> str:
    """When something holds, to follow words; empty where it always does: ``, from 52.5 s on``."""
    at = np.flatnonzero(there)
    if not at.size or at.size == there.size:
        return ""
    start, stop = int(at[0]), int(at[-1]) + 1
    if stop - start > at.size:
        return f", for {at.size * dt:.1f} s"
    return f", from {start * dt:.1f} s on" if stop == there.size else f", from {start * dt:.1f} to {stop * dt:.1f} s"


def unexplained_s(states: WheelStates, side: Side, found: WheelFindings, dt: float) -> float:
    """Time [s] in which a side deviates by more than the model's own errors do, outside of findings."""
    covered = np.zeros(states.quiet.size, dtype=np.bool_)
    for f in found.findings:
        covered[f.start : f.stop] = True
    return float(np.count_nonzero(found.unexplained[side] & ~covered & ~states.quiet)) * dt
