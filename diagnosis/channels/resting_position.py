"""Where a valve's position rests while nothing is asked of it: the zero of its sensor, taken out of what it reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_IDLE = 0.003  # of full opening: a command that asks for nothing
_SETTLES_S, _LEAST_S = 0.3, 0.2  # after a command came to rest; of a rest beyond that
_RESTS = 2
_MOST, _LEAST = 0.035, 0.004  # of full opening: how far off a healthy sensor is set; what is worth taking out
_ALIKE = 0.3  # of the zero, by which the middle half of the rests may differ: a spool that friction holds rests on either side


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
    first, stop = np.where(edge[::2] > 0, edge[::2] + round(_SETTLES_S / dt), 0), edge[1::2]
    use = fresh & np.isfinite(position)
    rests = [position[a:b][use[a:b]] for a, b in zip(first, stop, strict=True) if (b - a) * dt >= _LEAST_S]
    values = np.array([np.median(r) for r in rests if r.size])
    if values.size < _RESTS:
        return 0.0
    low, zero, high = np.quantile(values, (0.25, 0.5, 0.75))
    agree = high - low <= _ALIKE * abs(zero)
    return float(zero) if agree and _LEAST * span <= abs(zero) <= _MOST * span else 0.0
