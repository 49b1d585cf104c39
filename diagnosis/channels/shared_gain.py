"""What the positions of all wheels' valves lack alike of their commands: warm coils or a low supply, and no valve's fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_WINDOW_S, _USED_S, _SAMPLE_S = 5.0, 0.5, 0.02  # windows; of each, in which a valve opens; between what is looked at
_OPENS = 0.1  # of full opening
_VALVES, _WINDOWS = 3, 3  # that must agree; that must show it
_ALIKE = 0.05  # by which gains of valves that agree differ at most
_LEAST, _MOST = 0.04, 0.18  # of the gain lost: what is worth it; what is more is a fault, of however many valves
_ABOVE, _STEP = 0.03, 0.07  # a valve that seems to open more, or whose gain jumps, follows otherwise than by a gain


def without_shared_gain(timeline: Timeline, machine: Machine) -> Timeline:
    """A timeline whose valve positions are what they would be without the gain that most valves share; the same one where it is 1.

    Coils that warm, or a supply that falls, take the same share of the opening from every valve. A loss that two valves or fewer
    have, and one as large as a fault, stays.
    """
    names = [n for w in machine.wheels if {(n := f"wheel.{w}.u_applied"), f"wheel.{w}.u"} <= timeline.signals.keys()]
    if len(names) < _VALVES:
        return timeline
    span, every = max(machine.control.u_max, 1e-6), max(1, round(_SAMPLE_S / timeline.dt))
    dt = every * timeline.dt
    width = max(1, round(_WINDOW_S / dt))

    def gains_of(name: str) -> Array:
        position, command = (timeline.signals[n][::every] for n in (name, name.removesuffix("_applied")))
        return gain_by_window(position, command, width, dt, span)

    gains = np.column_stack([gains_of(n) for n in names])
    shared = shared_gain(gains)
    if shared is None:
        return timeline
    middle = (np.arange(shared.size) + 0.5) * width * every
    known = np.isfinite(shared)
    course = np.interp(np.arange(timeline.size), middle[known], shared[known])
    signals = {**timeline.signals, **{n: timeline.store.keep(timeline.signals[n] / course) for n in names}}
    low, high = np.nanmin(shared), np.nanmax(shared)
    note = (
        f"The positions of {len(names)} valves are {low:.2f} to {high:.2f} times their commands, all alike: taken as of all of them "
        "(warm coils, a low supply) and as no valve's fault."
    )
    return replace(timeline, signals=signals, notes=(*timeline.notes, note))


def gain_by_window(position: Array, command: Array, width: int, dt: float, span: float) -> Array:
    """Position per command of a valve that opens, in each window [1], shape (windows,); NaN where it hardly does.

    Parameters
    ----------
    position, command : Array, shape (n,)
        In the same unit; NaN where not valid.
    width : int
        Samples in a window.
    dt : float
        Step [s].
    span : float
        Full opening, in that unit.
    """
    size = position.size // width * width
    y, u = (x[:size].reshape(-1, width) for x in (position, command))
    use = (np.abs(u) > _OPENS * span) & np.isfinite(y)
    y, u = np.where(use, y, 0.0), np.where(use, u, 0.0)
    enough = np.count_nonzero(use, axis=1) * dt >= _USED_S
    return np.where(enough, (y * u).sum(axis=1) / np.maximum((u * u).sum(axis=1), 1e-12), np.nan)


def shared_gain(gains: Array) -> Array | None:
    """Gain that three valves or more share in each window [1], shape (windows,); NaN where they do not agree or hardly open.

    None where it is 1 within what is worth it, where more is missing than of healthy valves, or where it does not change slowly.

    Parameters
    ----------
    gains : Array, shape (windows, valves)
        Position per command [1]; NaN where a valve hardly opens.
    """
    largest_first = -np.sort(-gains, axis=1)  # NaN last
    second, third = largest_first[:, 1], largest_first[:, 2]
    shared = np.where(second - third <= _ALIKE, second, np.nan)
    lost = 1.0 - shared[np.isfinite(shared)]
    if lost.size < _WINDOWS or np.count_nonzero(lost > _LEAST) < _WINDOWS:
        return None
    slow = lost.min() >= -_ABOVE and np.abs(np.diff(lost)).max() <= _STEP
    return shared if slow and lost.max() <= _MOST else None
