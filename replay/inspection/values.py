"""Samples that hold no usable number: empty cells and NaN, infinite and absurdly large values."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.inspection.report import OddValues
from replay.log.raw_log import Channel

ABSURD = 1e9
BEYOND_ALL = 1e19
GAP_PERIODS = 5.0


def odd_values(channels: Iterable[Channel]) -> tuple[OddValues, ...]:
    """Find channels of one topic whose samples hold no usable number; alike ones together.

    Values beyond `ABSURD` are reported where most of the channel lies below it (stamps and counters do not), or where they
    are beyond what 64 bits count. A column that is filled in every n-th row only is not reported.

    Parameters
    ----------
    channels : Iterable[Channel]
        Of one topic or table.
    """
    alike: dict[OddValues, list[str]] = {}
    for channel in channels:
        if channel.values.dtype.kind == "f" and len(channel.values):
            found = _of_channel(channel.stamps, channel.values)
            if found.missing or found.infinite or found.absurd:
                alike.setdefault(found, []).append(channel.name)
    return tuple(replace(found, channels=tuple(names)) for found, names in alike.items())


def _of_channel(stamps: NDArray[np.int64], values: NDArray[Any]) -> OddValues:
    edges: list[NDArray[np.int64]] = []
    missing = infinite = absurd = 0
    largest, before = 0.0, False
    for rows in blocks(len(values)):
        part = values[rows]
        empty = np.isnan(part)
        size = np.abs(part)
        infinite += int(np.isinf(part).sum())
        large = (size > ABSURD) & (size < np.inf)
        absurd += int(large.sum())
        largest = max(largest, float(size[large].max(initial=0.0)))
        missing += int(empty.sum())
        edges.append(np.flatnonzero(np.diff(empty, prepend=before)) + rows.start)
        before = bool(empty[-1])
    if missing == len(values):
        return OddValues((), len(values), missing)
    if absurd > 0.5 * (len(values) - missing) and largest < BEYOND_ALL:
        absurd = 0
    longest, at = _longest(stamps, np.concatenate(edges), missing)
    if missing and not longest:
        missing = 0
    return OddValues((), len(values), missing, longest, at, infinite, absurd, largest if absurd else 0.0)


def _longest(stamps: NDArray[np.int64], edges: NDArray[np.int64], missing: int) -> tuple[float, float]:
    """Longest stretch between numbers with empty samples between, and its start [s]; zeros where every n-th is filled."""
    if not missing:
        return 0.0, 0.0
    last = len(stamps) - 1
    starts, stops = edges[::2], edges[1::2]
    if len(stops) < len(starts):
        stops = np.append(stops, last)
    starts = np.maximum(starts - 1, 0)
    lengths = np.maximum(stamps[stops] - stamps[starts], 0)
    k = int(np.argmax(lengths))
    sparse = missing > 0.5 * len(stamps) and lengths[k] <= GAP_PERIODS * float(np.median(lengths))
    if sparse and len(lengths) > 2:
        return 0.0, 0.0
    return float(lengths[k]) / 1e9, float(stamps[starts[k]] - stamps[0]) / 1e9
