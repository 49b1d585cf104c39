"""A signal among those of its source: whether its siblings live, and a channel paired with its reference."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.pairs import Pair
from replay.faults import Side
from replay.machine import Machine, Noise
from replay.timeline import Timeline


def alive_sources(timeline: Timeline) -> dict[str, NDArray[np.int16]]:
    """Number of signals of each source that bring a new sample at each step."""
    out: dict[str, NDArray[np.int16]] = {}
    for name, fresh in timeline.fresh.items():
        count = out.setdefault(timeline.sources[name], np.zeros(timeline.size, dtype=np.int16))
        count += fresh
    return out


def alive(timeline: Timeline, counts: dict[str, NDArray[np.int16]], name: str) -> NDArray[np.bool_]:
    """Whether another signal of the same source brings a new sample at each step."""
    return (counts[timeline.sources[name]] - timeline.fresh[name]) > 0


def make_pair(
    timeline: Timeline,
    counts: dict[str, NDArray[np.int16]],
    side: Side,
    y_name: str,
    x_name: str,
    quiet: NDArray[np.bool_],
    unit: str,
    span: float,
    machine: Machine,
) -> Pair:
    """Channel and reference of one component and side."""
    y, x = timeline.signals[y_name], timeline.signals[x_name]
    largest = float(np.nanmax(np.abs(np.concatenate((y, x))), initial=0.0)) if np.isfinite(y).any() else 0.0
    return Pair(
        side=side,
        y=y,
        x=x,
        fresh=timeline.fresh[y_name],
        alive=alive(timeline, counts, y_name),
        quiet=quiet,
        dt=timeline.dt,
        unit=unit,
        span=max(span, largest),
        y_name=y_name,
        x_name=x_name,
        known_noise=machine.noise.get(y_name, Noise()),
    )
