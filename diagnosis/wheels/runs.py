"""From the most probable model of every block to runs: pieces of one fault are joined, artefacts of its edges left out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import SILENT
from diagnosis.wheels.models import (
    A_GAIN,
    A_STUCK,
    HEALTHY,
    NOISY_SENSOR,
    ODD,
    S_GAIN,
    S_STUCK,
    S_WHITE_8,
    TOTAL_SENSOR,
)

_SHORT_S = 0.05
_TRANSIENT_S = 0.25
_GAP_S = 0.1
_PIECE_S = 0.5


class Runs(NamedTuple):
    """Runs of one wheel in blocks, shape (runs,) each.

    Attributes
    ----------
    start, stop : NDArray[np.int64]
        Half open.
    model : NDArray[np.int64]
        Model of `diagnosis.wheels.models`.
    entry : NDArray[np.int64]
        Where the model was entered: after an edge's transient that belongs to the run.
    """

    start: NDArray[np.int64]
    stop: NDArray[np.int64]
    model: NDArray[np.int64]
    entry: NDArray[np.int64]


def runs_of(
    path: NDArray[np.uint8],
    entered: NDArray[np.bool_],
    quiet: NDArray[np.bool_],
    status: NDArray[np.int8],
    dt: float,
) -> Runs:
    """Runs of a path, healthy ones included.

    Parameters
    ----------
    path : NDArray[np.uint8], shape (n,)
        Model of each block.
    entered : NDArray[np.bool_], shape (n,)
        Blocks at which a model was entered anew.
    quiet : NDArray[np.bool_], shape (n,)
        Where the wheel is neither commanded nor moving.
    status : NDArray[np.int8], shape (n,)
        As in `diagnosis.channels.sample_status`.
    dt : float
        Block [s].

    Returns
    -------
    Runs
        In order of time; they leave no gap.
    """
    path = np.where(path == ODD, HEALTHY, path)
    kinds = np.where(np.isin(path, NOISY_SENSOR), S_WHITE_8, path)
    anew = entered & np.isin(path, (S_STUCK, S_GAIN, A_GAIN, A_STUCK))
    cut = np.flatnonzero(np.r_[True, (kinds[1:] != kinds[:-1]) | anew[1:]])
    runs = [[int(a), int(b), int(path[b - 1]), int(a)] for a, b in zip(cut, np.r_[cut[1:], path.size], strict=True)]
    runs = _episodes(runs, round(_GAP_S / dt), round(_PIECE_S / dt))
    runs = _absorbed(runs, max(3, round(_SHORT_S / dt)), round(_TRANSIENT_S / dt))
    runs = _trimmed(runs, quiet & (status != SILENT))
    columns = np.array(runs, dtype=np.int64).reshape(-1, 4)
    return Runs(*(np.ascontiguousarray(columns[:, j]) for j in range(4)))


def _episodes(runs: list[list[int]], gap: int, short: int) -> list[list[int]]:
    """Join valve faults that follow each other within `gap` blocks where one of them is short."""
    out: list[list[int]] = []
    for a, b, m, entry in runs:
        if m >= A_GAIN and out:
            back = 1
            if out[-1][2] == HEALTHY and out[-1][1] - out[-1][0] < gap and len(out) > 1:
                back = 2
            before = out[-back]
            if before[2] >= A_GAIN and (before[2] == m or min(before[1] - before[0], b - a) < short):
                longer = before if before[1] - before[0] >= b - a else [a, b, m, entry]
                del out[-back:]
                out.append([before[0], b, longer[2], longer[3]])
                continue
        out.append([a, b, m, entry])
    return out


def _absorbed(runs: list[list[int]], short: int, transient: int) -> list[list[int]]:
    """Give short faulty runs to a longer faulty neighbour; drop those that stand alone and are too short."""
    out = [list(r) for r in runs]
    k = 0
    while k < len(out):
        a, b, m, _ = out[k]
        lone = m in TOTAL_SENSOR
        if m == HEALTHY or b - a >= transient or (lone and b - a >= short):
            k += 1
            continue
        near = [j for j in (k + 1, k - 1) if 0 <= j < len(out) and out[j][2] != HEALTHY]
        near = [j for j in near if out[j][1] - out[j][0] >= max(transient, b - a)]
        if near:
            j = near[0]
            out[min(j, k) : max(j, k) + 1] = [[min(a, out[j][0]), max(b, out[j][1]), *out[j][2:]]]
            k = max(0, min(j, k) - 1)
        elif b - a < short:
            out[k][2] = HEALTHY
            out = _merged(out)
            k = max(0, k - 1)
        else:
            k += 1
    return _merged(out)


def _merged(runs: list[list[int]]) -> list[list[int]]:
    """Join healthy runs that follow each other."""
    out: list[list[int]] = []
    for run in runs:
        if out and out[-1][2] == HEALTHY == run[2]:
            out[-1][1] = run[1]
        else:
            out.append(list(run))
    return out


def _trimmed(runs: list[list[int]], idle: NDArray[np.bool_]) -> list[list[int]]:
    """Cut the ends of faults at which nothing could be seen, except of those that show at rest."""
    out: list[list[int]] = []
    for a, b, m, entry in runs:
        shows = m in (S_STUCK, A_STUCK, *NOISY_SENSOR)
        keep = np.flatnonzero(~idle[a:b])
        if m == HEALTHY or shows or (keep.size and keep[0] == 0 and keep[-1] == b - a - 1):
            out.append([a, b, m, entry])
        elif not keep.size:
            out.append([a, b, HEALTHY, a])
        else:
            first, last = a + int(keep[0]), a + int(keep[-1]) + 1
            parts = (
                (a, first, HEALTHY, a),
                (first, last, m, min(max(entry, first), last - 1)),
                (last, b, HEALTHY, last),
            )
            out += [list(part) for part in parts if part[1] > part[0]]
    return _merged(out)
