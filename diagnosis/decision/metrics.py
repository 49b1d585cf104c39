"""Figures of a mission: tracking error and control effort beside the paper's table, coverage, phases."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import STATES, Assessment, Finding
from diagnosis.results.document import CoverageRow, PhaseRow
from diagnosis.results.loop_rows import LoopRow, MeanRow, MetricsRow, PaperRow
from diagnosis.results.vocabulary import Tier
from replay.arrays.blocks import blocks
from replay.arrays.numeric import without_nan
from replay.control.kinematics import rotation
from replay.control.loop import Replay, any_finite, stack
from replay.faults import DECIDED, Side, State
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

PAPER_TABLE = (
    ("MFHCA", 0.019, 0.125, 4),
    ("Yang", 0.032, 0.130, 16),
    ("Wang", 0.021, 0.145, 7),
    ("Yu", 0.024, 0.125, 6),
    ("Sun", 0.035, 0.135, 12),
)
_DECIDED = np.array([s in DECIDED for s in STATES])
_AS_WELL = 0.5  # probability of a healthy part, from which on a finding decides nothing
_RESTS = STATES.index(State.NOT_EXCITED)


def driving(replay: Replay, timeline: Timeline, machine: Machine) -> NDArray[np.bool_]:
    """|v_c,i| above the driving speed, shape (n, wheels); the measured speed stands in where and while nothing is commanded.

    A wheel whose command is lost goes on driving: what is not judged then is missing from its driving.
    """
    limit = machine.limits.driving_speed
    v = stack(timeline, [f"wheel.{w}.v" for w in machine.wheels])
    with np.errstate(invalid="ignore"):
        return timeline.map(lambda ref, y: np.abs(np.where(np.isnan(ref), y, ref)) > limit, replay.v_ref, v)


def loop_metrics(timeline: Timeline, replay: Replay, machine: Machine, moving: NDArray[np.bool_]) -> MetricsRow:
    """Mean |e_i| [m/s] and mean |u_a,i| [fraction] per wheel and on average, for the mission and for driving.

    e is taken with v_true where that is logged, and not with a speed into which faults were injected.

    `moving` of shape (n, wheels).
    """
    nothing = np.broadcast_to(np.nan, (timeline.size,))
    per_wheel: dict[str, LoopRow] = {}
    for i, wheel in enumerate(machine.wheels):
        v, true, u = (timeline.signals.get(f"wheel.{wheel}.{x}", nothing) for x in ("v", "v_true", "u"))
        if any(np.isfinite(true[part]).any() for part in timeline.blocks()):
            v = true
        elif timeline.open_loop:
            v = nothing
        per_wheel[wheel] = {
            "tracking_error": _mean_size(moving[:, i], v, replay.v_ref[:, i]),
            "control_effort": _mean_size(moving[:, i], u),
        }
    loops = [per_wheel[w] for w in machine.wheels]
    average: LoopRow = {
        "tracking_error": _mean([loop["tracking_error"] for loop in loops]),
        "control_effort": _mean([loop["control_effort"] for loop in loops]),
    }
    paper: list[PaperRow] = [
        {"controller": c, "tracking_error": e_, "control_effort": u_, "parameters": n} for c, e_, u_, n in PAPER_TABLE
    ]
    return {"wheels": per_wheel, "average": average, "paper": paper}


def _mean(rows: Sequence[MeanRow]) -> MeanRow:
    """Mean over the wheels for which it is known."""
    return {
        "mission": _mean_of_known(r["mission"] for r in rows),
        "driving": _mean_of_known(r["driving"] for r in rows),
    }


def _mean_of_known(values: Iterable[float | None]) -> float | None:
    known = [x for x in values if x is not None]
    return float(np.mean(known)) if known else None


def _mean_size(moving: NDArray[np.bool_], x: Array, less: Array | None = None) -> MeanRow:
    """Mean |x − less| of the mission and of driving."""
    total, count = np.zeros(2), np.zeros(2)
    for part in blocks(x.size):
        size = np.abs(x[part] if less is None else x[part] - less[part])
        for j, known in enumerate((np.isfinite(size), np.isfinite(size) & moving[part])):
            total[j] += size[known].sum()
            count[j] += np.count_nonzero(known)
    mission, driving_ = (float(t / c) if c else None for t, c in zip(total, count, strict=True))
    return {"mission": mission, "driving": driving_}


def coverage(
    assessments: Mapping[tuple[str, str], Assessment], moving: NDArray[np.bool_], machine: Machine, dt: float
) -> tuple[list[CoverageRow], dict[tuple[str, str], float]]:
    """Seconds of each state per component and side, and seconds of driving that were decided.

    A finding that leaves it as probable that the part is healthy decides nothing. A drive whose command and opening are measured drives while either is beyond rest.

    `moving` of shape (n, wheels), `dt` in s.
    """
    rows: list[CoverageRow] = []
    decided: dict[tuple[str, str], float] = {}
    anything = moving.any(axis=1)
    for (component, side), assessment in assessments.items():
        counts = np.bincount(assessment.states, minlength=len(STATES))
        drives = moving[:, machine.wheels.index(component)] if component in machine.wheels else anything
        if side == Side.ACTUATOR and assessment.tier is Tier.DIRECT:  # a motor that coasts is not asked for anything
            drives = drives & (assessment.states != _RESTS)
        decides = _DECIDED[assessment.states] & drives
        for f in _undecided(assessment):
            decides[f.start : f.stop] = False
        seconds = float(np.count_nonzero(decides)) * dt
        decided[component, side] = seconds
        rows.append(
            {
                "component": component,
                "side": "sensor" if side == Side.SENSOR else "actuator",
                "tier": assessment.tier,
                "seconds": {s.value: float(c) * dt for s, c in zip(STATES, counts, strict=True) if c},
                "driving_s": float(np.count_nonzero(drives)) * dt,
                "decided_driving_s": seconds,
            }
        )
    return rows, decided


def open_states(
    assessments: Mapping[tuple[str, str], Assessment], moving: NDArray[np.bool_], machine: Machine
) -> dict[tuple[str, str], State]:
    """The commonest state that is no judgement while a part is driven, by component and side; none where all is decided.

    It is that of a fault where findings that leave the part as probably healthy take more of the driving than any other.
    `moving` of shape (n, wheels).
    """
    out: dict[tuple[str, str], State] = {}
    anything = moving.any(axis=1)
    for (component, side), assessment in assessments.items():
        drives = moving[:, machine.wheels.index(component)] if component in machine.wheels else anything
        counts = np.bincount(assessment.states[drives], minlength=len(STATES))
        counts[[s in DECIDED or s not in assessment.reasons for s in STATES]] = 0
        for f in _undecided(assessment):
            counts[STATES.index(State(f.mode.value))] += np.count_nonzero(np.asarray(drives)[f.start : f.stop])
        if counts.any():
            out[component, side] = STATES[int(np.argmax(counts))]
    return out


def _undecided(assessment: Assessment) -> list[Finding]:
    """Findings that leave it as probable that the part is healthy."""
    return [f for f in assessment.findings if sum(h.p for h in f.hypotheses if h.mode == State.HEALTHY) >= _AS_WELL]


def body_motion(timeline: Timeline, replay: Replay, machine: Machine) -> tuple[Array, Array]:
    """Commanded or mean measured speed of the body [m/s], and its yaw rate [rad/s]: commanded, else by its angles, else measured. Both of shape (n,).

    The yaw rate is 0 where nothing tells it.
    """
    v = timeline.get("cmd.v")
    if v is None or not np.isfinite(v).any():
        v = timeline.map(_mean_speed, replay.v_ref, stack(timeline, [f"wheel.{w}.v" for w in machine.wheels]))
    omega = timeline.get("cmd.omega")
    if omega is not None:
        return v, omega
    if machine.geometry is not None and machine.axles:
        geometry, phi = machine.geometry, stack(timeline, [f"steer.{axle}.phi" for axle in machine.axles])

        def by_angles(speed: Array, asked: Array, read: Array) -> Array:
            return speed * rotation(np.where(np.isfinite(asked), asked, read), geometry)[0]

        if any_finite(phi).all():
            return v, timeline.map(by_angles, v, replay.phi_ref, phi)
    measured = timeline.get("imu.yaw_rate")
    return v, np.broadcast_to(0.0, v.shape) if measured is None else measured


def _mean_speed(v_ref: Array, v: Array) -> Array:
    speeds = np.where(np.isfinite(v_ref), v_ref, v)
    count = np.isfinite(speeds).sum(axis=1)
    return np.where(count > 0, np.nansum(speeds, axis=1) / np.maximum(count, 1), np.nan)


def _fastest(v_ref: Array) -> Array:
    """Largest commanded speed of any joint; NaN where none is commanded."""
    size = np.abs(v_ref)
    return np.where(np.isfinite(size).any(axis=1), np.nanmax(np.where(np.isfinite(size), size, 0.0), axis=1), np.nan)


def phases(timeline: Timeline, replay: Replay, machine: Machine) -> list[PhaseRow]:
    """Forward, reverse, standstill and turning by the command, or unknown, of joints moving and standstill; pieces below 0.5 s join the one before."""
    if machine.part == "joint":
        v, omega = timeline.map(_fastest, replay.v_ref), np.broadcast_to(0.0, (timeline.size,))
    else:
        v, omega = body_motion(timeline, replay, machine)
    limit = machine.limits.driving_speed / 2
    half = 1.0 if machine.geometry is None else max(abs(w.x) for w in machine.geometry.wheels.values())

    def coded(speed: Array, rate: Array) -> NDArray[np.int8]:
        unknown, speed = np.isnan(speed), without_nan(speed)
        turning = np.abs(without_nan(rate)) * half > 0.15 * np.abs(speed) + 1e-9
        code = np.where(speed > limit, 1, np.where(speed < -limit, 2, 0))
        return np.where(unknown, 4, np.where((code > 0) & turning, 3, code)).astype(np.int8)

    code = timeline.map(coded, v, omega)
    names = ("standstill", "moving" if machine.part == "joint" else "forward", "reverse", "turning", "unknown")
    cut = np.flatnonzero(np.r_[True, code[1:] != code[:-1]])
    out: list[PhaseRow] = []
    for a, b in zip(cut, np.r_[cut[1:], code.size], strict=True):
        name = names[int(code[a])]
        if out and ((b - a) * timeline.dt < 0.5 or out[-1]["name"] == name):
            out[-1]["stop_s"] = float(b) * timeline.dt
        else:
            out.append({"name": name, "start_s": float(a) * timeline.dt, "stop_s": float(b) * timeline.dt})
    return out
