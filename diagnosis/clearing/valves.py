"""Checks of valves beside their commands, where their positions are measured: in windows, over ten seconds, and what the position jitters by."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.leaps import heights
from diagnosis.clearing.longer import around, longer
from diagnosis.clearing.measure import alone, as_followed, lasts, off_commands, times, worst
from diagnosis.clearing.responses import largest
from diagnosis.clearing.seconds import slope_off
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.arrays.blocks import release
from replay.faults import Side

OPENING = 0.03  # of full opening: deviations are shares of at least this
#: Dead band and hysteresis of a healthy valve: the limit in windows as a multiple of the loss that counts. Less beside others that are off by much
#: less, and over ten seconds, in which both pass: of 17 healthy tuning missions of as many machines wheels had .09 there at most, axles .18.
_VALVE, _LEAST, _TIMES, _LONG = 1.4, 0.6, 2.2, {Kind.WHEEL: 0.6, Kind.STEER: 1.0}
_JITTER = 0.2  # of the loss that counts: noise of a position, of full opening
_OF_NOISE = 0.5645  # mean height of the peaks of white noise of one sample's standard deviation, 0 between them
_MANY = 8  # readings of a window
_SMALL = 0.1  # of `OPENING`: a command that varies by less, root mean square, shows nothing


class BesideCommands(NamedTuple):
    """Positions of valves beside their commands.

    Attributes
    ----------
    off : Array, shape (windows, valves)
        How far they are off, beside stated faults, as `Compared.off` has it; NaN where unknown.
    limits : tuple[float, ...]
        From which on each counts in a window.
    """

    off: Array
    limits: tuple[float, ...]


def beside_commands(cells: Cells, kind: Kind) -> BesideCommands:
    """Positions of the valves of all wheels, or of all axles, beside their commands."""

    def found() -> BesideCommands:
        leaves, clear_at = cells.wheels if kind is Kind.WHEEL else cells.axles, cells.machine.limits.clear_at
        names = names_of(cells, kind)
        apart = np.column_stack([cells.apart(name) for name in names]) if names else True
        off = off_commands(cells, np.where(apart, leaves("u_applied"), np.nan), leaves("u"), OPENING)
        most = [float(x) for x in largest(off)]
        limits = (alone(most, i, _VALVE * clear_at, _LEAST * clear_at, _TIMES) for i in range(len(most)))
        return BesideCommands(off, tuple(limits))

    return cells.once_beside(f"{kind} beside commands", found)


def names_of(cells: Cells, kind: Kind) -> Sequence[str]:
    """Of the machine's wheels, or of its axles."""
    return cells.machine.wheels if kind is Kind.WHEEL else tuple(cells.machine.axles)


def valve_checks(cells: Cells, kind: Kind, clear_at: float) -> Iterator[Checked]:
    """Checks of the valves of all wheels, or of all axles; `clear_at` is the loss that counts [1]."""
    names = names_of(cells, kind)
    off, limits = beside_commands(cells, kind)
    long = longer(cells, off, names)
    for i, name in enumerate(names):
        part = f"{'wheel' if kind is Kind.WHEEL else 'steer'}.{name}"
        if not all(np.isfinite(cells.means(f"{part}.{leaf}")).any() for leaf in ("u", "u_applied")):
            continue
        about = (kind, name, Side.ACTUATOR)
        yield worst(cells, (*about, Check.JITTER), _jitter(cells, part), _JITTER * clear_at, apart=True)
        if not np.isfinite(off[:, i]).any():
            whole = _by_changes(cells, kind, i, cells.apart(name))
            yield lasts(cells, (*about, Check.SECOND_MEASUREMENT), whole, _LONG[kind] * clear_at)
            continue
        brief = worst(cells, (*about, Check.SECOND_MEASUREMENT), off[:, i], limits[i], apart=True)
        most = _LONG[kind] * clear_at
        lasting = worst(cells, (*about, Check.SECOND_MEASUREMENT), long[:, i], most, apart=True)
        yield max(brief, around(lasting), key=times)


def _by_changes(cells: Cells, kind: Kind, i: int, use: NDArray[np.bool_]) -> float | None:
    """By how much a position changes more or less than its command over the mission, as a share, of a valve that is opened by little alone.

    `use` of shape (cells,); None where that tells too little.
    """
    leaves = cells.wheels if kind is Kind.WHEEL else cells.axles
    position, command = leaves("u_applied"), leaves("u")
    followed = as_followed(cells, position, command, OPENING)
    return slope_off(np.where(use, position[:, i], np.nan), followed[:, i], cells.dt, _SMALL * OPENING)


def _jitter(cells: Cells, part: str) -> Array:
    """Noise of a valve's position beside that of its command, as a standard deviation [of full opening], shape (windows,); NaN where few are read."""
    position, command = (_peaks(cells, f"{part}.{leaf}") for leaf in ("u_applied", "u"))
    return np.asarray(np.sqrt(np.maximum(position**2 - np.nan_to_num(command) ** 2, 0.0)))


def _peaks(cells: Cells, name: str) -> Array:
    """White noise of a signal by the peaks of single readings, which neither steps nor ramps have, shape (windows,)."""
    y, frame = cells.timeline.get(name), cells.frame
    if y is None:
        return np.full(frame.starts.size, np.nan)
    at = np.flatnonzero(cells.timeline.fresh[name] & np.isfinite(y))
    v = y[at]
    release(y)
    before, after = v[1:-1] - v[:-2], v[1:-1] - v[2:]
    height = heights(before, after)
    cell = at[1:-1] // cells.width
    total, count = (
        frame.sums(np.bincount(cell, z, minlength=cells.size).astype(np.float64)) for z in (height, np.ones(cell.size))
    )
    return np.asarray(np.where(count >= _MANY, total / np.maximum(count, 1.0) / _OF_NOISE, np.nan))
