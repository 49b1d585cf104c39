"""Axles that stand still while they are commanded: from which opening on one must move, by the dead bands of the mission's own valves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells, Frame
from diagnosis.clearing.measure import lowest_passed
from diagnosis.clearing.nothing_moves import nothing_moves

Flags = NDArray[np.bool_]

STILL_S, _STILL, _ANSWERED = 1.0, 0.015, 0.06  # s, rad/s, and of full opening
_LAG_S = 0.15  # of a valve and its cylinder: a command that has only just come has moved nothing yet
#: An axle that creeps: rad/s, of the rate that its opening gives, and of its own rate's size, which noise alone would have.
_CREEPS, _OBEYS, _STEADY = 0.003, 0.25, 0.5
OVERLAP, ALIKE = 0.18, 1.4  # of full opening: healthy valves open by then; times what another axle needs
_HYSTERESIS = 0.03  # of full opening: by as much a valve opens later than it closes
_END, _REACHED = 0.97, 0.5  # of the largest angle: an end stop, where that is as much of the machine's
_STEERED = 0.01  # of full opening beyond the dead band: below it, an axle is not steered
#: Windows of rest, share of windows in which an axle turns, by how much its rests differ in command (of it) and angle (of the largest).
_RESTS, _TURNS, _SPREAD, _APART, _MOSTLY = 6, 0.1, 0.35, 0.1, 0.75
_STALLS_S = 1.5  # that wheels take to stop when their supply does
# Dead band of a valve that lives, at most; below, and above such a share of it an axle turns seldom, of its rests, and often
_LATEST, _SOONER, _LATER, _SELDOM = 0.28, 0.8, 1.2, 0.15
_IDLE = 0.3  # of the command at which an axle rests: as good as none
_STEPS = 19  # dead bands that are tried


def rate_of(angle: Array, dt: float) -> Array:
    """Steering rates of angles (cells, axles) [rad/s]."""
    return np.gradient(angle, dt, axis=0) if len(angle) > 1 else np.full(angle.shape, np.nan)


def dead_bands(rate: Array, opening: Array) -> Array:
    """Opening of each axle that moves nothing [1], shape (axles,): of all up to `OVERLAP` the one whose rates fit best.

    A healthy valve's is like those of the other axles: what one needs more of is a fault's. Rates in rad/s and openings
    of shape (cells, axles).
    """
    tried = np.linspace(0.0, OVERLAP, _STEPS)
    found = np.full(rate.shape[1], np.nan)
    for j, (r, u) in enumerate(zip(rate.T, opening.T, strict=True)):
        known = np.isfinite(r) & np.isfinite(u) & (u != 0.0)
        ahead, past = r[known] * np.sign(u[known]), np.maximum(np.abs(u[known]) - tried[:, np.newaxis], 0.0)
        power = (past**2).sum(axis=1)
        if not power.all():
            continue
        left = np.abs(ahead - (past @ ahead / power)[:, np.newaxis] * past).sum(axis=1)
        found[j] = tried[int(np.argmin(left))]
    return (
        np.nan_to_num(np.minimum(found, ALIKE * np.nanmin(found))) if np.isfinite(found).any() else np.zeros(found.size)
    )


def beyond(rate: Array, opening: Array, use: Flags, dead: Array) -> tuple[Flags, Array, Array]:
    """Where axles are steered beyond their dead bands, their rates ahead [rad/s] and the openings beyond [1] there, (cells, axles)."""
    past = np.maximum(np.abs(opening) - np.maximum(dead, 0.0), 0.0)
    steered = use & (np.nan_to_num(past) > _STEERED)
    return steered, np.where(steered, rate * np.sign(opening), 0.0), np.where(steered, past, 0.0)


def still_frame(cells: Cells) -> Frame:
    """Windows in which an axle that is commanded must move."""
    return Frame(cells.size, max(1, round(STILL_S / cells.dt)), max(1, round(0.3 / cells.dt)))


def commanded_still(cells: Cells, j: int) -> Array:
    """Mean command of each window of `still_frame` [1], 0 where the axle moves or is at its end stop, NaN where nothing is known.

    A valve that has closed nearly to its dead band lets an axle creep: that moves, where it goes the way and at least a quarter
    as fast as such an opening lets it. Shape (windows,).
    """
    angle, command, opening = (cells.axles(leaf)[:, j] for leaf in ("phi", "u", "u_applied"))
    command, frame = np.where(np.isfinite(command), command, opening), still_frame(cells)
    passed = np.where(np.isfinite(command), lowest_passed(command, cells.dt, _LAG_S), np.nan)
    mean, at = frame.mean(passed), frame.mean(angle)
    reached = float(np.max(np.nan_to_num(np.abs(angle)), initial=0.0))
    stopped = (np.abs(at) >= _END * reached) & (at * mean > 0.0) & (reached >= _REACHED * cells.machine.max_steer)
    rate = rate_of(angle[:, np.newaxis], cells.dt)[:, 0]
    size, ahead = frame.rms(rate), frame.mean(rate) * np.sign(mean)
    creeps = (ahead >= _CREEPS) & (ahead >= _STEADY * size) & (ahead >= _OBEYS * _given(cells, np.abs(mean)))
    rests = (size < _STILL) & ~stopped & ~creeps
    before, stalls = round(_STALLS_S / cells.dt), nothing_moves(cells)
    soon = np.lib.stride_tricks.sliding_window_view(np.pad(stalls, (0, before)), before + 1).any(axis=1)
    gone = frame.sums(np.asarray(soon, np.float64)) > 0.0  # no axle turns where no wheel does
    return np.asarray(np.where(np.isfinite(mean) & ~gone, np.where(rests, np.abs(mean), 0.0), np.nan))


def opens_late(cells: Cells, j: int) -> bool:
    """Whether an axle rests at small openings alone, always, and turns at larger ones, always: its valve overlaps by so much, and lives.

    A fault comes and goes, or shows at large openings too.
    """
    size, frame = commanded_still(cells, j), still_frame(cells)
    opening = cells.axles("u")[:, j]
    passed = np.abs(np.nan_to_num(lowest_passed(opening, cells.dt, _LAG_S)))
    most = np.array([np.max(passed[k : k + frame.length], initial=0.0) for k in frame.starts])
    turns = (size == 0.0) & (frame.rms(rate_of(cells.axles("phi"), cells.dt)[:, j]) > 2.0 * _STILL)
    rests = size[size > _ANSWERED]
    if not rests.size:
        return False
    band = float(rests.max())
    sooner = np.count_nonzero(turns & (most > _ANSWERED) & (most < _SOONER * band))
    later = np.count_nonzero(turns & (most > _LATER * band))
    return bool(band <= _LATEST and later >= _RESTS and sooner <= _SELDOM * rests.size)


def _given(cells: Cells, opening: Array) -> Array:
    """Rate that such openings [1] give by the rates of the axle that turns most per opening [rad/s], infinite where none is known."""
    openings, rate = cells.axles("u_applied"), rate_of(cells.axles("phi"), cells.dt)
    openings = np.where(np.isfinite(openings), openings, cells.axles("u"))
    dead = dead_bands(rate, openings)
    _, ahead, opened = beyond(rate, openings, np.isfinite(rate) & np.isfinite(openings), dead)
    power = opened.sum(axis=0)
    if not power.any():
        return np.full(opening.shape, np.inf)
    slope = np.divide(ahead.sum(axis=0), power, out=np.zeros(len(power)), where=power > 0.0)
    fastest = int(np.argmax(slope))
    return np.asarray(slope[fastest] * np.maximum(opening - dead[fastest], 0.0))


def rests_at(cells: Cells, j: int, span: tuple[int, int]) -> float | None:
    """The one command at which an axle rests wherever it is, as behind a valve that is off by as much [1]; None where it is none.

    Parameters
    ----------
    cells : Cells
        The mission.
    j : int
        Axle.
    span : tuple[int, int]
        Samples within which it stands still now and then.
    """
    size, frame = commanded_still(cells, j), still_frame(cells)
    angle, command = cells.axles("phi")[:, j], cells.axles("u")[:, j]
    inside = (frame.starts * cells.width >= span[0]) & (frame.starts * cells.width < span[1])
    rests = inside & (size > _ANSWERED)
    at, where = frame.mean(command)[rests], frame.mean(angle)[rests]
    turns = inside & (frame.rms(rate_of(angle[:, np.newaxis], cells.dt)[:, 0]) > 2.0 * _STILL)
    if at.size < _RESTS or not np.isfinite(at).all() or np.count_nonzero(turns) < _TURNS * np.count_nonzero(inside):
        return None
    middle = float(np.median(at))
    idle = frame.rms(command) < _IDLE * abs(middle)
    if np.count_nonzero(idle & turns) < 0.5 * np.count_nonzero(idle & inside):
        return None  # a valve that is off turns the axle where it is told to rest
    alike = np.abs(at - middle) < _SPREAD * abs(middle)
    if np.mean(alike) <= _MOSTLY:
        return None
    return middle if float(np.ptp(where[alike])) > _APART * cells.machine.max_steer else None


def longest_still(cells: Cells, j: int) -> tuple[float, float]:
    """Largest mean command while an axle stands still for a second [1], NaN where nothing is known, and when that begins [s]."""
    values = commanded_still(cells, j)
    if not np.isfinite(values).any():
        return np.nan, 0.0
    k = int(np.nanargmax(values))
    return float(values[k]), float(still_frame(cells).starts[k] * cells.dt)


def stands(cells: Cells) -> float:
    """Opening at which even the axle that needs least stands still for a second [1]; 0 where only one is known."""
    need = [largest for j in range(len(cells.machine.axles)) if np.isfinite(largest := longest_still(cells, j)[0])]
    return min(need) if len(need) > 1 else 0.0


def answered(cells: Cells) -> float:
    """Opening from which on an axle must move [1]: more where none does before, for valves overlap and open later than they close.

    What counts is the axle that needs least, by how long it stands still and by what the rates of all show of their overlap.
    """
    opening = cells.axles("u_applied")
    used = np.where(np.isfinite(opening), opening, cells.axles("u"))
    dead = dead_bands(rate_of(cells.axles("phi"), cells.dt), used)
    least = float(np.nanmin(np.where(np.isfinite(used).any(axis=0), dead, np.nan))) if np.isfinite(used).any() else 0.0
    return float(min(max(_ANSWERED, ALIKE * stands(cells), ALIKE * least + _HYSTERESIS), OVERLAP))
