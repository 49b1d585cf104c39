"""From frames to segments of one row: what the trees say of each frame, followed through the mission for both sides of a wheel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.models import A_BIAS, A_GAIN, A_NONE, A_STUCK, S_GAIN, S_NONE, S_STUCK, S_WHITE_8, Row
from diagnosis.wheels.runs import Runs
from replay.arrays.runs import runs_of
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
_CHANGE = 4.0  # log-probability times seconds by which another row must be better to take over within a fault
_LEAST = 1e-6  # probability below which differences say nothing
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
    faulty = _faulty(p[:, 0], round(_BRIDGED_S / step))
    out = []
    for first, last in runs_of(faulty):
        for a, b, k in _rows_between(p, first, last, step):
            stop = min(n, b * track.hop) if b < faulty.size else n
            start, stop = _edges(a * track.hop, stop, side, runs, round(_NEAR_S / dt))
            if stop > start:
                out.append(Segment(start, stop, side, MODES[k], _pooled(track, side, slice(a, b))))
    return out


def _faulty(healthy: Array, bridged: int) -> NDArray[np.bool_]:
    """Frames of faults, shape (frames,), by the probability of a healthy side; a doubtful pause of `bridged` frames is bridged."""
    out = healthy < _FAULTY
    for (_, stop), (start, _) in pairwise(runs_of(out)):
        if start - stop <= bridged and healthy[stop:start].max() < _DOUBTED:
            out[stop:start] = True
    return out


def _rows_between(p: Array, first: int, last: int, step: float) -> list[tuple[int, int, int]]:
    """Pieces [start, stop) of the faulty frames [first, last), and which of `MODES` each is in: the most probable path.

    A row that takes over within a fault must be more probable by `_CHANGE`.
    """
    gain = step * np.log(np.maximum(p[first:last, 1:], _LEAST))
    score, back = gain[0].copy(), np.zeros(gain.shape, np.int8)
    stay = np.arange(score.size)
    for k in range(1, len(gain)):
        best = int(score.argmax())
        entered = score[best] - _CHANGE
        back[k] = np.where(entered > score, best, stay)
        score = np.maximum(score, entered) + gain[k]
    row = np.empty(len(gain), np.int64)
    row[-1] = score.argmax()
    for k in range(len(gain) - 1, 0, -1):
        row[k - 1] = back[k, row[k]]
    cut = np.flatnonzero(np.r_[True, row[1:] != row[:-1]])
    return [
        (first + a, first + b, int(row[a])) for a, b in zip(cut.tolist(), [*cut[1:].tolist(), row.size], strict=True)
    ]


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
