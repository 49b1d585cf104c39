"""What checks measure: how far a channel is off its reference, how late it is, and where a value is worst."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells, Frame
from diagnosis.estimation.lag import low_passed
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.arrays.quantiles import median_of, quantile_known
from replay.faults import Side

_EVEN_S = 0.2  # over which a channel and its reference are evened: two healthy instruments differ in lag
_LAGS_S = (0.0, 0.03, 0.06, 0.1, 0.15, 0.2)  # of healthy valves, motors and their loops
_FOLLOWED = 0.8  # quantile of the windows: lag shows where a command is quick
_AS_ALIKE = 0.97  # of the largest correlation
_FOLLOWS = 0.65  # least correlation of a speed's changes with its command's: what hardly follows them tells no delay
_EARLIEST_S, _LATEST_S = 0.3, 1.0
_SURE = 0.95
_LOSSES = (
    Check.RESPONSE,
    Check.LASTING_RESPONSE,
    Check.CHANGE,
    Check.RATE,
    Check.LASTING_RATE,
    Check.PLANT_RATE,
    Check.PLANT_RESPONSE,
)


def lowest_passed(x: Array, dt: float, lag_s: float) -> Array:
    """Columns behind a lag of first order, shape as x; gaps are bridged. In the unit of x; `dt` and `lag_s` in s."""
    columns = x[:, np.newaxis] if x.ndim == 1 else x
    if not columns.shape[1]:
        return x
    passed = [low_passed(np.append(column, 0.0), lag_s, dt)[1:] for column in columns.T]
    return np.column_stack(passed).reshape(x.shape)


class Compared(NamedTuple):
    """A channel and its reference.

    Attributes
    ----------
    frame : Frame
        Windows.
    a, b : Array, shape (cells,)
        Both, evened; NaN where one is.
    size : Array, shape (windows,)
        What a deviation is a share of.
    mean : Array, shape (windows,)
        Mean of a − b.
    driven, moves : NDArray[np.bool_], shape (windows,)
        Whether the reference is beyond its floor, and whether it or the channel is.
    floor : float
        What `size` is at least.
    """

    frame: Frame
    a: Array
    b: Array
    size: Array
    mean: Array
    driven: NDArray[np.bool_]
    moves: NDArray[np.bool_]
    floor: float

    @property
    def off(self) -> Array:
        """How far a is off b in each window, as a share of b: by its gain, its mean, and what is left beside both. Shape (windows,)."""
        frame, a, b = self.frame, self.a, self.b
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            gain = np.abs(1.0 - frame.sums(a * b) / frame.sums(b * b))
        scatter = np.sqrt(np.maximum(frame.mean((a - b) ** 2) - self.mean**2, 0.0)) / self.size
        # what hysteresis and lag leave is no loss: it counts from half of the reference on
        off = np.fmax(np.fmax(np.abs(self.mean) / self.size, np.where(self.driven, gain, 0.0)), 0.5 * scatter)
        return np.asarray(np.where(self.moves, off, np.nan))


def compared(cells: Cells, y: Array, x: Array, floor: float) -> Compared:
    """A channel y and its reference x.

    All in the channel's unit: m/s, rad or fractions of opening.

    Parameters
    ----------
    cells : Cells
        The mission.
    y, x : Array, shape (cells,)
        Channel and reference.
    floor : float
        Windows in which x stays below this are left out unless y does not.
    """
    frame = cells.frame
    known = np.isfinite(y) & np.isfinite(x)
    a, b = (np.where(known, lowest_passed(z, cells.dt, _EVEN_S), np.nan) for z in (y, x))
    large, driven = frame.rms(b), frame.rms(b) > floor
    moves = driven | (frame.rms(a) > 2.0 * floor)
    return Compared(frame, a, b, np.maximum(large, floor), frame.mean(a - b), driven, moves, floor)


def as_followed(cells: Cells, openings: Array, commands: Array, floor: float) -> Array:
    """Commands as openings follow them: behind the lag that explains most of a machine's valves best, shape (cells, valves).

    A valve whose opening comes later than that of the others still deviates.

    Parameters
    ----------
    cells : Cells
        The mission.
    openings, commands : Array, shape (cells, valves)
        Measured and commanded [1]; NaN where unknown.
    floor : float
        As of `compared`.
    """
    return behind(commands, cells.dt, _LAGS_S[_best_lag(cells, openings, commands, floor)])


def off_commands(cells: Cells, openings: Array, commands: Array, floor: float) -> Array:
    """How far openings are off their commands in each window, as `Compared.off` has it, shape (windows, valves).

    A valve is as slow as most of a machine's valves, or as the next slower or quicker would be; what is in one window and in
    none beside it is what is left of a jump before it. All arguments as of `as_followed`, openings and commands [1].
    """
    if not openings.shape[1]:
        return np.zeros((cells.frame.starts.size, 0))
    best = _best_lag(cells, openings, commands, floor)
    tried = [behind(commands, cells.dt, lag) for lag in _LAGS_S[max(0, best - 1) : best + 2]]
    off = np.column_stack(
        [np.minimum.reduce([compared(cells, y, x[:, j], floor).off for x in tried]) for j, y in enumerate(openings.T)]
    )
    edge = np.full((1, off.shape[1]), np.nan)
    beside = np.fmax(np.concatenate([edge, off[:-1]]), np.concatenate([off[1:], edge]))
    return np.asarray(np.where(np.isfinite(off), np.fmin(off, beside), np.nan))


def _best_lag(cells: Cells, openings: Array, commands: Array, floor: float) -> int:
    """Place among `_LAGS_S` of the lag that explains most of a machine's valves best; the first where nothing tells."""
    pairs = [
        (y, x) for y, x in zip(openings.T, commands.T, strict=True) if np.isfinite(y).any() and np.isfinite(x).any()
    ]
    if not pairs:
        return 0

    def left(k: int) -> float:
        usual = [compared(cells, y, behind(x, cells.dt, _LAGS_S[k]), floor).off for y, x in pairs]
        known = [float(quantile_known(off, _FOLLOWED)) for off in usual if np.isfinite(off).any()]
        return float(median_of(known)) if known else float("inf")

    return min(range(len(_LAGS_S)), key=left)


def behind(x: Array, dt: float, lag: float) -> Array:
    """Columns (cells, …) behind a lag of first order [s], in their unit; what is unknown stays so."""
    return np.where(np.isfinite(x), lowest_passed(x, dt, lag), np.nan) if lag else x


def late(speed: Array, reference: Array, dt: float) -> list[float | None]:
    """By how much each wheel's speed is later, or earlier, than the other wheels', by its changes beside the command's [s].

    None where a wheel's speed does not follow its command at any delay. Of two wheels the later one is: what holds readings up makes
    them late, and none early.

    Both of shape (cells, wheels) in m/s, `dt` in s.
    """
    steps = np.arange(-round(_EARLIEST_S / dt), round(_LATEST_S / dt) + 1)
    found: list[float | None] = []
    alike = []
    for v, c in zip(speed.T, reference.T, strict=True):
        changes, commanded = np.diff(v), np.diff(c)
        alike.append([_alike(changes, commanded, int(k)) for k in steps])
        best = int(np.argmax(alike[-1]))
        found.append(float((steps[best] + _top(alike[-1], best)) * dt) if alike[-1][best] > _FOLLOWS else None)
    known = sorted(x for x in found if x is not None)
    middle = known[(len(known) - 1) // 2] if known else 0.0
    there = int(np.argmin(np.abs(steps * dt - middle)))
    # a delay at which it is no more alike than at that of the others is none of its own
    same = [a[there] >= _AS_ALIKE * max(a) for a in alike]
    return [None if x is None else 0.0 if s else abs(x - middle) for x, s in zip(found, same, strict=True)]


def _top(alike: Sequence[float], best: int) -> float:
    """By how many cells the top of a parabola through the largest of some values and its neighbours lies beside it."""
    if not 0 < best < len(alike) - 1:
        return 0.0
    before, top, after = alike[best - 1 : best + 2]
    bend = before - 2.0 * top + after
    return 0.5 * (before - after) / bend if bend < 0.0 else 0.0


def _alike(x: Array, y: Array, delay: int) -> float:
    """Correlation of x with y delayed by some cells; 0 where nothing is known."""
    if abs(delay) >= x.size:
        return 0.0
    a, b = (x[delay:], y[: y.size - delay]) if delay >= 0 else (x[:delay], y[-delay:])
    known = np.isfinite(a) & np.isfinite(b)
    a, b = a[known], b[known]
    power = float(a @ a) * float(b @ b)
    return float(a @ b) / power**0.5 if power > 0.0 else 0.0


def alone(
    values: Sequence[float | None], i: int, limit: float, least: float, times: float, *, others: int = 2
) -> float:
    """Limit of one part: lower where the others deviate by much less than it.

    Parameters
    ----------
    values : Sequence[float or None]
        By how much each part deviates, in any unit; None or NaN where nothing is known.
    i : int
        The part.
    limit, least : float
        What it is at most and at least, in that unit.
    times : float
        By how many times the largest of the others' it may deviate.
    others : int
        Of how many that must be known.
    """
    beside = [abs(x) for j, x in enumerate(values) if j != i and x is not None and np.isfinite(x)]
    return float(min(limit, max(least, times * max(beside)))) if len(beside) >= others else limit


def times(check: Checked) -> float:
    """A check's value as a multiple of its limit [1]; less than any where it is not known."""
    return -1.0 if check.worst is None else check.worst / check.limit


def worst(
    cells: Cells, part: tuple[Kind, str, Side, Check], values: Array, limit: float, *, apart: bool = False
) -> Checked:
    """The check of a part with its largest value among the windows; None where no window shows it.

    What a stated fault makes of its part is nothing new: a window that one touches passes, unless its value is that of what
    lies apart from the faults, for a brief one explains no more than it lasts.

    Parameters
    ----------
    cells : Cells
        The mission.
    part : tuple[Kind, str, Side, Check]
        The part, and what is asked of it.
    values : Array, shape (windows,)
        In the unit of `limit`; NaN where nothing is known.
    limit : float
        From here on the part is not cleared.
    apart : bool
        Whether the values are those of `Cells.apart`.
    """
    if not np.isfinite(values).any():
        return Checked(*part, None, limit)
    named = part[1]
    mostly = cells.mostly_explained(named)  # of which `Cells.apart` leaves nothing out
    told = cells.explained(named, after=apart and mostly)
    values = np.where(told & ~np.isfinite(values) if apart and not mostly else told, 0.0, values)
    k = int(np.nanargmax(values))
    start = float(cells.frame.starts[k] * cells.dt)
    stop = min(start + cells.frame.length * cells.dt, cells.timeline.size * cells.timeline.dt)
    usual = float(quantile_known(np.abs(values), _SURE))
    return Checked(*part, float(values[k]), limit, start, stop, _shown(part[3], limit + usual))


def lasts(cells: Cells, part: tuple[Kind, str, Side, Check], value: float | None, limit: float) -> Checked:
    """The check of a part over the whole mission; nothing new where its faults are stated for much of it.

    `value` and `limit` in the check's unit.
    """
    stated = value is not None and cells.mostly_explained(part[1])
    return Checked(*part, 0.0 if stated else value, limit, shows=None if value is None else _shown(part[3], limit))


def _shown(check: Check, size: float) -> float | None:
    """Loss [1] of which a value of this size is the trace."""
    if check is Check.SECOND_MEASUREMENT:
        return min(size, 1.0)
    return float(-np.expm1(-size)) if check in _LOSSES else None
