"""Spells in which no wheel moves although the drives are open: the machine's supply is gone, an engine that died, and no part has failed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import lowest_passed
from diagnosis.results.machine_event import MachineEvent, not_following
from diagnosis.results.said import Said, Stated
from replay.arrays.runs import runs_of

Flags = NDArray[np.bool_]

_LAG_S = 0.15  # of a valve and its drive: a command that has only just come has moved nothing yet
_RESTS, _TURNS = 0.03, 0.015  # of the top speed; rad/s
_CREEPS, _CREEPS_S = (
    0.008,
    0.3,
)  # of the top speed, evened over so long: of second speeds, where the first ones are deaf to slow motion
_HELD = 0.1  # of the top speed: one of four sensors that wait for their next edge may still read so much
_OPEN = 0.1  # of full opening: from here on a healthy drive moves; beyond the mission's own dead bands as well ...
_MOVES = 0.95  # ... of the openings at which a wheel moves, so many lie above them
_WHEELS, _LEAST_S = 3, 1.0  # fewer wheels, or less time, show nothing, ...
# ... but that much, and half of the drives, where an axle stands as well, which is told to turn by so much; openings as a share of that
_LEAST_WITH_AXLE_S, _STEERED, _LESS = 0.5, 0.3, 0.5
_BRIEF_S = 0.2  # for which open drives stood before an axle does: too brief by itself
_AXLES = 2  # that stand together where the drives are told to rest: one alone has a fault
_EDGES = 2  # cells, for a rate
_SECONDS, _HALF, _NEARLY_ALL = 2, 0.5, 0.8
_ELSEWHERE = 5.0  # times as long do wheels move at such openings


def nothing_moves(cells: Cells) -> Flags:
    """Cells in which all wheels rest while most drives are open, for a second and more, and those behind them until anything moves.

    Shape (cells,); none where that is usual.
    """
    return cells.once("nothing moves", lambda: _nothing_moves(cells))


def _nothing_moves(cells: Cells) -> Flags:
    speed, command, opening, second = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied", "v_true"))
    used = np.where(np.isfinite(command), command, opening)
    none = np.zeros(cells.size, np.bool_)
    known = np.isfinite(speed).any(axis=0) & np.isfinite(used).any(axis=0)
    if np.count_nonzero(known) < _WHEELS:
        return none
    rest = _RESTS * cells.machine.max_speed
    moves = (np.abs(np.nan_to_num(speed)) > rest) | (np.abs(np.nan_to_num(second)) > rest)
    passed = np.abs(np.nan_to_num(lowest_passed(used, cells.dt, _LAG_S)))
    least = np.array([_needs(u[m]) for u, m in zip(passed.T, moves.T, strict=True)])
    count = np.count_nonzero(known)
    fast = np.abs(np.nan_to_num(speed)).max(axis=1) > _HELD * cells.machine.max_speed
    rests = ~fast & (np.count_nonzero(moves, axis=1) <= (1 if count > _WHEELS else 0))
    rests &= np.isfinite(speed[:, known]).all(axis=1)
    axles = _axles(cells)
    turns, stands = axles.turns, axles.stands

    def open_(least: Array) -> NDArray[np.intp]:
        return np.asarray(np.count_nonzero((passed >= least)[:, known], axis=1))

    enough = open_(np.maximum(_OPEN, least)) > 0.5 * count
    still = _lasting(enough & rests, _cells_in(_LEAST_S, cells))
    half = open_(np.maximum(_OPEN, _LESS * least)) >= 0.5 * count
    still |= _lasting(half & rests & stands, _cells_in(_LEAST_WITH_AXLE_S, cells))
    stopped = _until(_lasting(enough & rests, _cells_in(_BRIEF_S, cells)), ~rests)
    still |= _lasting(stopped & rests & stands, _cells_in(_LEAST_WITH_AXLE_S, cells))
    told_to_stand = np.asarray((np.abs(cells.reference[:, known]) <= rest).all(axis=1))  # and held on a slope
    still &= ~_mostly(still, told_to_stand, _NEARLY_ALL) & ~_mostly(still, _creeps(cells, second), _HALF)
    still |= _axles_alone(axles, rests, cells)
    drives = np.count_nonzero(enough & moves[:, known].all(axis=1))
    return _until(still, ~rests | turns) if drives > _ELSEWHERE * np.count_nonzero(still) else none


def _creeps(cells: Cells, second: Array) -> Flags:
    """Cells in which second speeds (cells, wheels) show that most of their wheels roll on slowly, shape (cells,); none without two."""
    measured = np.isfinite(second).any(axis=0)
    if np.count_nonzero(measured) < _SECONDS:
        return np.zeros(cells.size, np.bool_)
    width = np.ones(_cells_in(_CREEPS_S, cells)) / _cells_in(_CREEPS_S, cells)
    evened = np.abs(np.column_stack([np.convolve(x, width, mode="same") for x in np.nan_to_num(second[:, measured]).T]))
    slow = np.count_nonzero(evened > _CREEPS * cells.machine.max_speed, axis=1)
    return np.asarray(slow > 0.5 * np.count_nonzero(measured))


def _cells_in(seconds: float, cells: Cells) -> int:
    return max(1, round(seconds / cells.dt))


class _Axles(NamedTuple):
    """Cells in which an axle turns, in which one stands that is told to turn and none that is told turns, and how many are told, each of shape (cells,)."""

    turns: Flags
    stands: Flags
    told: NDArray[np.intp]


def _axles(cells: Cells) -> _Axles:
    angle, command = cells.axles("phi"), np.abs(np.nan_to_num(lowest_passed(cells.axles("u"), cells.dt, _LAG_S)))
    if len(angle) < _EDGES or not angle.shape[1]:
        none = np.zeros(cells.size, np.bool_)
        return _Axles(none, none, np.zeros(cells.size, np.intp))
    sound = np.column_stack([~cells.told(axle) for axle in cells.machine.axles])
    angle = np.where(sound, angle, np.nan)  # an angle that shakes turns nothing
    turns = np.asarray(np.abs(np.nan_to_num(np.gradient(angle, cells.dt, axis=0))) > _TURNS)
    told = (command > _STEERED) & np.isfinite(angle)
    stands = np.asarray(told.any(axis=1) & ~(told & turns).any(axis=1))
    return _Axles(np.asarray(turns.any(axis=1)), stands, np.asarray(np.count_nonzero(told, axis=1)))


def _axles_alone(axles: _Axles, rests: Flags, cells: Cells) -> Flags:
    """Cells of a machine at rest in which several axles are told to turn and stand together; none unless they turn at rest for longer elsewhere."""
    told = rests & (axles.told >= _AXLES)
    still = _lasting(told & axles.stands, _cells_in(_LEAST_WITH_AXLE_S, cells))
    return still & (np.count_nonzero(told & ~axles.stands) > np.count_nonzero(still))


def _needs(opening: Array) -> float:
    """Opening that hardly any of those is below at which a wheel moves [1]."""
    return float(np.quantile(opening, 1.0 - _MOVES)) if opening.size else 1.0


def _lasting(flags: Flags, least: int) -> Flags:
    """Those that stand in stretches of at least so many cells."""
    out = np.zeros(flags.size, np.bool_)
    for a, b in runs_of(flags):
        out[a:b] = b - a >= least
    return out


def _mostly(flags: Flags, other: Flags, most: float) -> Flags:
    """Stretches for more than a share of which something else holds as well."""
    out = np.zeros(flags.size, np.bool_)
    for a, b in runs_of(flags):
        out[a:b] = np.mean(other[a:b]) > most
    return out


def _until(flags: Flags, ends: Flags) -> Flags:
    """Stretches that go on until something ends them."""
    out = flags.copy()
    for k in np.flatnonzero(np.diff(flags.astype(np.int8)) < 0) + 1:
        behind = np.flatnonzero(ends[k:])
        out[k : k + (int(behind[0]) if behind.size else ends.size - k)] = True
    return out


def supply_gone(cells: Cells) -> MachineEvent | None:
    """That the machine stood while its drives were open, as an event; None where it did not."""
    still = nothing_moves(cells)
    if not still.any():
        return None
    spans = tuple((a * cells.dt, b * cells.dt) for a, b in runs_of(still))
    spells = [str(Stated.of(*span)) for span in spans]
    when = ", ".join(spells[:3]) + (f" and {len(spells) - 3} more times" if len(spells) > 3 else "")
    text = (
        f"No {{wheel}} moved at {when} although most {{valve}}s were commanded to open, or every steered axle to turn: what supplies them all "
        "had stopped, as an engine that stalls does; no part is blamed for that time."
    )
    return Said(text, spans).event(not_following)
