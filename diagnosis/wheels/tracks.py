"""From frames to segments of one row: what the trees say of each frame, followed through the mission for both sides of a wheel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from itertools import compress, pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.models import A_BIAS, A_GAIN, A_NONE, A_STUCK, S_GAIN, S_NONE, S_STUCK, S_WHITE_8, Row
from diagnosis.wheels.runs import Runs
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

#: Modes by the trees' class, behind healthy.
MODES = (FaultMode.STUCK, FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT, FaultMode.NOISY)
#: Model of the Kalman filters that stands for a mode of a side.
MODEL_OF: dict[Row, int] = {
    **{(Side.SENSOR, mode): m for mode, m in zip(MODES, (S_STUCK, S_NONE, S_GAIN, S_WHITE_8), strict=True)},
    **{(Side.ACTUATOR, mode): m for mode, m in zip(MODES, (A_STUCK, A_NONE, A_GAIN, A_BIAS), strict=True)},
}

_AROUND_S = 0.4  # on either side, over which what is said of frames is averaged
_SHARPER = 1.0  # what agreement over that time adds: nothing, by machines that were held out of the training
_FAULTY = 0.5
_DOUBTED, _BRIDGED_S = 0.8, 3.0  # a shorter time in which a side is not healthier than this is no end of its fault
_SHORT_S = 1.0  # a row that holds for less than this within a fault is that of its neighbour
_NEAR_S = 0.6  # within which an edge of the Kalman models' path is the segment's


@dataclass(frozen=True)
class Track:
    """One wheel, frame by frame.

    Attributes
    ----------
    hop : int
        Blocks from frame to frame.
    probability : dict[Side, Array], each of shape (frames, 5)
        Of a healthy side and of each of `MODES`.
    """

    hop: int
    probability: dict[Side, Array]

    def healthy(self, side: Side, n: int) -> Array:
        """Probability that a side is healthy in each of n blocks, shape (n,)."""
        place = np.minimum(np.arange(n) // self.hop, len(self.probability[side]) - 1)
        return np.asarray(self.probability[side][place, 0])


@dataclass(frozen=True)
class Segment:
    """Blocks [start, stop) of one wheel in which one row of a side is most probable.

    Attributes
    ----------
    pooled : dict[Row or None, float]
        Probability of every row; None: no fault of either side.
    """

    start: int
    stop: int
    side: Side
    mode: FaultMode
    pooled: dict[Row | None, float]

    @property
    def model(self) -> int:
        """Kalman model of its row."""
        return MODEL_OF[self.side, self.mode]


def track_of(said: Mapping[Side, Array], hop: int, dt: float) -> Track:
    """What the trees say of one wheel, averaged over neighbouring frames.

    Parameters
    ----------
    said : Mapping[Side, Array], shape (frames, 5) each
        Log-probabilities of its frames.
    hop : int
        Blocks from frame to frame.
    dt : float
        Block [s].
    """
    around = round(_AROUND_S / (hop * dt))
    return Track(hop, {side: _averaged(one, around) for side, one in said.items()})


def _averaged(said: Array, around: int) -> Array:
    """Geometric mean of each frame's probabilities and those of `around` frames on either side, shape (frames, classes).

    Neighbouring windows overlap, so that frames do not add to each other's evidence: they agree or they do not.
    """
    n = len(said)
    sums = np.concatenate([np.zeros((1, said.shape[1])), np.cumsum(said, axis=0)])
    first, last = np.maximum(np.arange(n) - around, 0), np.minimum(np.arange(n) + around + 1, n)
    mean = _SHARPER * (sums[last] - sums[first]) / (last - first)[:, None]
    p = np.exp(mean - mean.max(axis=1, keepdims=True))
    return np.asarray(p / p.sum(axis=1, keepdims=True))


def segments_of(track: Track, side: Side, n: int, runs: Runs, dt: float) -> list[Segment]:
    """Segments of a side among n blocks, in order of time.

    Parameters
    ----------
    track : Track
        The wheel.
    side : Side
        Sensor or actuator.
    n : int
        Blocks.
    runs : Runs
        Of the Kalman models' path: an edge of theirs near a segment's is the better one.
    dt : float
        Block [s].
    """
    p = track.probability[side]
    step = track.hop * dt
    mode = np.where(_faulty(p[:, 0], round(_BRIDGED_S / step)), 1 + p[:, 1:].argmax(axis=1), 0)
    cut = np.flatnonzero(np.r_[True, mode[1:] != mode[:-1]])
    pieces = [[int(a), int(b), int(mode[a])] for a, b in zip(cut, np.r_[cut[1:], mode.size], strict=True)]
    out = []
    for a, b, k in _joined(pieces, round(_SHORT_S / step)):
        start, stop = _edges(
            a * track.hop, min(n, b * track.hop) if b < mode.size else n, side, runs, round(_NEAR_S / dt)
        )
        if stop > start:
            out.append(Segment(start, stop, side, MODES[k - 1], _pooled(track, side, slice(a, b))))
    return out


def _faulty(healthy: Array, bridged: int) -> NDArray[np.bool_]:
    """Frames of faults, shape (frames,), by the probability of a healthy side; a doubtful pause of `bridged` frames is bridged."""
    out = healthy < _FAULTY
    edges = np.flatnonzero(np.diff(np.r_[False, out, False].astype(np.int8)))
    for stop, start in zip(edges[1::2], edges[2::2], strict=False):
        if start - stop <= bridged and healthy[stop:start].max() < _DOUBTED:
            out[stop:start] = True
    return out


def _joined(pieces: list[list[int]], short: int) -> list[list[int]]:
    """Faulty pieces; one of less than `short` frames goes to the longest faulty neighbour, shortest first.

    Neighbours follow each other without a pause; those of one row are one piece. What is joined stands in the place of its
    first part and is looked at again with its neighbours, so that n pieces take about n·log n steps.
    """
    out = [list(p) for p in pieces if p[2] != 0]
    follows = [False, *(a[1] == b[0] for a, b in pairwise(out)), False]
    before = [k - 1 if follows[k] else None for k in range(len(out))]
    behind = [k + 1 if follows[k + 1] else None for k in range(len(out))]
    kept = [True] * len(out)
    queue = [(_length(p), k) for k, p in enumerate(out)]
    heapify(queue)
    while queue:
        length, k = heappop(queue)
        if not kept[k] or length != _length(out[k]):
            continue  # joined since
        near = [j for j in (before[k], behind[k]) if j is not None]
        same = [j for j in near if out[j][2] == out[k][2]]
        if not same and (not near or length >= short):
            continue
        j = max(same or near, key=lambda j: _length(out[j]))
        first, last = min(j, k), max(j, k)
        out[first], kept[last] = [out[first][0], out[last][1], out[j][2]], False
        behind[first] = after = behind[last]
        if after is not None:
            before[after] = first
        for place in (before[first], first, after):
            if place is not None:
                heappush(queue, (_length(out[place]), place))
    return list(compress(out, kept))


def _length(piece: list[int]) -> int:
    """Frames of a piece."""
    return piece[1] - piece[0]


def _edges(start: int, stop: int, side: Side, runs: Runs, near: int) -> tuple[int, int]:
    """Edges of a segment: those of the path's runs of its side where they are near."""
    own = (runs.model >= A_GAIN) if side is Side.ACTUATOR else (runs.model >= S_STUCK) & (runs.model < A_GAIN)
    first, last = _closest(runs.start[own], start, near), _closest(runs.stop[own], stop, near)
    return (first, last) if last > first else (start, stop)


def _closest(edges: NDArray[np.int64], place: int, near: int) -> int:
    """The edge closest to a place; the place itself where none is within `near` of it."""
    if not edges.size:
        return place
    edge = int(edges[np.argmin(np.abs(edges - place))])
    return edge if abs(edge - place) <= near else place


def _pooled(track: Track, side: Side, part: slice) -> dict[Row | None, float]:
    """Probability of each row over some frames: of the side's own, and of the other's where that side is healthy."""
    other = Side.ACTUATOR if side is Side.SENSOR else Side.SENSOR
    own, rest = (track.probability[s][part].mean(axis=0) for s in (side, other))
    pooled: dict[Row | None, float] = {None: float(own[0] * rest[0])}
    for k, mode in enumerate(MODES, 1):
        pooled[side, mode] = float(own[k])
        pooled[other, mode] = float(own[0] * rest[k])
    return pooled


def runs_between(segments: list[Segment], n: int) -> tuple[Runs, list[int]]:
    """Runs of n blocks of which some are segments that do not overlap, and the run of each segment."""
    rows, places, last = [], [], 0
    for s in segments:
        if s.start > last:
            rows.append((last, s.start, 0, last))
        places.append(len(rows))
        rows.append((s.start, s.stop, s.model, s.start))
        last = s.stop
    if last < n or not rows:
        rows.append((last, n, 0, last))
    columns = np.array(rows, dtype=np.int64)
    return Runs(*(np.ascontiguousarray(columns[:, j]) for j in range(4))), places
