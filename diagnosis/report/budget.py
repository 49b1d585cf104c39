"""What of a mission's columns goes into the page at which rate, so that the page keeps to its size.

Every sample of every column where that fits. Else the extremes of blocks everywhere, every sample around the onset and
the end of the most severe faults, and, of missions of some minutes, every sample of as many whole columns as there is room
for: what a browser can hold ends before what a page can.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.report.encode import Channel, Plan, plan_of, reduced, resolution_of, whole, with_pieces
from diagnosis.results.result import Closeups
from replay.arrays.processors import each
from replay.arrays.runs import runs_of

Values = NDArray[np.floating]
Spans = list[tuple[int, int]]

_PADS_S = ((20.0, 40.0), (10.0, 20.0), (5.0, 10.0), (2.0, 10.0), (2.0, 4.0), (1.0, 2.0))
_MARGIN_S = 0.1
_STRIDE, _BLOCKS, _FEWEST = 64, 32_768, 1024
_AROUND, _MOST = 0.85, 0.9
_RANK = {"replay": 1, "evidence": 2}
_MOST_WHOLE = 720_000
_ROWS = 0  # whatever their length: what is made of them is packed at once


@dataclass(frozen=True)
class Encodable:
    """Columns to encode.

    Attributes
    ----------
    columns : Mapping[str, NDArray[np.floating]], each of shape (n,)
        Samples, or two rows with the extremes of each `per` samples.
    lsb : Mapping[str, float]
        Smallest increments of recorded columns, in their units.
    faults : Sequence[tuple[float, float, frozenset[str]]]
        Start [s] and stop [s] after the first sample, and the columns that show the fault; worst first.
    step_s : float
        Sample time [s].
    per : int
        1 where rows are samples.
    closeups : Closeups or None
        Every sample of some stretches where rows are extremes.
    """

    columns: Mapping[str, Values]
    lsb: Mapping[str, float]
    faults: Sequence[tuple[float, float, frozenset[str]]]
    step_s: float
    per: int = 1
    closeups: Closeups | None = None

    @property
    def samples(self) -> int:
        """Samples of the mission."""
        rows = max(len(v) for v in self.columns.values())
        return rows if self.per == 1 else rows // 2 * self.per

    def pieces(self, column: str, spans: Spans) -> list[tuple[int, Values]]:
        """Every sample of a column over some spans [samples], as far as it is there.

        First sample and values, shape (k,), of each.
        """
        values = self.columns[column]
        if self.per == 1:
            return [(a, values[a:b]) for a, b in spans if b > a]
        if self.closeups is None or column not in self.closeups.columns:
            return []
        out = []
        for i, j in self.closeups.runs():
            first = int(self.closeups.step[i])
            for a, b in spans:
                a, b = max(a, first), min(b, first + j - i)
                if b > a:
                    out += self._known(column, a, self.closeups.columns[column][i + a - first : i + b - first])
        return out

    def _known(self, column: str, start: int, values: Values) -> list[tuple[int, Values]]:
        """The parts of a stretch in which a column was kept: without a sample only where its extremes have none."""
        rows = self.columns[column]
        at = np.minimum((start + np.arange(len(values))) // self.per * 2, len(rows) - 1)
        known = np.isfinite(values) | ~np.isfinite(rows[at])
        return [(start + a, values[a:b]) for a, b in runs_of(known)]


def spans_of(faults: Iterable[tuple[float, float]], pad_s: float, whole_s: float, step_s: float, samples: int) -> Spans:
    """Stretches [samples] around onset and end of faults, joined where they meet; short faults as a whole.

    Parameters
    ----------
    faults : Iterable[tuple[float, float]]
        Start and stop [s].
    pad_s : float
        Time on either side [s].
    whole_s : float
        Faults up to this long [s] are shown as a whole, with at least half their length on either side.
    step_s : float
        Sample time [s].
    samples : int
        Samples of the mission.
    """
    cuts = []
    for start, stop in faults:
        if stop - start <= whole_s:
            room = max(pad_s, 0.5, 0.5 * (stop - start)) + _MARGIN_S
            edges = [(start - room, stop + room)]
        else:
            edges = [(at - pad_s, at + pad_s) for at in (start, stop)]
        cuts += [(max(0, int(a / step_s)), min(samples, int(b / step_s) + 2)) for a, b in edges]
    spans: Spans = []
    for a, b in sorted(cuts):
        if spans and a <= spans[-1][1]:
            spans[-1] = (spans[-1][0], max(spans[-1][1], b))
        else:
            spans.append((a, b))
    return spans


@np.errstate(over="ignore", invalid="ignore")  # of infinite or absurd values
def encode(given: Encodable, budget: int) -> list[Channel]:
    """Encode columns within a budget [bytes]: every sample where that fits, else extremes with samples around faults.

    Columns that hold the same numbers are encoded once and share their segments.
    """
    if not given.columns:
        return []
    same = _same(given)
    distinct = {c: given.columns[c] for c in dict.fromkeys(same.values())}
    faults = [(a, b, frozenset(same[c] for c in columns if c in same)) for a, b, columns in given.faults]
    found = {c.name: c for c in _encoded(replace(given, columns=distinct, faults=faults), budget)}
    return [replace(found[same[c]], name=c) for c in given.columns]


def _same(given: Encodable) -> dict[str, str]:
    """For each column the first one that holds the same numbers."""
    seen: dict[tuple[object, ...], list[str]] = {}
    out = {}
    closeups = given.closeups.columns if given.closeups else {}
    for name, values in given.columns.items():
        few = values[:: max(1, len(values) // 1024)].tobytes()
        alike = seen.setdefault((values.dtype.str, given.lsb.get(name), few), [])
        for other in alike:
            near = [c.get(x) for c in (given.columns, closeups) for x in (name, other)]
            if _equal(near[0], near[1]) and _equal(near[2], near[3]):
                out[name] = other
                break
        else:
            alike.append(name)
            out[name] = name
    return out


def _equal(a: Values | None, b: Values | None) -> bool:
    if a is None or b is None:
        return a is b
    bits = f"u{a.dtype.itemsize}"
    return a.dtype == b.dtype and bool(np.array_equal(a.view(bits), b.view(bits)))


def _encoded(given: Encodable, budget: int) -> list[Channel]:
    columns, samples, per = given.columns, given.samples, given.per
    found = each(lambda c: plan_of(columns[c], given.lsb.get(c), resolution_of(c)), columns, _ROWS)
    plans = dict(zip(columns, found, strict=True))
    if per == 1 and sum(p.rate for p in plans.values()) * samples <= budget:
        channels = each(lambda c: whole(c, columns[c], plans[c]), columns, _ROWS)
        if sum(c.size for c in channels) <= budget:
            return channels

    def run(stride: int) -> list[Channel]:
        return each(lambda c: reduced(c, columns[c], plans[c], per, stride), columns, _ROWS)

    stride = max(_STRIDE, per)
    while samples // stride > _BLOCKS:
        stride *= 2
    while True:
        channels = run(stride)
        left = budget - sum(c.size for c in channels)
        if left >= 0 or samples // stride <= _FEWEST:
            break
        stride *= 2
    spans = _affordable(given, plans, left * (_AROUND if per == 1 and samples <= _MOST_WHOLE else _MOST))

    def near(channel: Channel) -> Channel:
        return with_pieces(channel, given.pieces(channel.name, spans[channel.name]), plans[channel.name])

    channels = each(near, channels, _ROWS)
    if per > 1 or samples > _MOST_WHOLE:
        return channels
    chosen = _whole_columns(channels, plans, samples, budget - sum(c.size for c in channels))
    full = {c.name: c for c in each(lambda c: whole(c, columns[c], plans[c]), chosen, _ROWS)}
    return [full.get(c.name, c) for c in channels]


def _whole_columns(channels: Sequence[Channel], plans: Mapping[str, Plan], samples: int, left: float) -> list[str]:
    """Columns, recorded ones first, of which every sample fits into what is left of the budget [bytes]."""
    chosen = []
    for c in sorted(channels, key=lambda c: _RANK.get(c.name.partition(".")[0], 0)):
        more = 1.1 * plans[c.name].rate * samples - c.size
        if more <= left:
            left -= more
            chosen.append(c.name)
    return chosen


def _affordable(given: Encodable, plans: Mapping[str, Plan], budget: float) -> dict[str, Spans]:
    """Widest stretches around as many faults, worst first, as the budget [bytes] pays for; by column."""
    shows: dict[tuple[int, ...], list[str]] = {}
    for c in given.columns:
        shows.setdefault(tuple(i for i, f in enumerate(given.faults) if c in f[2]), []).append(c)
    rates = {faults: sum(plans[c].rate for c in columns) for faults, columns in shows.items()}

    def spans(count: int, pad: tuple[float, float]) -> dict[tuple[int, ...], Spans]:
        times = [(a, b) for a, b, _ in given.faults[:count]]
        return {
            faults: spans_of([times[i] for i in faults if i < count], *pad, given.step_s, given.samples)
            for faults in shows
        }

    def fits(count: int, pad: tuple[float, float]) -> bool:
        return sum(rates[f] * sum(b - a for a, b in found) for f, found in spans(count, pad).items()) <= budget

    least, most = 0, len(given.faults)
    while least < most:
        middle = (least + most + 1) // 2
        least, most = (middle, most) if fits(middle, _PADS_S[-1]) else (least, middle - 1)
    kept = _PADS_S if given.per == 1 else _PADS_S[-3:]
    pad = next((p for p in kept if fits(least, p)), kept[-1])
    return {c: found for faults, found in spans(least, pad).items() for c in shows[faults]}
