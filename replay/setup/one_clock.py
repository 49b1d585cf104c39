"""Whether tables were stamped by one clock, by signals that must go together: a wheel's speed and its command, the body's motion and the wheels'."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.signals.signal import Signal, Signals

Array = NDArray[np.float64]

_STEP_S = 0.05
_SEARCH_S = 10.0
_LEAST_S = 30.0  # both must be recorded for
_SOUND = 0.7  # share of the variance that the best lag must explain
_WORSE = 2.0  # times as much is left unexplained where a lag does not fit
_NEAR_S = 0.5  # drives follow their commands within this
_FAR_S = 1.0
_WHEEL = ("v", "v_true", "v_ref", "u", "u_applied")
_FORWARD, _TURNING = ("cmd.v", "odom.v", "gnss.speed"), ("cmd.omega", "imu.yaw_rate")


class Lag(NamedTuple):
    """By how much one file's stamps are later than another's.

    Attributes
    ----------
    seconds : float
        Lag [s], with what a drive takes to follow.
    by, other : str
        Signal of the file that was compared, and the other file.
    """

    seconds: float
    by: str
    other: str

    @property
    def fits(self) -> bool:
        """Whether it is no more than a drive's own delay."""
        return abs(self.seconds) <= _NEAR_S

    @property
    def apart(self) -> bool:
        """Whether no drive is so late."""
        return abs(self.seconds) > _FAR_S


def lags(found: Signals, wheels: Sequence[str], left: Sequence[str], sources: Sequence[str]) -> dict[str, Lag]:
    """Lags of files against the first one, or one whose signals fit to it; none for a file of which nothing tells.

    Parameters
    ----------
    found : Signals
        Of all files, as recorded.
    wheels, left : Sequence[str]
        Wheels, and those of them on the left side.
    sources : Sequence[str]
        Files in their order.
    """
    out: dict[str, Lag] = {}
    known, waiting = [*sources[:1]], [*sources[1:]]
    while waiting:
        for source in waiting:
            pairs = _pairs(found.items, wheels, left, source)
            measured = [m for a, b in pairs if a.source in known and (m := _lag(a, b)) is not None]
            if measured:
                out[source] = sorted(measured)[len(measured) // 2]
                known += [source] if out[source].fits else []
                waiting.remove(source)
                break
        else:
            break
    return out


def _pairs(
    items: Mapping[str, Signal], wheels: Sequence[str], left: Sequence[str], source: str
) -> list[tuple[Signal, Signal]]:
    """Signals of other files, each with one of `source` that must go with it."""
    pairs = []
    for wheel in wheels:
        of_wheel = [s for leaf in _WHEEL if (s := items.get(f"wheel.{wheel}.{leaf}")) is not None]
        pairs += [(a, b) for a in of_wheel for b in of_wheel if a.source != source == b.source]
    speeds = {w: s for w in wheels if (s := items.get(f"wheel.{w}.v")) is not None}
    if not speeds or len({s.source for s in speeds.values()}) > 1:
        return pairs
    sides = [[s for w, s in speeds.items() if (w in left) == on_left] for on_left in (True, False)]
    mean = _combined([*speeds.values()], [])
    for names, wheel_motion in ((_FORWARD, mean), (_TURNING, _combined(sides[1], sides[0]) if all(sides) else None)):
        for body in (items[n] for n in names if n in items):
            if wheel_motion is not None and (body.source == source) != (wheel_motion.source == source):
                pairs.append((wheel_motion, body) if body.source == source else (body, wheel_motion))
    return pairs


def _combined(plus: Sequence[Signal], minus: Sequence[Signal]) -> Signal:
    """Mean of some signals less that of others, at the stamps of the first."""
    first = plus[0]
    values = np.mean([_at(s, first.stamps) for s in plus], axis=0)
    if minus:
        values = values - np.mean([_at(s, first.stamps) for s in minus], axis=0)
    return Signal(first.name, first.stamps, values, first.origin, first.source, first.guessed)


def _at(signal: Signal, stamps: NDArray[np.int64]) -> Array:
    known = np.isfinite(signal.values)
    if not known.any():
        return np.full(stamps.size, np.nan)
    at = signal.stamps[known]
    return np.asarray(np.interp((stamps - at[0]) * 1e-9, (at - at[0]) * 1e-9, signal.values[known]), np.float64)


def _lag(a: Signal, b: Signal) -> Lag | None:
    """Least lag of b behind a that explains them about as well as the best one; None where they do not tell."""
    if a.stamps.size < 2 or b.stamps.size < 2:
        return None
    start = max(int(a.stamps[0]), int(b.stamps[0]))
    size = int((min(int(a.stamps[-1]), int(b.stamps[-1])) - start) * 1e-9 / _STEP_S)
    most = round(_SEARCH_S / _STEP_S)
    if size < 2 * most + _LEAST_S / _STEP_S:
        return None
    grid = start + (np.arange(size) * _STEP_S * 1e9).astype(np.int64)
    x, y = _at(a, grid)[most:-most], _at(b, grid)
    if "gnss.speed" in (a.name, b.name):  # of satellites it has no sign
        x, y = np.abs(x), np.abs(y)
    shifts = np.arange(-most, most + 1)
    with np.errstate(all="ignore"):
        r = np.array([np.corrcoef(x, y[most + k : most + k + x.size])[0, 1] for k in shifts])
    rest = 1.0 - np.square(r)
    if not np.isfinite(rest).all() or rest.min() > 1.0 - _SOUND:
        return None
    alike = np.flatnonzero(rest <= 1.2 * rest.min() + 1e-9)
    best = int(alike[np.argmin(np.abs(shifts[alike]))])
    far = np.abs(shifts - shifts[best]) >= round(_FAR_S / _STEP_S)
    near_best = far & (np.abs(shifts - shifts[best]) <= 2 * round(_FAR_S / _STEP_S))
    if not near_best.any() or rest[near_best].min() < _WORSE * rest[best]:
        return None
    if abs(shifts[best]) > round(_FAR_S / _STEP_S) and rest[most] < _WORSE * rest[best]:
        return None
    return Lag(float(shifts[best] * _STEP_S), b.name, a.source)
