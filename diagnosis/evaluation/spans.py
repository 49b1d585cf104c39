"""Sets of half-open time spans [s]."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Span = tuple[float, float]


def merged(spans: Iterable[Span]) -> list[Span]:
    """The same set as spans that are apart, in order; empty spans are left out."""
    out: list[Span] = []
    for start, stop in sorted(spans):
        if stop <= start:
            continue
        if out and start <= out[-1][1]:
            out[-1] = (out[-1][0], max(out[-1][1], stop))
        else:
            out.append((start, stop))
    return out


def length(spans: Iterable[Span]) -> float:
    """Sum of the lengths [s]."""
    return float(sum(stop - start for start, stop in spans))


def within(spans: Iterable[Span], start: float, stop: float) -> list[Span]:
    """The parts of spans between `start` and `stop`. Times in s."""
    cut = [(max(a, start), min(b, stop)) for a, b in spans]
    return [(a, b) for a, b in cut if b > a]


def without(spans: Iterable[Span], holes: Sequence[Span]) -> list[Span]:
    """The parts of spans outside `holes`, which must be `merged`."""
    out: list[Span] = []
    for start, stop in spans:
        for a, b in within(holes, start, stop):
            if a > start:
                out.append((start, a))
            start = b
        if stop > start:
            out.append((start, stop))
    return out


def covered(t: Array | float, spans: Sequence[Span]) -> Array:
    """Time before each t that `merged` spans cover [s]; shape of `t`."""
    edges = np.array(spans, dtype=np.float64).reshape(-1, 2)
    until = np.asarray(t, dtype=np.float64)[..., None]
    return np.asarray(np.clip(until - edges[:, 0], 0.0, edges[:, 1] - edges[:, 0]).sum(axis=-1), dtype=np.float64)


def codes_at(t: Array, spans: Iterable[tuple[float, float, int]], default: int) -> NDArray[np.int64]:
    """Code of the span in which each time lies, `default` outside; of overlapping spans the later start counts.

    Parameters
    ----------
    t : Array, shape (n,)
        Times [s].
    spans : Iterable[tuple[float, float, int]]
        Start and stop [s], and code.
    default : int
        Code of times outside.
    """
    ordered = sorted(spans)
    out = np.full(t.size, default, dtype=np.int64)
    if ordered:
        start, stop, code = (np.array(x) for x in zip(*ordered, strict=True))
        k = np.searchsorted(start, t, side="right") - 1
        hit = (k >= 0) & (t < stop[np.maximum(k, 0)])
        out[hit] = code[k[hit]]
    return out
