"""How the body moves by its wheels: the shape in time that slow sensors of the body are compared with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CELL_S = 0.1  # step in which sensors of the body are filtered [s]


@dataclass(frozen=True)
class Rolling:
    """The body by its wheels, in n blocks.

    Attributes
    ----------
    dt : float
        Length of a block [s].
    by_wheel : Array, shape (n, wheels)
        Forward speed of the body by each wheel's sensor [m/s]; NaN where unknown.
    command : Array, shape (n,)
        The same as commanded [m/s]; NaN where unknown.
    curvature, lateral : Array, shape (n,)
        Yaw rate [1/m] and side slip [1] per forward speed, by the steering angles.
    top : float
        Largest speed of the machine [m/s].
    """

    dt: float
    by_wheel: Array
    command: Array
    curvature: Array
    lateral: Array
    top: float

    @property
    def size(self) -> int:
        """Number of blocks."""
        return int(self.command.size)

    @cached_property
    def voters(self) -> Array:
        """Speeds by the wheels and by the command [m/s], shape (n, wheels + 1)."""
        return np.column_stack([self.by_wheel, self.command])

    @cached_property
    def speed(self) -> Array:
        """Median of wheels and command [m/s], shape (n,); 0 where nothing is known."""
        known = np.isfinite(self.voters)
        ordered, count = np.sort(np.where(known, self.voters, np.inf), axis=1), known.sum(axis=1)
        rows = np.arange(self.size)
        low = ordered[rows, np.maximum((count - 1) // 2, 0)]
        high = ordered[rows, np.minimum(count // 2, ordered.shape[1] - 1)]
        return np.asarray(np.where(count > 0, (low + high) / 2, 0.0))

    @cached_property
    def track_speed(self) -> Array:
        """The same along the body's track, which side slip makes longer [m/s], shape (n,)."""
        return np.asarray(self.speed * self.stretch)

    @cached_property
    def stretch(self) -> Array:
        """Speed over ground per forward speed [1], shape (n,)."""
        return np.asarray(np.hypot(1.0, self.lateral))

    @cached_property
    def spread(self) -> Array:
        """How far wheels and command are from the common speed, the odd one left out [m/s], shape (n,)."""
        far = np.abs(self.voters - self.speed[:, None])
        ordered = np.sort(np.where(np.isfinite(far), far, 0.0), axis=1)
        return np.asarray(ordered[:, -2] if ordered.shape[1] > 2 else ordered[:, -1])

    @cached_property
    def edges(self) -> Array:
        """Times of the blocks' edges [s], shape (n + 1,)."""
        return np.asarray(np.arange(self.size + 1) * self.dt)

    @cached_property
    def way(self) -> Array:
        """Way along the track at the blocks' edges [m], shape (n + 1,)."""
        return integral(self.track_speed, self.dt)

    @cached_property
    def cells(self) -> Array:
        """Times at which sensors are filtered [s]. Shape (cells,)."""
        return np.asarray(np.arange(int(self.size * self.dt / CELL_S) + 1) * CELL_S)

    def cell_of(self, t: Array) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Nearest cell of each time, and which of them lie within the mission. All of the shape (k,) of `t` [s]."""
        cell = np.rint(t / CELL_S).astype(np.int64)
        return cell, np.asarray((cell >= 0) & (cell < self.cells.size))

    def at_cells(self, values: Array) -> Array:
        """Values of blocks at the cells. From shape (n,) to (cells,)."""
        return np.asarray(np.interp(self.cells, self.edges[:-1] + self.dt / 2, values))

    def per_block(self, values: Array) -> Array:
        """Values of cells for every block. From shape (cells,) to (n,)."""
        return np.asarray(np.interp(self.edges[:-1] + self.dt / 2, self.cells, values))

    def heading(self, yaw_rate: Array | None) -> Array:
        """Heading at the blocks' edges, from a measured yaw rate or from the steering [rad], shape (n + 1,).

        Parameters
        ----------
        yaw_rate : Array, shape (n,), or None
            Measured [rad/s]; NaN where unknown.
        """
        steered = self.curvature * self.speed
        rate = steered if yaw_rate is None else np.where(np.isfinite(yaw_rate), yaw_rate, steered)
        return integral(np.nan_to_num(rate), self.dt)


def integral(values: Array, dt: float) -> Array:
    """Sum of values of blocks up to each edge, shape (n + 1,). `dt` is a block's length [s]."""
    return np.concatenate([[0.0], np.cumsum(values) * dt])
