"""What two files recorded of the same quantity, as samples that their clocks can be compared by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.mapping_convert import slope
from replay.signals import Signal, quantity_kind

Array = NDArray[np.float64]

_MOST = 10
_LARGEST = 1e9
_FEWEST = 50
# Quantities whose copies show the same moment, the surest first; a plant lies between commands and speeds.
_KINDS = (
    "cmd.v", "cmd.omega", "wheel.v", "wheel.v_true", "steer.phi", "steer.phi_true", "wheel.v_ref", "steer.phi_ref",
    "wheel.u", "steer.u", "wheel.u_applied", "steer.u_applied", "imu.yaw_rate", "odom.yaw", "odom.x", "odom.y",
    "wheel.psi", "wheel.pressure_a", "wheel.pressure_b",
)  # fmt: skip
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
        Median distance of samples [s].
    """

    t: Array
    x: Array
    period: float

    def within(self, first: float, last: float) -> Series:
        """Samples of a stretch of time."""
        a, b = np.searchsorted(self.t, (first, last))
        return Series(self.t[a:b], self.x[a:b], self.period)

    def thinned(self, width: float) -> Series:
        """Means of stamps and values over bins, so that a straight line stays where it is; slow samples stay as they are."""
        if self.period > 0.6 * width or len(self.t) < 2:
            return self
        first = np.flatnonzero(np.diff(np.floor(self.t / width), prepend=-np.inf) > 0)
        count = np.diff(np.append(first, len(self.t)))
        start = self.t[first]
        t = start + np.add.reduceat(self.t - np.repeat(start, count), first) / count
        return Series(t, np.add.reduceat(self.x, first) / count, max(width, self.period))


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
    names = sorted(
        (n for n in reference.keys() & other.keys() if quantity_kind(n) in _KINDS),
        key=lambda n: (_KINDS.index(quantity_kind(n)), n),
    )
    found = [Shared(n, a, b) for n in names if (a := _series(reference[n], origins[0])) is not None and (b := _series(other[n], origins[1])) is not None]  # fmt: skip
    if found:
        return tuple(found[:_MOST])
    for mine, theirs in _two_sensors(reference, other):
        a, b = _series(mine, origins[0]), _series(theirs, origins[1])
        if a is not None and b is not None:
            found.append(Shared(f"{mine.name} with {theirs.name}", a, b, _SENSOR_DELAY_S))
    return tuple(found[:_MOST])


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
    good = np.abs(signal.values) < _LARGEST
    x = signal.values[good]
    if len(x) < _FEWEST or not np.ptp(x) > 0:
        return None
    t = np.asarray((signal.stamps[good] - origin) * 1e-9, np.float64)
    t, x = _without_holds(t, x)
    return Series(t, x, float(np.median(np.diff(t)))) if len(x) >= _FEWEST else None


def _without_holds(t: Array, x: Array) -> tuple[Array, Array]:
    """Reduce a slow signal that a fast table repeats to the samples in which it arrived.

    Its last value is held until the next arrives: interpolated as it is it would seem late by half its own period.
    """
    change = np.flatnonzero(np.diff(x)) + 1
    if not 20 <= len(change) <= 0.4 * len(x):
        return t, x
    spacing = np.diff(t[change])
    usual = float(np.median(spacing))
    turns = spacing / usual
    regular = float((np.abs(turns - np.rint(turns)) < 0.15).mean())
    if usual < 2.5 * float(np.median(np.diff(t))) or regular < 0.9:
        return t, x
    held = np.flatnonzero(spacing > 1.5 * usual)  # the value before a pause stays until one period before the next
    at = np.concatenate([t[:1], t[change], t[change[held + 1]] - usual])
    value = np.concatenate([x[:1], x[change], x[change[held]]])
    order = np.argsort(at, kind="stable")
    return at[order], value[order]
