"""The truth of a simulated mission, for scoring alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.faults import FaultSpec, Side
from replay.simulation.options import SIMULATED_AXLES, SimulationOptions
from replay.simulation.state import Recording
from replay.truth import MissionTruth, TruthInterval, TruthSpan

_SLIP_SPEED = 0.03  # rim over ground from which a tyre slips [m/s]


def actual_signals(options: SimulationOptions, recording: Recording) -> dict[str, NDArray[np.float64]]:
    """True signals by name, each of shape (n,); see `SimulatedMission`."""
    actual: dict[str, NDArray[np.float64]] = {}
    for i, wheel in enumerate(options.machine.wheels):
        actual[f"wheel.{wheel}.v"] = recording.v_actual[:, i]
        actual[f"wheel.{wheel}.v_ref"] = recording.v_ref[:, i]
        actual[f"wheel.{wheel}.u_applied"] = recording.u_actual[:, i]
        actual[f"wheel.{wheel}.psi"] = recording.psi[:, i]
        actual[f"wheel.{wheel}.slip"] = recording.slip[:, i]
    for i, axle in enumerate(SIMULATED_AXLES):
        actual[f"steer.{axle}.phi"] = recording.phi_actual[:, i]
        actual[f"steer.{axle}.u_applied"] = recording.steer_u_actual[:, i]
    actual.update({f"body.{name}": recording.body[:, i] for i, name in enumerate(("v", "x", "y", "yaw", "omega"))})
    return actual


def mission_truth(
    options: SimulationOptions,
    faults: tuple[FaultSpec, ...],
    realised: NDArray[np.float64],
    recording: Recording,
) -> MissionTruth:
    """Contents of the truth file; `realised` (one per fault) is the saturation term that the loop used.

    `realised` of shape (faults,), in the unit of each fault's channel.
    """
    duration = options.samples / options.rate_hz
    driving = options.machine.limits.driving_speed
    within = [(f, sat) for f, sat in zip(faults, realised.tolist(), strict=True) if f.start_s < duration]
    slip, motion = [], []
    for i, wheel in enumerate(options.machine.wheels):
        slip += spans_where(wheel, np.abs(recording.slip[:, i]) > _SLIP_SPEED, options.rate_hz)
        motion += spans_where(wheel, np.abs(recording.v_ref[:, i]) > driving, options.rate_hz)
    return MissionTruth(
        wheels=options.machine.wheels,
        rate_hz=options.rate_hz,
        start_ns=options.start_ns,
        duration_s=duration,
        driving_speed=driving,
        intervals=tuple(_interval(f, sat, duration) for f, sat in within),
        slip=tuple(slip),
        masked=tuple(
            TruthSpan(f.component, f.start_s, min(f.stop_s, duration))
            for f, _ in within
            if f.side is Side.SENSOR and f.mode.total
        ),
        driving=tuple(motion),
    )


def _interval(fault: FaultSpec, sat: float, duration: float) -> TruthInterval:
    return TruthInterval.of(fault, "steer" if fault.component in SIMULATED_AXLES else "wheel", sat, duration)


def spans_where(component: str, flag: NDArray[np.bool_], rate_hz: float) -> list[TruthSpan]:
    """Stretches in which a flag holds; gaps below 0.1 s are closed, stretches below 0.1 s left out.

    `flag` of shape (n,).
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flag, [False]]).astype(np.int8)))
    start, stop = edges[::2] / rate_hz, edges[1::2] / rate_hz
    apart = start[1:] - stop[:-1] >= 0.1
    start, stop = start[np.append(True, apart)[: start.size]], stop[np.append(apart, True)[: stop.size]]
    return [TruthSpan(component, float(a), float(b)) for a, b in zip(start, stop, strict=True) if b - a >= 0.1]
