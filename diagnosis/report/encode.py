"""Time series as compressed text inside the page: quantised, differenced, split into byte planes, deflated.

The page's `data.js` reads what this writes. A level of 0 means that there is no sample, so a gap stays a gap.
Samples beyond ±1e30 count as missing.
"""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.report.encode_kernel import quantise, split_planes
from replay.arrays.quantiles import quantile_of

_LEVELS = 2**24
_HUGE, _TINY = 1e30, 1e-30
_RECORDED, _DERIVED = 1024, 512  # least steps within the range of a column without an LSB
_PROBE, _PROBES = 4096, 5
_BLOCK = 1 << 15
_NEARLY = 1.05
_ON_GRID = 0.1  # turns of the LSB; off its grid 0.25, and 0.06 where a result stores a quarter of it
_RUNS, _WORDS = (5, zlib.Z_RLE), (4, zlib.Z_DEFAULT_STRATEGY)


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
class Plan:
    """How a column is encoded: quantisation step, way of deflating, bytes per sample that it may take."""

    step: float
    way: tuple[int, int]
    rate: float


def plan_of(values: NDArray[np.floating], lsb: float | None, resolution: int = _RECORDED) -> Plan:
    """Try a few stretches of a column: differences deflate better by their runs or by their repeated words.

    Parameters
    ----------
    values : NDArray[np.floating], shape (n,)
        Column; NaN where there is no sample.
    lsb : float or None
        Smallest increment of the recorded signal, in the column's unit.
    resolution : int
        Steps within the range, at least, where there is none.
    """
    step, n = step_of(values, lsb, resolution), len(values)
    starts = range(0, n, max(_PROBE, n // _PROBES))
    probes = [levels_of(values[i : i + _PROBE], step)[0] for i in starts]
    raws = [_planes([p])[1] for p in probes]
    sizes = {way: sum(len(_deflated(r, way)) for r in raws) for way in (_RUNS, _WORDS)}
    way = _RUNS if sizes[_RUNS] <= _NEARLY * sizes[_WORDS] else _WORDS
    return Plan(step, way, 4 / 3 * sizes[way] / max(1, sum(len(p) for p in probes)))


def resolution_of(name: str) -> int:
    """Steps within the range of a column: values move by a 2048th of it at most, replayed ones and evidence by a 1024th."""
    return _DERIVED if name.startswith(("evidence.", "replay.")) else _RECORDED


def step_of(values: NDArray[np.floating], lsb: float | None, resolution: int = _RECORDED) -> float:
    """Quantisation step of a column: the sensor's LSB (half of it where values lie off its grid), else by range.

    Parameters
    ----------
    values : NDArray[np.floating], shape (n,)
        Column; NaN where there is no sample.
    lsb : float or None
        Smallest increment of the recorded signal, in the column's unit.
    resolution : int
        Steps within the range, at least, where there is none.
    """
    probe = values[:: max(1, len(values) // 20_000)].astype(np.float64)
    probe = probe[np.abs(probe) < _HUGE]
    if not len(probe):
        return 1.0
    if lsb is not None and _TINY < lsb < _HUGE:
        turns = probe / lsb
        step = lsb if np.mean(np.abs(turns - np.rint(turns))) < _ON_GRID else lsb / 2
    else:
        low, high = quantile_of(probe, [0.001, 0.999])
        extent = max(float(high - low) or float(np.abs(probe).max()) or 1.0, _TINY)
        exponent = math.floor(math.log10(extent / resolution))
        mantissa = extent / resolution / 10.0**exponent
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
        least, most = float(y.min()), float(y.max())
        if not -_HUGE < least <= most < _HUGE:  # not so where any is NaN
            good = np.abs(y) < _HUGE
            least, most = float(y.min(where=good, initial=_HUGE)), float(y.max(where=good, initial=-_HUGE))
        low, high = min(low, least), max(high, most)
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
        quantise(values[part].astype(np.float64), _HUGE, step, base, out[part])
    return out


def _planes(parts: Sequence[NDArray[np.int32]]) -> tuple[int, bytes]:
    """Bytes of the zigzag differences, lowest bytes of all first, and how many bytes a level takes."""
    out = [np.empty((4, len(p)), np.uint8) for p in parts]
    bits = max(split_planes(levels, rows, 0, 1) for levels, rows in zip(parts, out, strict=True))
    planes = max(1, (bits.bit_length() + 7) // 8)
    if planes > 1:
        for levels, rows in zip(parts, out, strict=True):
            split_planes(levels, rows, 1, planes)
    return planes, b"".join(rows[:planes].tobytes() for rows in out)


def _deflated(raw: bytes, way: tuple[int, int]) -> bytes:
    packer = zlib.compressobj(way[0], zlib.DEFLATED, zlib.MAX_WBITS, 9, way[1])
    return packer.compress(raw) + packer.flush()


def _segment(start: int, stride: int, parts: Sequence[NDArray[np.int32]], way: tuple[int, int]) -> Segment:
    planes, raw = _planes(parts)
    text = base64.b64encode(_deflated(raw, way)).decode("ascii")
    return Segment(start, len(parts[0]), stride, planes, text)


def _extremes(values: NDArray[np.floating], rows: int) -> NDArray[np.floating]:
    """Smallest, then largest value of every `rows` rows; NaN where there is none."""
    both = np.concatenate([_blockwise(f, values, rows) for f in (np.fmin, np.fmax)])
    if (np.abs(both) >= _HUGE).any() and (wrong := np.abs(values) >= _HUGE).any():
        return _extremes(np.where(wrong, np.nan, values), rows)
    return both


def _blockwise(extreme: np.ufunc, values: NDArray[np.floating], rows: int) -> NDArray[np.floating]:
    """`extreme` of every `rows` rows, of neighbours as far as they pair: many at once, where `reduceat` begins each block anew."""
    while rows % 2 == 0 and len(values) > 1:
        pairs = np.append(values, values[-1]) if len(values) % 2 else values
        values, rows = extreme(pairs[::2], pairs[1::2]), rows // 2
    return np.asarray(extreme.reduceat(values, np.arange(0, len(values), rows)))


def whole(name: str, values: NDArray[np.floating], plan: Plan) -> Channel:
    """Channel with every sample. `values` of shape (n,)."""
    levels, step, base = levels_of(values, plan.step)
    return Channel(name, step, base, (_segment(0, 1, [levels], plan.way),))


def reduced(name: str, values: NDArray[np.floating], plan: Plan, per: int, stride: int) -> Channel:
    """Channel with the extremes of every `stride` samples.

    Parameters
    ----------
    name : str
        Column.
    values : NDArray[np.floating], shape (n,)
        Samples, or two rows with the extremes of each `per` samples.
    plan : Plan
        From `plan_of`.
    per : int
        1 for samples; `stride` is a multiple of it.
    stride : int
        Samples per block.
    """
    both = _extremes(values, stride if per == 1 else 2 * stride // per)
    levels, step, base = levels_of(both, plan.step)
    return Channel(name, step, base, (_segment(0, stride, np.split(levels, 2), _WORDS),))


def with_pieces(channel: Channel, pieces: Sequence[tuple[int, NDArray[np.floating]]], plan: Plan) -> Channel:
    """Channel of extremes with every sample of some stretches (first sample and values) beside them.

    Values of shape (k,) each.
    """
    full = []
    for start, values in pieces:
        levels = _quantised(values, channel.step, channel.base)
        levels[(levels < 1) & (np.abs(values) < _HUGE)] = 1
        full.append(_segment(start, 1, [levels], plan.way))
    return replace(channel, segments=(*channel.segments, *full))
