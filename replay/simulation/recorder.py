"""What a recorder does to a log: stamps that are late, rows that are lost."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from replay.simulation.options import SimulationOptions, SlowGroup, channel_group


def recorded_stamps(options: SimulationOptions, rng: np.random.Generator) -> NDArray[np.int64]:
    """Stamps [ns], shape (n,), increasing: a uniform grid, each stamp but the first late by up to a share of the step.

    Whole microseconds, which every format can hold exactly.
    """
    grid = np.arange(options.samples) * (1e6 / options.rate_hz)
    if options.jitter > 0.0:
        grid[1:] += rng.uniform(0.0, options.jitter * 1e6 / options.rate_hz, grid.size - 1)
    stamps: NDArray[np.int64] = options.start_ns + np.rint(grid).astype(np.int64) * 1000
    return stamps


def kept_rows(
    options: SimulationOptions, names: Iterable[str], rng: np.random.Generator
) -> dict[str, NDArray[np.bool_]]:
    """Rows that were recorded by group of channels, each of shape (n,); empty where nothing is lost."""
    if options.drop_share <= 0.0:
        return {}
    groups = sorted({channel_group(name) for name in names})
    return {group: _kept(options.samples, options, options.rate_hz, rng) for group in groups}


def thinned(
    options: SimulationOptions, groups: tuple[SlowGroup, ...], rng: np.random.Generator
) -> tuple[SlowGroup, ...]:
    """Slow groups without the rows that were lost."""
    if options.drop_share <= 0.0:
        return groups
    duration = options.samples / options.rate_hz
    out = []
    for group in groups:
        kept = _kept(group.stamps.size, options, group.stamps.size / duration, rng)
        out.append(SlowGroup(group.name, group.stamps[kept], {n: x[kept] for n, x in group.columns.items()}))
    return tuple(out)


def _kept(size: int, options: SimulationOptions, rate: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Losses begin anywhere and last geometrically many rows; the first and the last row stay."""
    length = max(1.0, options.drop_burst_s * rate)
    # Losses may overlap: a row stays with probability exp(−count·length/size).
    count = rng.poisson(-np.log1p(-options.drop_share) * size / length)
    start = rng.integers(0, size, count)
    stop = np.minimum(start + rng.geometric(1.0 / length, count), size)
    steps = np.bincount(start, minlength=size + 1) - np.bincount(stop, minlength=size + 1)
    kept: NDArray[np.bool_] = np.cumsum(steps)[:size] == 0
    kept[0] = kept[-1] = True
    return kept
