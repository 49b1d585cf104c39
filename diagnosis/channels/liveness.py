"""A signal among those recorded with it: whether these live."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from replay.signals.signal import quantity_kind
from replay.signals.timeline import Timeline

_GAP_PERIODS = 2.5
_LOST_S = 1.0  # longest gap of a topic of one signal that lost messages may explain
_ALIKE = 3.0
_LEAST_SAMPLES = 3


def alive_sources(timeline: Timeline) -> dict[str, NDArray[np.int16]]:
    """Number of signals of each group (`replay.signals.signal.Signal.group`) that bring a new sample at each step.

    Of shape (n,) each.
    """
    out: dict[str, NDArray[np.int16]] = {}
    for name, fresh in timeline.fresh.items():
        count = out.setdefault(_group(timeline, name), np.zeros(timeline.size, dtype=np.int16))
        count += fresh
    return out


def alive(timeline: Timeline, counts: dict[str, NDArray[np.int16]], name: str) -> NDArray[np.bool_]:
    """Whether other signals that were recorded with this one bring new samples where it may be silent, shape (n,).

    Those of its group. For the only signal of a group: the same quantity of the file's other wheels or axles, or, where
    there is none, the other signals of its own; a short gap is then lost data where others of the file have gaps like it.
    """
    group = _group(timeline, name)
    together = [other for other in timeline.fresh if other != name and _group(timeline, other) == group]
    if together:
        return _while_most_run(timeline, together, (counts[group] - timeline.fresh[name]) > 0)
    others = [n for n in timeline.fresh if n != name and timeline.sources[n] == timeline.sources[name]]
    near = [n for n in others if quantity_kind(n) == quantity_kind(name)]
    near = near or [n for n in others if n.rpartition(".")[0] == name.rpartition(".")[0]]
    if not near:
        return np.zeros(timeline.size, dtype=np.bool_)
    delivers = np.logical_or.reduce([timeline.fresh[n] for n in near])
    return _while_most_run(timeline, near, delivers & _not_lost(timeline, name, delivers, others))


def _while_most_run(timeline: Timeline, names: Sequence[str], delivers: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """`delivers` from when half of some signals have begun until half have ended: what comes alone then is late, or early."""
    begun = sorted(int(np.argmax(timeline.fresh[n])) for n in names)
    ended = sorted(timeline.size - int(np.argmax(timeline.fresh[n][::-1])) for n in names)
    delivers = delivers.copy()
    delivers[: begun[(len(begun) - 1) // 2]] = False
    delivers[ended[(len(ended) - 1) // 2] :] = False
    return delivers


def _group(timeline: Timeline, name: str) -> str:
    return timeline.groups.get(name, timeline.sources[name])


def _not_lost(timeline: Timeline, name: str, delivers: NDArray[np.bool_], others: Sequence[str]) -> NDArray[np.bool_]:
    """Steps outside those gaps of a signal in which hardly anything else came either, or that others have too."""
    edge, gap = _gaps(timeline, name)
    length = np.diff(edge)
    came = np.diff(np.r_[0, np.cumsum(delivers)][np.minimum(edge + 1, timeline.size)])
    lost = gap & (came < _LEAST_SAMPLES)
    short = np.flatnonzero(gap & (length * timeline.dt < _LOST_S))
    if short.size:
        found = [_gaps(timeline, n) for n in others]
        known = np.sort(np.concatenate([np.diff(e)[g] for e, g in found]))
        alike = np.searchsorted(known, length[short] * _ALIKE) > np.searchsorted(known, length[short] / _ALIKE)
        lost[short[alike]] = True
    return np.asarray(np.repeat(~lost, length)[: timeline.size])


def _gaps(timeline: Timeline, name: str) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Steps with a sample, −1 and n at the ends, shape (k + 1,), and which of the k distances are gaps."""
    edge = np.r_[-1, np.flatnonzero(timeline.fresh[name]), timeline.size]
    return edge, np.diff(edge) * timeline.step_ns > _GAP_PERIODS * max(timeline.periods_ns[name], timeline.step_ns)
