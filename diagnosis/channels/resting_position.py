"""Where a valve's position rests while nothing is asked of it: the zero of its sensor, taken out of what it reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of, quantile_of
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_IDLE = 0.003  # of full opening: a command that asks for nothing
_SETTLES_S, _LEAST_S = 0.3, 0.2  # after a command came to rest; of a rest beyond that
_RESTS = 3
_MOST, _LEAST = 0.035, 0.006  # of full opening: how far off a healthy sensor is set; what is worth taking out
_OPENS, _SAMPLE_S, _FEW, _ROUNDS = 0.04, 0.02, 50, 8  # of full opening; between what is looked at; samples; of a fit
_SAME = 0.4  # of the zero, by which it may differ where the valve opens: a spool that friction holds has none there
_ALIKE = 0.3  # of the zero, by which the middle half of the rests may differ


def with_zeroed_positions(timeline: Timeline, machine: Machine) -> Timeline:
    """A timeline whose valve positions read 0 where the valves rest; the same one where they do already.

    A sensor that is set off by some hundredths of the opening reads them always, so that a small opening seems to be much
    more, or less, than was asked for.
    """
    span, notes, signals = max(machine.control.u_max, 1e-6), list(timeline.notes), dict(timeline.signals)
    for name in timeline.signals:
        told = name.removesuffix("_applied")
        if not name.endswith(".u_applied") or told not in signals:
            continue
        zero = zero_of(timeline.signals[name], timeline.signals[told], timeline.fresh[name], timeline.dt, span)
        if zero:
            signals[name] = timeline.store.keep(timeline.signals[name] - zero)
            notes.append(f"{name} reads {zero:+.3f} where its valve is asked for nothing: taken as its sensor's zero.")
    return replace(timeline, signals=signals, notes=tuple(notes)) if len(notes) > len(timeline.notes) else timeline


def zero_of(position: Array, command: Array, fresh: NDArray[np.bool_], dt: float, span: float) -> float:
    """What a position reads at rest, of full opening as it; 0 where rests do not agree on it, or on more than a sensor's zero.

    Parameters
    ----------
    position, command : Array, shape (n,)
        Of one valve, in the same unit; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new position.
    dt : float
        Step [s].
    span : float
        Full opening, in that unit.
    """
    idle = np.abs(command) < _IDLE * span  # NaN is none
    edge = np.flatnonzero(np.diff(np.r_[False, idle, False].astype(np.int8)))
    begin, stop = edge[::2], edge[1::2]
    settled = np.where(begin > 0, begin + round(_SETTLES_S / dt), 0)
    use = fresh & np.isfinite(position)
    values, sides = [], []
    for start, first, last in zip(begin, settled, stop, strict=True):
        seen = position[first:last][use[first:last]]
        if seen.size and (last - first) * dt >= _LEAST_S:
            values.append(float(median_of(seen)))
            sides.append(np.sign(np.nan_to_num(command[start - 1])) if start else 0.0)
    if len(values) < _RESTS:
        return 0.0
    low, zero, high = (float(q) for q in quantile_of(values, (0.25, 0.5, 0.75)))
    agree = high - low <= _ALIKE * abs(zero)
    held = -np.sign(zero) not in sides  # friction leaves a spool on the side that it comes from
    if held or not agree or not _LEAST * span <= abs(zero) <= _MOST * span:
        return 0.0
    every = max(1, round(_SAMPLE_S / dt))
    moving = use[::every] & (np.abs(command[::every]) > _OPENS * span)
    opens = _offset(position[::every][moving], command[::every][moving])
    return zero if abs(opens - zero) <= _SAME * abs(zero) else 0.0


def _offset(y: Array, x: Array) -> float:
    """Offset of y = gain·x + offset, of what most samples agree on; NaN where x is on one side alone."""
    if min(np.count_nonzero(x > 0.0), np.count_nonzero(x < 0.0)) < _FEW:
        return float("nan")
    design, weight = np.column_stack([x, np.ones(x.size)]), np.ones(x.size)
    gain, offset = 1.0, 0.0
    for _ in range(_ROUNDS):
        weighted = design * weight[:, np.newaxis]
        gain, offset = (float(c) for c in np.linalg.solve(weighted.T @ design, weighted.T @ y))
        misfit = np.abs(y - gain * x - offset)
        weight = 1.0 / np.maximum(misfit, max(float(median_of(misfit)), 1e-9))
    return offset
