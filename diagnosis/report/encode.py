"""Time series as compressed text inside the page: quantised, differenced, split into byte planes, deflated.

The page's `data.js` reads what this writes. A level of 0 means that there is no sample, so a gap stays a gap.
Samples beyond ±1e30 count as missing.
"""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

_LEVELS = 2**24
_HUGE, _TINY = 1e30, 1e-30
_RESOLUTION = 1024
_PROBE = 8192
_BLOCK = 1 << 15
_WORKERS = 4


@dataclass(frozen=True)
class Segment:
    """One stretch of a channel: every sample (`stride` 1), or the extremes of each block of `stride` samples.

    Attributes
    ----------
    start, count, stride : int
        First sample, number of samples or blocks, samples per block.
    planes : int
        Bytes per level.
    text : str
        Base64 of the deflated planes; for blocks all minima stand before all maxima.
    """

    start: int
    count: int
    stride: int
    planes: int
    text: str


@dataclass(frozen=True)
class Channel:
    """One column: value = (base + level)·step."""

    name: str
    step: float
    base: float
    segments: tuple[Segment, ...]

    @property
    def size(self) -> int:
        """Bytes in the page."""
        return sum(len(s.text) for s in self.segments)


@dataclass(frozen=True)
class Window:
    """Stretch of one fault that is wanted at full rate, in samples, with the columns that show it."""

    start: int
    stop: int
    columns: frozenset[str]


def step_of(values: NDArray[np.floating], lsb: float | None) -> float:
    """Quantisation step of a column: the sensor's LSB (half of it where values lie off its grid), else by range.

    Parameters
    ----------
    values : NDArray[np.floating], shape (n,)
        Column; NaN where there is no sample.
    lsb : float or None
        Smallest increment of the recorded signal, in the column's unit.
    """
    probe = values[:: max(1, len(values) // 20_000)].astype(np.float64)
    probe = probe[np.abs(probe) < _HUGE]
    if not len(probe):
        return 1.0
    if lsb is not None and _TINY < lsb < _HUGE:
        turns = probe / lsb
        step = lsb if np.mean(np.abs(turns - np.rint(turns))) < 0.05 else lsb / 2
    else:
        low, high = np.quantile(probe, [0.001, 0.999])
        extent = max(float(high - low) or float(np.abs(probe).max()) or 1.0, _TINY)
        exponent = math.floor(math.log10(extent / _RESOLUTION))
        mantissa = extent / _RESOLUTION / 10.0**exponent
        step = max(m for m in (1.0, 2.0, 5.0) if m <= mantissa + 1e-9) * 10.0**exponent
    return step


def levels_of(values: NDArray[np.floating], step: float) -> tuple[NDArray[np.int32], float, float]:
    """Quantise a column.

    Returns
    -------
    levels : NDArray[np.int32], shape (n,)
        0 where there is no sample.
    step, base : float
        value = (base + level)·step; the step grows where the range needs more than 2²⁴ levels.
    """
    low, high = _HUGE, -_HUGE
    for part in _blocks(len(values)):
        y = values[part]
        good = np.abs(y) < _HUGE
        low = min(low, float(y.min(where=good, initial=_HUGE)))
        high = max(high, float(y.max(where=good, initial=-_HUGE)))
    if low > high:
        return np.zeros(len(values), np.int32), step, 0.0
    step = max(step, (high - low) / _LEVELS, max(abs(low), abs(high)) * 1e-15)
    base = float(np.rint(low / step)) - 1.0
    return _quantised(values, step, base), step, base


def _blocks(size: int) -> Iterator[slice]:
    """Parts of a column that stay in the processor's cache."""
    return (slice(i, i + _BLOCK) for i in range(0, size, _BLOCK))


def _quantised(values: NDArray[np.floating], step: float, base: float) -> NDArray[np.int32]:
    out = np.empty(len(values), np.int32)
    for part in _blocks(len(values)):
        y = values[part].astype(np.float64)
        y[~(np.abs(y) < _HUGE)] = base * step
        y /= step
        np.rint(y, out=y)
        y -= base
        out[part] = y
    return out


def _zigzag(levels: NDArray[np.int32]) -> NDArray[np.uint32]:
    delta = np.empty_like(levels)
    delta[:1] = levels[:1]
    np.subtract(levels[1:], levels[:-1], out=delta[1:])
    return ((delta << 1) ^ (delta >> 31)).view(np.uint32)


def _segment(start: int, stride: int, parts: Sequence[NDArray[np.int32]]) -> Segment:
    coded = [_zigzag(p) for p in parts]
    top = max((int(c.max()) for c in coded if len(c)), default=0)
    planes = max(1, (top.bit_length() + 7) // 8)
    raw = b"".join(
        np.ascontiguousarray(c.astype("<u4").view(np.uint8).reshape(-1, 4).T[:planes]).tobytes() for c in coded
    )
    text = base64.b64encode(zlib.compress(raw, 5)).decode("ascii")
    return Segment(start, len(parts[0]), stride, planes, text)


def _extremes(levels: NDArray[np.int32], stride: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    count = -(-len(levels) // stride)
    padded = np.zeros(count * stride, np.int32)
    padded[: len(levels)] = levels
    blocks = padded.reshape(count, stride)
    low = np.where(blocks == 0, np.int32(2**31 - 1), blocks).min(axis=1)
    high = blocks.max(axis=1)
    return np.where(high == 0, np.int32(0), low), high


def _full_size(values: NDArray[np.floating], step: float) -> float:
    """Bytes per sample in the page, estimated from a few stretches."""
    n = len(values)
    starts = range(0, n, max(_PROBE, n // 6))
    probes = [levels_of(values[i : i + _PROBE], step)[0] for i in starts]
    return sum(len(_segment(0, 1, [p]).text) for p in probes) / max(1, sum(len(p) for p in probes))


def _merged(windows: Iterable[Window], column: str) -> list[tuple[int, int]]:
    spans: list[tuple[int, int]] = []
    for w in sorted((w.start, w.stop) for w in windows if column in w.columns):
        if spans and w[0] <= spans[-1][1]:
            spans[-1] = (spans[-1][0], max(spans[-1][1], w[1]))
        else:
            spans.append(w)
    return spans


def _encode_one(name: str, values: NDArray[np.floating], step: float, stride: int) -> Channel:
    levels, step, base = levels_of(values, step)
    parts = [levels] if stride == 1 else _extremes(levels, stride)
    return Channel(name, step, base, (_segment(0, stride, parts),))


def _with_windows(channel: Channel, values: NDArray[np.floating], spans: Sequence[tuple[int, int]]) -> Channel:
    """Channel of extremes with every sample of some stretches beside them."""
    full = [_segment(a, 1, [_quantised(values[a:b], channel.step, channel.base)]) for a, b in spans if b > a]
    return replace(channel, segments=(*channel.segments, *full))


def windows_of(
    faults: Sequence[tuple[float, float, frozenset[str]]], pad_s: float, step_s: float, samples: int
) -> list[Window]:
    """Stretches around onset and end of each fault (start [s], stop [s], columns), `pad_s` [s] on either side."""
    windows = []
    for start, stop, columns in faults:
        edges = [(start, stop)] if stop - start <= 4 * pad_s else [(start, start), (stop, stop)]
        for a, b in edges:
            first, last = int((a - pad_s) / step_s), int((b + pad_s) / step_s) + 1
            windows.append(Window(max(0, first), min(samples, last), columns))
    return windows


def encode(
    columns: Mapping[str, NDArray[np.floating]],
    lsb: Mapping[str, float],
    faults: Sequence[tuple[float, float, frozenset[str]]],
    step_s: float,
    budget: int,
) -> list[Channel]:
    """Encode columns: every sample where that fits the budget, else extremes with full rate around faults.

    Parameters
    ----------
    columns : Mapping[str, NDArray[np.floating]], each of shape (n,)
        Columns to show.
    lsb : Mapping[str, float]
        Smallest increments of recorded columns, in their units.
    faults : Sequence[tuple[float, float, frozenset[str]]]
        Start [s] and stop [s] after the first sample, and the columns that show the fault; worst first.
    step_s : float
        Sample time [s].
    budget : int
        Bytes that the encoded columns may take together.
    """
    if not columns:
        return []
    steps = {name: step_of(values, lsb.get(name)) for name, values in columns.items()}
    samples = max(len(v) for v in columns.values())
    with ThreadPoolExecutor(_WORKERS) as pool:

        def run(stride: int) -> list[Channel]:
            return list(pool.map(lambda c: _encode_one(c, columns[c], steps[c], stride), columns))

        rates = dict(zip(columns, pool.map(lambda c: _full_size(columns[c], steps[c]), columns), strict=True))
        if sum(rates.values()) * samples <= budget:
            channels = run(1)
            if sum(c.size for c in channels) <= budget:
                return channels
        stride = 64
        while samples // stride > 32_768:
            stride *= 2
        while True:
            channels = run(stride)
            left = budget - sum(c.size for c in channels)
            if left >= 0 or samples // stride <= 1024:
                break
            stride *= 2
        chosen = _affordable(columns, rates, faults, step_s, samples, left)
        return [_with_windows(c, columns[c.name], _merged(chosen, c.name)) for c in channels]


def _affordable(
    columns: Mapping[str, NDArray[np.floating]],
    rates: Mapping[str, float],
    faults: Sequence[tuple[float, float, frozenset[str]]],
    step_s: float,
    samples: int,
    budget: float,
) -> list[Window]:
    """Widest windows around as many faults, worst first, as the budget [bytes] pays for."""
    count = len(faults)
    while count:
        for pad in (20.0, 10.0, 5.0, 2.0, 1.0):
            windows = windows_of(faults[:count], pad, step_s, samples)
            cost = sum(rates[c] * sum(b - a for a, b in _merged(windows, c)) for c in columns)
            if cost <= 0.9 * budget:
                return windows
        count //= 2
    return []
