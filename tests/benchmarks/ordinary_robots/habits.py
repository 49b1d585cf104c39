"""Habits of recorders: clocks that jitter, step or arrive in packets, positions without speeds, commands sent only when they change."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = list[tuple[float, str, str, Any]]

HABITS = ("usual", "jittery", "steps", "positions", "changes", "bare", "unsigned")
_PACKET_S = 0.25
_REPEATED_S = 1.0  # after which a command that has not changed is sent again


@dataclass(frozen=True)
class Habits:
    """How a mission is recorded.

    Attributes
    ----------
    name : str
        Of `HABITS`: stamps that jitter by a quarter of the period with messages that arrive in packets; a clock that is set twice in the
        mission; joints with positions alone; commands that are sent when they change; neither inertial unit nor odometry.
    seed : int
        Of what is random.
    """

    name: str = "usual"
    seed: int = 0
    without: tuple[str, ...] = field(default=(), init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "without", ("/imu/data", "/odom") if self.name == "bare" else ())

    @property
    def velocities(self) -> bool:
        """Whether joints have speeds."""
        return self.name != "positions"

    @property
    def signed(self) -> bool:
        """Whether speeds of joints tell the direction."""
        return self.name != "unsigned"

    def clocked(self, t: Array, arrives: Array) -> tuple[Array, Array]:
        """Times of joint states and of their arrival [s]."""
        if self.name != "jittery":
            return t, arrives
        rng = np.random.default_rng([self.seed, 1])
        step = float(np.median(np.diff(t)))
        t = np.sort(t + rng.normal(0.0, 0.25 * step, t.size))[rng.random(t.size) > 0.02]
        return t, np.maximum.accumulate(
            np.maximum(np.ceil(t / _PACKET_S) * _PACKET_S, t) + rng.exponential(0.003, t.size)
        )

    def sent(self, rows: Rows) -> Rows:
        """Commands that are sent."""
        if self.name != "changes":
            return rows
        kept: Rows = []
        for row in rows:
            if (
                not kept
                or repr(_twist_of(row[3])) != repr(_twist_of(kept[-1][3]))
                or row[0] - kept[-1][0] > _REPEATED_S
            ):
                kept.append(row)
        return kept

    def stamped(self, rows: Rows) -> Rows:
        """Messages with the clock that is set twice: forward, and back by less."""
        if self.name != "steps" or not rows:
            return rows
        rng = np.random.default_rng([self.seed, 2])
        last = max(r[0] for r in rows)
        sets = (
            (rng.uniform(0.2, 0.5) * last, rng.uniform(0.5, 3.0)),
            (rng.uniform(0.5, 0.8) * last, -rng.uniform(0.1, 0.5)),
        )
        out: Rows = []
        for t, topic, kind, message in sorted(rows, key=lambda r: r[0]):
            by = sum(shift for at, shift in sets if t > at)
            header = getattr(message, "header", None)
            if header is not None:
                stamp = header.stamp.sec * 10**9 + header.stamp.nanosec + round(by * 1e9)
                header.stamp.sec, header.stamp.nanosec = stamp // 10**9, stamp % 10**9
            out.append((t + by, topic, kind, message))
        return out


def _twist_of(message: Any) -> Any:
    return getattr(message, "twist", message)


USUAL = Habits()
