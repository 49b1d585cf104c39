"""Figures of one law in one mission: tracking error, effort, wear, saturation, and recovery from each fault."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.counterfactual.abduct import Abducted, KnownFault
from diagnosis.counterfactual.document import FigureRow, LawFigures, RecoveryRow
from replay.machine.config import Machine

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_SMOOTH_S = 0.1  # over which |e| is averaged before recovery is read off it
_STAYS_S = 0.5  # for which it must stay below the limit
_LEAST_LIMIT = 0.02  # lowest limit [m/s]
_OPEN = 1 - 1e-6  # of the largest opening, from which a command is saturated


def law_figures(abducted: Abducted, machine: Machine, u: Array, shift: Array) -> LawFigures:
    """Figures of a law.

    Parameters
    ----------
    abducted : Abducted
        The recorded mission.
    machine : Machine
        Its limits.
    u : Array, shape (n, wheels)
        Valve commands of the law [fraction].
    shift : Array, shape (n, wheels)
        By how much the wheels turn faster than recorded [m/s].
    """
    world, known = abducted.world, abducted.known
    e = np.abs(world.speed + shift - world.v_ref)
    moving = np.abs(world.v_ref) > machine.limits.driving_speed
    every = np.ones(known.shape, np.bool_)
    size = np.abs(u)
    steps = np.abs(np.diff(u, axis=0))
    return {
        "tracking_error": _figures(e, known, moving, abducted.faulty),
        "control_effort": _figures(size, every, moving, abducted.faulty),
        "total_variation": float(steps.sum(axis=0).mean() / (len(u) * world.dt)),
        "saturated": float(np.mean(size >= machine.control.u_max * _OPEN)),
    }


def _figures(x: Array, use: Flags, moving: Flags, faulty: Flags) -> FigureRow:
    return {
        "mission": _mean(x, use),
        "driving": _mean(x, use & moving),
        "healthy": _mean(x, use & ~faulty),
        "faulty": _mean(x, use & faulty),
    }


def _mean(x: Array, use: Flags) -> float | None:
    return float(x[use].mean()) if use.any() else None


def recoveries(abducted: Abducted, machine: Machine, shift: Array) -> list[RecoveryRow]:
    """How long each wheel's error takes to come back after each of its faults has ended.

    Back is |e|, averaged over 0.1 s, below twice the recorded mission's mean outside of faults, and 0.02 m/s at least, for half a
    second.

    `shift` of shape (n, wheels) in m/s; times in s.
    """
    world = abducted.world
    error = np.abs(world.speed + shift - world.v_ref)
    usual = _mean(np.abs(world.speed - world.v_ref), abducted.known & ~abducted.faulty) or 0.0
    limit = max(2.0 * usual, _LEAST_LIMIT)
    return [_recovery(f, machine.driven[f.wheel], error[:, f.wheel], limit, world.dt) for f in abducted.faults]


def _recovery(fault: KnownFault, wheel: str, error: Array, limit: float, dt: float) -> RecoveryRow:
    width, stays = max(1, round(_SMOOTH_S / dt)), max(1, round(_STAYS_S / dt))
    begin = max(0, min(fault.finding.stop, error.size) - width)
    found: float | None = None
    after = error[begin:]
    if after.size > width + stays and np.isfinite(after[: width + stays]).all():
        total = np.cumsum(np.concatenate(([0.0], np.nan_to_num(after, nan=np.inf))))
        with np.errstate(invalid="ignore"):
            mean = (total[width:] - total[:-width]) / width
        above = np.flatnonzero(~(mean <= limit))
        # first moment from which on the mean stays below the limit for `stays` samples
        starts = np.concatenate(([0], above + 1))
        ends = np.append(above, mean.size)
        long = np.flatnonzero(ends - starts >= stays)
        found = float(starts[long[0]]) * dt if long.size else None
    return {
        "component": wheel,
        "side": fault.side,
        "mode": fault.finding.mode,
        "start_s": fault.finding.start * dt,
        "stop_s": fault.finding.stop * dt,
        "recovery_s": found,
    }
