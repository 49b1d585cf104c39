"""One uniform time axis for all signals; a lost sample stays lost.

The axis has the step of the fastest wheel signal. A signal's value at a step is its latest sample, as long as that
is not older than the signal's own holding time (of commands that are published on change: `replay.signals.publishing`);
after that it is NaN. `fresh` marks the steps in which a new sample arrived, so that estimators count each sample once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks, release
from replay.arrays.column_store import ColumnStore
from replay.arrays.quantiles import median_of
from replay.errors import LogError
from replay.log.empty_log import without_numbers
from replay.signals.holding import LARGEST, breaks, held, usual_hold
from replay.signals.publishing import Standing, standing_commands
from replay.signals.signal import Signals

State = TypeVar("State")

MAX_STEPS = 200_000_000
_BUNCH = 32  # messages that may come at once
_STANDARD_NS = np.array([1, 2, 4, 5, 8, 10, 20, 25, 40, 50, 100, 200, 500, 1000], dtype=np.int64) * 1_000_000


@dataclass(frozen=True)
class Timeline:
    """Signals on one uniform axis.

    Attributes
    ----------
    start_ns, step_ns : int
        First step and distance of steps, nanoseconds since 1970.
    size : int
        Number of steps n.
    signals : Mapping[str, NDArray[np.float64]], each of shape (n,)
        SI values; NaN where no sample is valid.
    fresh : Mapping[str, NDArray[np.bool_]], each of shape (n,)
        Whether a new sample arrived in the step.
    sources : Mapping[str, str]
        File of each signal.
    periods_ns : Mapping[str, int]
        Median sample period of each signal.
    notes : tuple[str, ...]
        What was unusual, one sentence each.
    open_loop : bool
        As in `Signals`.
    groups : Mapping[str, str]
        `Signal.group` of each signal; empty: those of one file are one group.
    stands : Mapping[str, float]
        Commands that are published on change, whose values are known between their samples too: for how long at most [s].
    store : ColumnStore
        Where long columns stand.
    """

    start_ns: int
    step_ns: int
    size: int
    signals: Mapping[str, NDArray[np.float64]]
    fresh: Mapping[str, NDArray[np.bool_]]
    sources: Mapping[str, str]
    periods_ns: Mapping[str, int]
    notes: tuple[str, ...] = ()
    open_loop: bool = False
    groups: Mapping[str, str] = field(default_factory=dict)
    stands: Mapping[str, float] = field(default_factory=dict)
    store: ColumnStore = field(default_factory=ColumnStore, repr=False, compare=False)
    _beside: dict[tuple[str, ...], NDArray[np.float64]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def dt(self) -> float:
        """Step [s]."""
        return self.step_ns * 1e-9

    @property
    def t(self) -> NDArray[np.float64]:
        """Mission time of each step [s]. Shape (n,)."""
        return np.asarray(np.arange(self.size) * self.dt, dtype=np.float64)

    def get(self, name: str) -> NDArray[np.float64] | None:
        """Values of a signal, or None where it is not in the log. Shape (n,), SI."""
        return self.signals.get(name)

    def beside(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Signals side by side, shape (n, names), kept for the next who asks; NaN columns for what is not logged."""
        key = tuple(names)
        if not any(name in self.signals for name in key):
            return np.broadcast_to(np.nan, (self.size, len(key)))
        if key not in self._beside:
            nothing = np.broadcast_to(np.nan, (self.size,))
            self._beside[key] = self.store.beside([self.signals.get(name, nothing) for name in key])
        return self._beside[key]

    def blocks(self, multiple: int = 1) -> Iterator[slice]:
        """Steps in blocks; see `ColumnStore.blocks`."""
        return self.store.blocks(self.size, multiple)

    def map(self, function: Callable[..., NDArray[Any]], *columns: NDArray[Any]) -> NDArray[Any]:
        """Apply a function of whole rows block by block; see `ColumnStore.map`.

        Columns of shape (n, …), as the result.
        """
        return self.store.map(function, *columns)

    def scan(
        self,
        kernel: Callable[..., tuple[tuple[NDArray[Any], ...], State]],
        state: State,
        *columns: NDArray[Any],
        multiple: int = 1,
    ) -> tuple[tuple[NDArray[Any], ...], State]:
        """Run a recursion block by block with its state carried; see `ColumnStore.scan`.

        Columns of shape (n, …), as the results.
        """
        return self.store.scan(kernel, state, *columns, multiple=multiple)


def median_period(stamps: NDArray[np.int64]) -> int:
    """Median distance of stamps [ns]; of stamps in bunches, half of the distance on the whole. Stamps of shape (n,); 0 for fewer than two."""
    if stamps.size < 2:
        return 0
    median = int(median_of(np.diff(stamps)))
    if stamps.size <= 2 * _BUNCH:
        return median
    return max(median, int(median_of(stamps[_BUNCH:] - stamps[:-_BUNCH])) // (2 * _BUNCH))


class _Periods:
    """Median periods, found once for signals that share their stamps or have the same ones."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, int], int] = {}
        self._seen: list[tuple[NDArray[np.int64], int]] = []

    def of(self, stamps: NDArray[np.int64]) -> int:
        key = (stamps.__array_interface__["data"][0], stamps.size)
        if key not in self._known:
            period = next((period for other, period in self._seen if _same(stamps, other)), None)
            if period is None:
                period = median_period(stamps)
                self._seen.append((stamps, period))
            self._known[key] = period
            release(stamps)
        return self._known[key]


def _same(a: NDArray[np.int64], b: NDArray[np.int64]) -> bool:
    return a.size == b.size and all(np.array_equal(a[part], b[part]) for part in blocks(a.size))


def align(signals: Signals, start_s: float | None = None, stop_s: float | None = None) -> Timeline:
    """Put signals on one uniform axis.

    Parameters
    ----------
    signals : Signals
        At their own stamps.
    start_s, stop_s : float or None
        Part of the mission [s from its first wheel sample]; None: from the start, to the end.

    Raises
    ------
    LogError
        Where no wheel signal has two samples, sources do not overlap in time, or the asked part is empty.
    """
    wheel = {k: s for k, s in signals.items.items() if k.startswith("wheel.") and s.stamps.size > 1}
    if not wheel and signals.named_elsewhere:
        raise LogError(f"no wheel signal with at least two samples was found; {signals.named_elsewhere}")
    if not wheel and (empty := without_numbers(signals.missing, ["wheel."])):
        raise LogError(f"no speed of a wheel has two samples: {empty}")
    if not wheel:
        raise LogError(
            "no wheel signal with at least two samples was found; `mfhca channels LOG --all` lists what the log holds: where wheels or odometry "
            "are among it, `mfhca config init --log LOG -o machine.toml` writes a machine file for them (then -m machine.toml); where none are, "
            "record /joint_states or odometry as well"
        )
    notes = list(check_overlap(signals))
    periods = _Periods()
    step = _snap(min(periods.of(s.stamps) for s in wheel.values()))
    first = min(int(s.stamps[0]) for s in wheel.values())
    last = max(int(s.stamps[-1]) for s in wheel.values())
    start = first if start_s is None else first + round(start_s * 1e9 / step) * step
    stop = last if stop_s is None else min(last, first + round(stop_s * 1e9))
    size = (stop - start) // step + 1
    if size < 2:
        raise LogError(f"the asked part of the mission is empty: the log lasts {(last - first) * 1e-9:.3f} s")
    if size > MAX_STEPS:
        raise LogError(
            f"stamps span {(last - first) * 1e-9:.0f} s in steps of {step * 1e-6:g} ms: more than {MAX_STEPS} steps; "
            'the clock probably jumps: choose another one (under [sources] "*" = { stamp = "log" }) or a part (--start, --end)'
        )
    values: dict[str, NDArray[np.float64]] = {}
    fresh: dict[str, NDArray[np.bool_]] = {}
    known = {name: signal for name, signal in signals.items.items() if signal.stamps.size}
    usual = {name: usual_hold(name, periods.of(signal.stamps), step) for name, signal in known.items()}
    standing = standing_commands(known, usual)
    notes += [s.note for s in standing.values()]
    paused: NDArray[np.int64] | None = None
    for name in sorted(known, key=standing.__contains__):
        signal = known[name]
        absurd = sum(np.count_nonzero(np.abs(signal.values[part]) > LARGEST) for part in blocks(signal.values.size))
        if absurd:
            notes.append(f"{name}: {absurd} values that are infinite or beyond a billion count as no sample.")
        how = standing.get(name, Standing(usual[name], np.empty(0, np.int64)))
        if np.isinf(how.hold_ns):
            if paused is None:
                paused = breaks([f for n, f in fresh.items() if n not in standing], start, step, signals.store)
            how = replace(how, ends_ns=np.sort(np.r_[how.ends_ns, paused]))
        values[name], fresh[name] = held(signal, how, start, step, size, signals.store)
        release(signal.stamps, signal.values, values[name])
    return Timeline(
        start_ns=start,
        step_ns=step,
        size=size,
        signals={name: values[name] for name in known},
        fresh={name: fresh[name] for name in known},
        sources={k: s.source for k, s in signals.items.items()},
        periods_ns={k: periods.of(s.stamps) for k, s in signals.items.items()},
        notes=tuple(notes),
        open_loop=signals.open_loop,
        groups={k: s.group for k, s in signals.items.items()},
        stands={name: how.longest_s for name, how in standing.items()},
        store=signals.store,
    )


def _snap(period: int) -> int:
    """Round a measured period to a usual one within 2 %, else to whole microseconds."""
    near = _STANDARD_NS[np.argmin(np.abs(_STANDARD_NS - period))]
    if abs(int(near) - period) <= 0.02 * period:
        return int(near)
    return max(1000, round(period / 1000) * 1000)


def check_overlap(signals: Signals) -> list[str]:
    """Refuse sources whose stamps do not overlap; say where they barely do.

    Raises
    ------
    LogError
        Where the files of one mission share no time.
    """
    spans: dict[str, tuple[int, int]] = {}
    for s in signals.items.values():
        if s.stamps.size:
            a, b = spans.get(s.source, (int(s.stamps[0]), int(s.stamps[-1])))
            spans[s.source] = (min(a, int(s.stamps[0])), max(b, int(s.stamps[-1])))
    if len(spans) < 2:
        return []
    begin = max(a for a, _ in spans.values())
    end = min(b for _, b in spans.values())
    if end <= begin:
        shown = "; ".join(
            f"{src}: {np.datetime64(a, 'ns')} to {np.datetime64(b, 'ns')}" for src, (a, b) in spans.items()
        )
        raise LogError(
            f"the files do not overlap in time, so they are not one mission or their clocks are unrelated ({shown}); "
            "diagnose them one by one, or set the table's epoch or clock_offset in the machine file's [sources]"
        )
    shortest = min(b - a for a, b in spans.values())
    if end - begin < 0.5 * shortest:
        return [
            f"The files overlap for {(end - begin) * 1e-9:.1f} s only, of {shortest * 1e-9:.1f} s that the shortest "
            "lasts: their stamps may be unrelated."
        ]
    return []
