"""A mission in cells of a tenth of a second, and what moves in windows of three: enough to see what a fault leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.clearing import after_s
from replay.arrays.blocks import blocks, framed, release
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
_T = TypeVar("_T")

CELL_S = 0.1
WINDOW_S = 3.0  # a fault of the size that counts, for this long, must show
HOP_S = 0.5
_MOSTLY = 0.3  # of the windows
_LEAST_SHARE = 0.6  # of a window's cells that must be known


@dataclass(frozen=True)
class Cells:
    """Channels of a mission by cells.

    Attributes
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    stated : Mapping[str, Sequence[tuple[float, float]]]
        When a fault of a component is stated, by component [s].
    carried : Mapping[str, float]
        Share of its speed that the ground gives a wheel whose valve is dead, by wheel, as far as a model of the mission says it [1].
    may_carry : float
        What it may give every wheel all the same [1].
    """

    timeline: Timeline
    replay: Replay
    machine: Machine
    stated: Mapping[str, Sequence[tuple[float, float]]] = field(default_factory=dict)
    carried: Mapping[str, float] = field(default_factory=dict)
    may_carry: float = 0.0
    _kept: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def width(self) -> int:
        """Samples in a cell."""
        return max(1, round(CELL_S / self.timeline.dt))

    @property
    def dt(self) -> float:
        """Length of a cell [s]."""
        return self.width * self.timeline.dt

    @property
    def size(self) -> int:
        """Number of cells."""
        return -(-self.timeline.size // self.width)

    @cached_property
    def frame(self) -> Frame:
        """Windows of `WINDOW_S`."""
        return Frame(self.size, max(1, round(WINDOW_S / self.dt)), max(1, round(HOP_S / self.dt)))

    def explained(self, component: str, frame: Frame | None = None, *, after: bool = False) -> NDArray[np.bool_]:
        """Windows, of `frame` if given, in which a fault of the component is stated anyhow, or `after` it still shows, shape (windows,)."""
        frame = frame or self.frame
        starts = frame.starts * self.dt
        stops = starts + frame.length * self.dt
        out = np.zeros(starts.size, dtype=np.bool_)
        for a, b in self.stated.get(component, ()):
            out |= (stops > a) & (starts < b + (after_s(a, b) if after else 0.0))
        return out

    def told(self, component: str) -> NDArray[np.bool_]:
        """Cells in which a fault of the component is stated, and those beside them, shape (cells,)."""
        out = np.zeros(self.size, dtype=np.bool_)
        for a, b in self.stated.get(component, ()):
            out[max(0, int(a / self.dt) - 1) : int(np.ceil(b / self.dt)) + 1] = True
        return out

    def apart(self, component: str) -> NDArray[np.bool_]:
        """Cells outside the stated faults of the component and of what they leave, shape (cells,).

        All cells where faults are stated for so long that hardly anything would be left to ask.
        """
        out = np.ones(self.size, dtype=np.bool_)
        for a, b in () if self.mostly_explained(component) else self.stated.get(component, ()):
            out[max(0, int(a / self.dt) - 1) : int(np.ceil((b + after_s(a, b)) / self.dt)) + 1] = False
        return out

    def mostly_explained(self, component: str) -> bool:
        """Whether faults of the component are stated for so long that its usual behaviour is theirs."""
        return bool(self.explained(component).mean() > _MOSTLY)

    def once(self, what: str, found: Callable[[], _T]) -> _T:
        """What `found` gives, computed once for a mission, whatever is stated of it; `what` names it, and no signal."""
        if what not in self._kept:
            self._kept[what] = found()
        kept: _T = self._kept[what]
        return kept

    def once_beside(self, what: str, found: Callable[[], _T]) -> _T:
        """The same of what depends on what is stated: computed once for all that state the same faults."""
        return self.once(f"{what} beside {self.stated}, {self.carried}, {self.may_carry}", found)

    def means(self, name: str) -> Array:
        """Mean of a signal in each cell; NaN where it has no value. Shape (cells,)."""

        def means() -> Array:
            found = self.timeline.get(name)
            return np.full(self.size, np.nan) if found is None else self.of(found)

        return self.once(name, means)

    def of(self, x: Array) -> Array:
        """The same of any column of the timeline, shape (cells, …)."""
        means = np.concatenate([_means(x[part], self.width) for part in blocks(len(x), self.width)])
        release(x)
        return means

    @property
    def carried_shares(self) -> list[float]:
        """Share of its speed that the ground gives each wheel [1], 0 where nothing says so."""
        return [self.carried.get(wheel, 0.0) for wheel in self.machine.wheels]

    @property
    def ahead(self) -> list[float] | None:
        """Where each wheel is along the machine [m]; None without geometry."""
        geometry = self.machine.geometry
        return None if geometry is None else [geometry.wheels[wheel].x for wheel in self.machine.wheels]

    @property
    def driven(self) -> list[int]:
        """Places of the wheels with a drive among the machine's wheels."""
        return [i for i, wheel in enumerate(self.machine.wheels) if wheel not in self.machine.unpowered]

    @property
    def reference(self) -> Array:
        """Commanded speed of every wheel, shape (cells, wheels)."""
        return self.once("reference", lambda: self.of(self.replay.v_ref))

    def wheels(self, leaf: str) -> Array:
        """A signal of every wheel, shape (cells, wheels)."""
        return np.column_stack([self.means(f"wheel.{w}.{leaf}") for w in self.machine.wheels])

    def axles(self, leaf: str) -> Array:
        """A signal of every steering axle, shape (cells, axles)."""
        columns = [self.means(f"steer.{a}.{leaf}") for a in self.machine.axles]
        return np.column_stack(columns) if columns else np.zeros((self.size, 0))


def _means(x: Array, width: int) -> Array:
    cut = framed(x, width)
    if np.isfinite(total := cut.sum(axis=1)).all():  # so is every sample
        return np.asarray(total / width)
    known = np.isfinite(cut)
    count = known.sum(axis=1)
    return np.asarray(np.where(count > 0, np.where(known, cut, 0.0).sum(axis=1) / np.maximum(count, 1), np.nan))


@dataclass(frozen=True)
class Frame:
    """Windows over cells: `length` cells each, one every `hop` cells.

    Attributes
    ----------
    cells, length, hop : int
        Cells of the mission, of a window, and from window to window.
    """

    cells: int
    length: int
    hop: int

    @property
    def starts(self) -> NDArray[np.intp]:
        """First cell of each window; one window where the mission is shorter than it. Shape (windows,)."""
        return np.arange(0, max(self.cells - self.length, 0) + 1, self.hop)

    def sums(self, x: Array) -> Array:
        """Sum over each window of what is known, shape (windows, …)."""
        return self._sums(x if np.isfinite(x).all() else np.nan_to_num(x))

    def _sums(self, x: Array) -> Array:
        total = np.concatenate([np.zeros((1, *x.shape[1:])), np.cumsum(x, axis=0)])
        stops = np.minimum(self.starts + self.length, self.cells)
        return np.asarray(total[stops] - total[self.starts])

    def mean(self, x: Array) -> Array:
        """Mean over each window; NaN where less than most of it is known. Shape (windows, …).

        `x` has shape (cells, …), its unit is kept.
        """
        count = self._sums(np.isfinite(x).astype(np.float64))
        enough = count >= _LEAST_SHARE * min(self.length, self.cells)
        return np.asarray(np.where(enough, self.sums(x) / np.maximum(count, 1), np.nan))

    def rms(self, x: Array) -> Array:
        """Root mean square over each window, as `mean`. From shape (cells, …) to (windows, …), in the unit of x."""
        return np.asarray(np.sqrt(self.mean(x**2)))
