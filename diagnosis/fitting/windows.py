"""Windows of healthy missions: means of speed, opening and command of one wheel, and scatter about them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.lag import low_passed

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WINDOW_S = 2.0
_CHANGE = 0.02


@dataclass(frozen=True)
class WheelRecord:
    """One wheel in one mission.

    Attributes
    ----------
    y, command : Array, shape (n,)
        Speed and its command [m/s]; NaN where not valid.
    u : Array, shape (n, k)
        Opening [fraction]; several where a mean over wheels is fitted.
    use : Mask, shape (n,)
        Samples that the model holds for (the pump feeds all wheels).
    dt : float
        Step [s].
    driving : float
        Speed above which the wheel drives [m/s].
    """

    y: Array
    u: Array
    command: Array
    use: Mask
    dt: float
    driving: float


def window_length(dt: float) -> int:
    """Samples of a window at steps of dt [s]."""
    return max(8, round(WINDOW_S / dt))


def opened(u: Array, dead: float) -> Array:
    """Opening beyond the dead zone, sgn(u)·max(|u| − dead, 0) [fraction]. Both of shape (n,)."""
    return np.asarray(np.sign(u) * np.maximum(np.abs(u) - dead, 0.0)) if dead > 0 else u


def fed(record: WheelRecord, dead: float, tau: float) -> Array:
    """Lagged opening beyond the dead zone, the mean of all in the record, shape (n,).

    In fractions of opening; `dead` likewise, `tau` in s.
    """
    each = [low_passed(opened(u, dead), tau, record.dt) for u in record.u.T]
    return np.asarray(np.mean(each, axis=0))


@dataclass(frozen=True)
class Windows:
    """Sums over the windows of all missions, each of shape (n,); see `Cuts.windows`."""

    y: Array
    p: Array
    z: Array
    mission: NDArray[np.int64]
    place: NDArray[np.int64]
    group: NDArray[np.int64]
    steady: Mask
    frozen: Mask
    yy: Array
    yp: Array
    pp: Array
    changing: Mask


class Cuts:
    """A wheel's missions cut into windows that drive; what the model of the wheel does not change is cut once.

    Parameters
    ----------
    records : list[WheelRecord]
        The wheel in each mission.
    """

    def __init__(self, records: list[WheelRecord]) -> None:
        self.records = records
        whole = [max(1, int(r.y.size * r.dt / WINDOW_S)) for r in records]
        several = len(records) >= 4
        per_block = max(1, round(sum(whole) / 10))
        blocks = 0
        speeds = np.concatenate([np.abs(r.command[np.abs(r.command) > r.driving]) for r in records])
        typical = float(np.median(speeds)) if speeds.size else 1.0
        self._missions: list[_Mission] = []
        parts: list[tuple[NDArray[Any], ...]] = []
        for m, r in enumerate(records):
            length = window_length(r.dt)
            known = r.use & np.isfinite(r.y) & np.isfinite(r.u).all(axis=1) & np.isfinite(r.command)
            y, z = (_cut(np.where(known, x, 0.0), length) for x in (r.y, r.command))
            k = _cut(known, length)
            count = k.sum(axis=1)
            n = np.maximum(count, 1)
            my, mz = (x.sum(axis=1) / n for x in (y, z))
            moving = (np.abs(z) > r.driving).sum(axis=1) > 0.5 * length
            steady = (np.abs(z) > r.driving).sum(axis=1) > 0.98 * count
            steady &= np.abs(np.sign(z).sum(axis=1)) > 0.98 * count
            frozen = (np.ptp(y, axis=1) == 0) & steady
            group = np.full(my.size, m) if several else blocks + np.arange(my.size) // per_block
            blocks = int(group[-1]) + 1 if group.size and not several else blocks
            keep = (count > 0.9 * length) & moving
            dy, dz = (np.where(k, x - mean[:, None], 0.0) for x, mean in ((y, my), (z, mz)))
            changing = (dz * dz).sum(axis=1) / n > (_CHANGE * typical) ** 2
            cols = (my, mz, np.full(my.size, m), np.arange(my.size), group, steady, frozen)
            parts.append(tuple(c[keep] for c in (*cols, (dy * dy).sum(axis=1) / n, changing)))
            self._missions.append(_Mission(keep, k[keep], n[keep], dy[keep]))
        self._columns = [np.concatenate(c) for c in zip(*parts, strict=True)]

    def windows(self, dead: float, tau: float) -> Windows:
        """Means, and scatter about them, of speed and fed opening.

        `dead` in fractions of opening, `tau` in s.
        """
        parts = [m.of(fed(r, dead, tau)) for m, r in zip(self._missions, self.records, strict=True)]
        p, yp, pp = (np.concatenate(c) for c in zip(*parts, strict=True))
        y, z, mission, place, group, steady, frozen, yy, changing = self._columns
        return Windows(y, p, z, mission, place, group, steady, frozen, yy, yp, pp, changing)


@dataclass(frozen=True)
class _Mission:
    """Windows of one mission: which are kept; of those the known samples, their number, and the speed about its mean."""

    keep: Mask
    known: Mask
    n: NDArray[np.int64]
    dy: Array

    def of(self, fed: Array) -> tuple[Array, Array, Array]:
        """Mean of the fed opening, shape (samples,), and its scatter with the speed and with itself, each window's."""
        length = self.known.shape[1]
        p = np.where(self.known, _cut(fed, length)[self.keep], 0.0)
        mean = p.sum(axis=1) / self.n
        dp = np.where(self.known, p - mean[:, None], 0.0)
        return mean, (self.dy * dp).sum(axis=1) / self.n, (dp * dp).sum(axis=1) / self.n


def _cut(x: NDArray[Any], length: int) -> NDArray[Any]:
    count = x.size // length
    return x[: count * length].reshape(count, length)
