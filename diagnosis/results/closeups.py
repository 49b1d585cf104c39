"""Every sample around the worst faults of a mission of hours, whose columns are envelopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Assessment
from diagnosis.results.evidence_columns import Steps, steps_around
from diagnosis.results.result import Closeups, FaultInterval
from replay.arrays.blocks import blocks
from replay.arrays.envelope import bucket_of
from replay.control import mfhca
from replay.control.loop import Replay
from replay.control.loop_kernel import scan_wheel
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]


def closeups_of(
    timeline: Timeline,
    replay: Replay,
    machine: Machine,
    assessments: Mapping[tuple[str, str], Assessment],
    intervals: Sequence[FaultInterval],
) -> Closeups | None:
    """Every sample around the worst faults of a mission whose columns are envelopes.

    Parameters
    ----------
    timeline, replay, machine
        The aligned mission of n steps, the replayed loop and the machine.
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side, with their evidence around their own faults.
    intervals : Sequence[FaultInterval]
        Faults, worst first.
    """
    if bucket_of(timeline.size) == 1:
        return None
    spans = [(round(f.start_s / timeline.dt), round(f.stop_s / timeline.dt)) for f in intervals]
    step = steps_around(spans, timeline.size, timeline.dt)
    if not step.size:
        return None
    columns = {name: _single(values[step]) for name, values in timeline.signals.items()}
    columns |= _replayed(timeline, replay, machine, step)
    for (component, side), assessment in assessments.items():
        near = assessment.closeups
        if near is None:
            continue
        _, here, there = np.intersect1d(step, near.step, assume_unique=True, return_indices=True)
        for leaf, values in near.columns.items():
            column = np.full(step.size, np.nan, np.float32)
            column[here] = values[there]
            columns[f"evidence.{component}.{side}.{leaf}"] = column
    return Closeups(step, {name: x for name, x in columns.items() if np.isfinite(x).any()})


def _single(values: NDArray[np.floating]) -> NDArray[np.float32]:
    return values.astype(np.float32)


def _replayed(timeline: Timeline, replay: Replay, machine: Machine, step: Steps) -> dict[str, NDArray[np.float32]]:
    """Columns of the replayed loop as `replay.control.loop_columns.replay_columns` names them, at some steps."""
    out: dict[str, NDArray[np.float32]] = {}
    nothing, control = np.broadcast_to(np.nan, (timeline.size,)), machine.control
    for i, wheel in enumerate(machine.wheels):
        v = timeline.signals.get(f"wheel.{wheel}.v", nothing)
        u = nothing if timeline.open_loop else timeline.signals.get(f"wheel.{wheel}.u", nothing)
        speed, command = v[step], replay.v_ref[step, i]
        found = {
            "v_ref": command,
            "e": speed - command,
            "rho": mfhca.decay_rate(speed, command, control.xi, control.beta),
            **_scanned(replay, i, u, v, timeline.dt, step),
        }
        out |= {f"replay.{wheel}.{leaf}": _single(x) for leaf, x in found.items()}
    for j, axle in enumerate(machine.axles):
        out[f"replay.{axle}.phi_ref"] = _single(replay.phi_ref[step, j])
        if control.law == "none":  # as in the columns
            continue
        out[f"replay.{axle}.u"] = _single(replay.steer_u[step, j])
        recorded = timeline.get(f"steer.{axle}.u")
        if recorded is not None and not timeline.open_loop:
            out[f"replay.{axle}.u_difference"] = _single(recorded[step] - replay.steer_u[step, j])
    return out


def _scanned(replay: Replay, i: int, u: Array, v: Array, dt: float, step: Steps) -> dict[str, Array]:
    """What depends on the loop's state: replayed once more, because only envelopes of it were kept."""
    v_ref = replay.v_ref[:, i]
    if replay.law is None or not (_any(v) and _any(v_ref)):
        return {}
    parts: dict[str, list[Array]] = {leaf: [] for leaf in ("psi_printed", "psi_implied", "u")}
    cuts = tuple(blocks(len(v)))
    for part, block in zip(cuts, scan_wheel(replay.law, u, v, v_ref, dt, replay.psi0[i], cuts), strict=True):
        at = step[np.searchsorted(step, part.start) : np.searchsorted(step, part.stop)] - part.start
        parts["psi_printed"].append(block.psi_printed[at])
        parts["psi_implied"].append(np.sqrt(np.maximum(block.implied_squared[at], 0.0)))
        parts["u"].append(block.u[at])
    out = {leaf: np.concatenate(x) for leaf, x in parts.items()}
    return out | {"u_difference": u[step] - out["u"]}


def _any(values: Array) -> bool:
    return any(bool(np.isfinite(values[part]).any()) for part in blocks(len(values)))
