"""What two files recorded of the same quantity, as samples that their clocks can be compared by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.machine.signal_table import signal_of
from replay.signals.signal import Signal
from replay.signals.to_si import slope

Array = NDArray[np.float64]

_MOST = 10
_MOST_LONG = 4
_LONG = 1 << 20
_BIN_S = 0.01
_LARGEST = 1e9
_FEWEST = 50
# Two sensors of one motion: each may be late by its own filter [s].
_SENSOR_DELAY_S = 0.02


@dataclass(frozen=True)
class Series:
    """Samples of one quantity on one file's clock.

    Attributes
    ----------
    t : NDArray[np.float64], shape (n,)
        Increasing [s since the file's origin].
    x : NDArray[np.float64], shape (n,)
        Finite values.
    period : float
        Median distance of these samples [s].
    recorded : float
        Median distance of the samples that were recorded [s].
    """

    t: Array
    x: Array
    period: float
    recorded: float

    def within(self, first: float, last: float) -> Series:
        """Samples of a stretch of time. Times in s."""
        a, b = np.searchsorted(self.t, (first, last))
        return Series(self.t[a:b], self.x[a:b], self.period, self.recorded)

    def rows(self, kept: NDArray[np.bool_]) -> Series:
        """Some of the samples. `kept` of shape (n,)."""
        return Series(self.t[kept], self.x[kept], self.period, self.recorded)

    def thinned(self, width: float) -> Series:
        """Means of stamps and values over bins, so that a straight line stays where it is; slow samples stay as they are.

        `width` in s.
        """
        if self.period > 0.6 * width or len(self.t) < 2:
            return self
        first = np.flatnonzero(np.diff(np.floor(self.t / width), prepend=-np.inf) > 0)
        count = np.diff(np.append(first, len(self.t)))
        start = self.t[first]
        t = start + np.add.reduceat(self.t - np.repeat(start, count), first) / count
        return Series(t, np.add.reduceat(self.x, first) / count, max(width, self.period), self.recorded)


@dataclass(frozen=True)
class Shared:
    """A quantity that two files recorded.

    Attributes
    ----------
    name : str
        Canonical name, or both names where sensors differ.
    reference, other : Series
        As recorded in the two files.
    delay_s : float
        What the two sensors may be late against each other [s].
    """

    name: str
    reference: Series
    other: Series
    delay_s: float = 0.0


def shared_series(
    reference: Mapping[str, Signal], other: Mapping[str, Signal], origins: tuple[int, int]
) -> tuple[Shared, ...]:
    """Quantities that move in both files, at most ten; two sensors of one motion only where no copy is shared.

    Parameters
    ----------
    reference, other : Mapping[str, Signal]
        Signals of the two files by canonical name.
    origins : tuple[int, int]
        Zero of time of the two files [ns].
    """
    ranks = {n: signal_of(n).clock_rank for n in reference.keys() & other.keys()}
    names = [n for _, n in sorted((rank, n) for n, rank in ranks.items() if rank is not None)]
    long = any(len(reference[n].stamps) > _LONG or len(other[n].stamps) > _LONG for n in names)
    pairs = [(n, reference[n], other[n], 0.0) for n in names] or [
        (f"{mine.name} with {theirs.name}", mine, theirs, _SENSOR_DELAY_S)
        for mine, theirs in _two_sensors(reference, other)
    ]
    found: list[Shared] = []
    for name, mine, theirs, delay in pairs:
        if len(found) < (_MOST_LONG if long else _MOST):
            a, b = _series(mine, origins[0]), _series(theirs, origins[1])
            if a is not None and b is not None:
                found.append(Shared(name, a, b, delay))
    return tuple(found)


def _two_sensors(reference: Mapping[str, Signal], other: Mapping[str, Signal]) -> list[tuple[Signal, Signal]]:
    """Pairs of different sensors of one motion."""
    out = []
    for one, two in ((reference, other), (other, reference)):
        for name, signal in one.items():
            second = two.get(f"{name}_true") if name.endswith((".v", ".phi")) else None
            if name == "imu.yaw_rate" and "odom.yaw" in two:
                second = _rate(two["odom.yaw"])
            if second is not None:
                out.append((signal, second) if one is reference else (second, signal))
    return out


def _rate(signal: Signal) -> Signal:
    return Signal(
        signal.name, signal.stamps, slope(signal.stamps, signal.values), signal.origin, signal.source, signal.guessed
    )


def _series(signal: Signal, origin: int) -> Series | None:
    """Finite samples that move, or None."""
    parts = [p for rows in blocks(len(signal.stamps), _LONG) if (p := _part(signal, rows, origin)) is not None]
    if not parts or sum(len(p.x) for p in parts) < _FEWEST:
        return None
    if len(parts) == 1:
        whole = parts[0]
        t, x = _without_holds(whole.t, whole.x)
        period = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        whole = Series(t, x, period, period)
    else:  # hours at a high rate: kept as means
        thin = [p.thinned(_BIN_S) for p in parts]
        whole = Series(
            np.concatenate([p.t for p in thin]), np.concatenate([p.x for p in thin]), thin[0].period, parts[0].period
        )
    return whole if len(whole.x) >= _FEWEST and whole.period > 0 and np.ptp(whole.x) > 0 else None


def _part(signal: Signal, rows: slice, origin: int) -> Series | None:
    values = signal.values[rows]
    good = np.abs(values) < _LARGEST
    if not good.any():
        return None
    t = np.asarray((signal.stamps[rows][good] - origin) * 1e-9, np.float64)
    period = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    return Series(t, np.asarray(values[good], np.float64), period, period)


def _without_holds(t: Array, x: Array) -> tuple[Array, Array]:
    """Reduce a slow signal that a fast table repeats to the samples in which it arrived.

    Its last value is held until the next arrives: interpolated as it is it would seem late by half its own period.
    """
    change = np.flatnonzero(np.diff(x)) + 1
    if not 20 <= len(change) <= 0.4 * len(x):
        return t, x
    spacing = np.diff(t[change])
    usual = float(np.median(spacing))
    if not usual > 0:
        return t, x
    turns = spacing / usual
    regular = float((np.abs(turns - np.rint(turns)) < 0.15).mean())
    if usual < 2.5 * float(np.median(np.diff(t))) or regular < 0.9:
        return t, x
    held = np.flatnonzero(spacing > 1.5 * usual)  # the value before a pause stays until one period before the next
    at = np.concatenate([t[:1], t[change], t[change[held + 1]] - usual])
    value = np.concatenate([x[:1], x[change], x[change[held]]])
    order = np.argsort(at, kind="stable")
    return at[order], value[order]
