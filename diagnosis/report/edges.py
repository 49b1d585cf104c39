"""The samples around a fault's onset and end, and how far they deviate against the noise beyond the edge."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.pages.labels import number
from diagnosis.report.compared_channels import Pair
from diagnosis.results.document import IntervalRow
from replay.arrays.quantiles import median_of
from replay.faults import Side

Array = NDArray[np.float64]

_SAMPLES = 30
_SECONDS = 0.05
_MOST = 100
_HEALTHY = 120
_LEAST_HEALTHY = 8
_COURSE = 30
_APART = 3.5
_OFF = 0.5  # standard deviations


@dataclass(frozen=True)
class Edge:
    """Onset or end of one fault at the rate of the columns.

    Attributes
    ----------
    name : str
        ``onset`` or ``end``.
    t : Array, shape (m,)
        Time from the edge [s].
    y, reference : Array, shape (m,)
        Samples of the channel and of its reference, in the pair's unit; NaN where there is none.
    at : float
        Mission time of the edge [s].
    step : float
        Sample time [s].
    shift : tuple[float, float] or None
        Where the faulty sample next to the edge should have been and where it is.
    most : float
        Largest distance of a faulty sample of the window from where it should have been.
    noise : float or None
        Standard deviation on the other side of the edge; None where that holds too few samples.
    level : float
        How far the channel is off its independent reference on the other side of the edge, in the pair's unit; 0 without one.
    """

    name: str
    t: Array
    y: Array
    reference: Array
    at: float
    step: float
    shift: tuple[float, float] | None
    most: float
    noise: float | None
    level: float = 0.0

    @property
    def off_before(self) -> bool:
        """Whether the channel is off its reference on the other side of the edge already, by more than half of its noise there."""
        return abs(self.level) > _OFF * (self.noise or 0.0)

    @property
    def reach(self) -> float:
        """Half of the window [s]."""
        return float(max(-self.t[0], self.t[-1]))


def edge_of(
    name: str,
    fault: IntervalRow,
    others: Sequence[IntervalRow],
    pair: Pair,
    columns: Mapping[str, NDArray[np.floating]],
    axis: tuple[float, float],
) -> Edge | None:
    """Samples around the onset or end of a fault; None where the log holds no sample on one of its sides.

    Parameters
    ----------
    name : str
        ``onset`` or ``end``.
    fault : IntervalRow
        The fault.
    others : Sequence[IntervalRow]
        All faults of the mission, whose samples do not count as healthy.
    pair : Pair
        The fault's channel and reference.
    columns : Mapping[str, NDArray[np.floating]], each of shape (n,)
        Columns by name.
    axis : tuple[float, float]
        Time of the first sample and sample time [s].
    """
    start, step = axis
    onset = name == "onset"
    at, other_end = (fault["start_s"], fault["stop_s"]) if onset else (fault["stop_s"], fault["start_s"])
    size = len(columns[pair.measured])
    place, far = round((at - start) / step), round((other_end - start) / step)
    half = min(_MOST, max(_SAMPLES, math.ceil(_SECONDS / step)))
    first, last = max(0, place - half), min(size, place + half + 1)
    if not first < place < last:
        return None
    y, reference = _cut(columns, pair, first, last)
    if not (np.isfinite(y[: place - first]).any() or np.isfinite(y[place - first :]).any()):
        return None
    t = (np.arange(first, last, dtype=np.float64) - place) * step
    inside = slice(place - first, max(place, far) - first) if onset else slice(max(far - first, 0), place - first)
    shift, most, noise, level = None, math.nan, None, 0.0
    times, values = _healthy(place, fault, others, pair, columns, axis, onset)
    if values.size >= _LEAST_HEALTHY:
        course, noise = _course(times, values, t[inside], onset, pair.independent)
        level = float(median_of(values)) if pair.independent else 0.0
        expected = course + (reference[inside] if pair.independent else 0.0)
        deviation = y[inside] - expected
        finite = np.flatnonzero(np.isfinite(deviation))
        if finite.size:
            near = finite[0] if onset else finite[-1]
            shift = (float(expected[near]), float(y[inside][near]))
            most = float(np.abs(deviation[finite]).max())
    return Edge(name, t, y, reference, at, step, shift, most, noise, level)


def _cut(columns: Mapping[str, NDArray[np.floating]], pair: Pair, first: int, last: int) -> tuple[Array, Array]:
    """Channel and reference of some steps, in the pair's unit; NaN where there is no reference."""
    measured = columns[pair.measured][first:last].astype(np.float64) * pair.scale
    if pair.reference is None:
        return measured, np.full(last - first, np.nan)
    return measured, columns[pair.reference][first:last].astype(np.float64) * pair.scale


def _healthy(
    place: int,
    fault: IntervalRow,
    others: Sequence[IntervalRow],
    pair: Pair,
    columns: Mapping[str, NDArray[np.floating]],
    axis: tuple[float, float],
    onset: bool,
) -> tuple[Array, Array]:
    """Samples beyond an edge that are not faulty: times from it [s], and values less an independent reference."""
    size = len(columns[pair.measured])
    span = (max(0, place - _HEALTHY), place) if onset else (place, min(size, place + _HEALTHY))
    measured, reference = _cut(columns, pair, *span)
    values = measured - (reference if pair.independent else 0.0)
    use = np.isfinite(values)
    if pair.independent:  # the distance from a reference is the usual one only where nothing is faulty
        use &= ~_faulty(span, fault, others, axis)
    times = (np.arange(*span, dtype=np.float64) - place) * axis[1]
    return times[use], values[use]


def _faulty(
    span: tuple[int, int], fault: IntervalRow, others: Sequence[IntervalRow], axis: tuple[float, float]
) -> NDArray[np.bool_]:
    """Samples of a span that lie in any fault of the same part."""
    start, step = axis
    out = np.zeros(span[1] - span[0], dtype=np.bool_)
    for other in others:
        if other["component"] == fault["component"] and set(Side(other["side"]).sides) & set(Side(fault["side"]).sides):
            a, b = (round((v - start) / step) - span[0] for v in (other["start_s"], other["stop_s"]))
            out[max(0, a) : max(0, b)] = True
    return out


def _course(t: Array, y: Array, at: Array, onset: bool, independent: bool) -> tuple[Array, float | None]:
    """Where samples y at times t would go on at other times, and their standard deviation about that.

    Against a reference that the fault leaves as it is: at their usual distance; else along the line through the
    nearest ones.
    """
    if independent:
        level = float(median_of(y))
        course, rest = np.full(at.size, level), y - level
    else:
        near = slice(-_COURSE, None) if onset else slice(None, _COURSE)
        slope, level = np.polyfit(t[near], y[near], 1)
        course, rest = slope * at + level, y[near] - (slope * t[near] + level)
    noise = 1.4826 * float(median_of(np.abs(rest))) or float(np.std(rest))
    return course, noise if noise > 1e-12 else None


def edge_words(edge: Edge, pair: Pair) -> str:
    """How far the samples at an edge deviate, against the noise."""
    onset = edge.name == "onset"
    if edge.shift is None:
        where = "before" if onset else "after"
        return f"Too few {'healthy ' if pair.independent else ''}samples {where} it to estimate the noise."
    which, window = ("First", "after") if onset else ("Last", "before")
    size = abs(edge.shift[1] - edge.shift[0])
    off = (
        f"from the {pair.words}"
        if pair.independent
        else "from the course before it"
        if onset
        else "from the course after it"
    )
    if edge.off_before:
        text = _against_before(edge, pair, size)
    elif edge.noise is not None and edge.most < _APART * edge.noise:
        text = f"No sample of the {time_words(edge.reach)} {window} stands out of the noise: at most {pair.text(edge.most)}{_times(edge.most, edge)} {off}"
    else:
        text = f"{which} faulty sample deviates by {pair.text(size)}{_times(size, edge)} {off}"
        if edge.most > 1.5 * size:
            text += (
                f", and by up to {number(edge.most)}{_times(edge.most, edge)} in the {time_words(edge.reach)} {window}"
            )
    if edge.noise is not None:
        text += f"; σ {'before' if onset else 'after'} it: {number(edge.noise)}"
    return text + "."


def _against_before(edge: Edge, pair: Pair, size: float) -> str:
    """The same where the channel is off its reference beyond the edge already: how far off it is, and how much of that is new."""
    onset = edge.name == "onset"
    which, window, beside = ("First", "after", "before") if onset else ("Last", "before", "after")
    assert edge.shift is not None
    verb, yet = ("were", "already") if onset else ("are", "still")
    was = f"the samples {beside} it, which {verb} {pair.text(abs(edge.level))} off the {pair.words} {yet}"
    if edge.noise is not None and edge.most < _APART * edge.noise:
        most = f"at most {pair.text(edge.most)}{_times(edge.most, edge)}"
        return f"No sample of the {time_words(edge.reach)} {window} stands out of the noise against {was}: {most}"
    total = abs(edge.shift[1] - edge.shift[0] + edge.level)
    text = (
        f"{which} faulty sample is {pair.text(total)} off the {pair.words}, a change of {number(size)}"
        f"{_times(size, edge)} against {was}"
    )
    if edge.most > 1.5 * size:
        text += f"; in the {time_words(edge.reach)} {window} the change is up to {number(edge.most)}{_times(edge.most, edge)}"
    return text


def _times(value: float, edge: Edge) -> str:
    if edge.noise is None:
        return ""
    ratio = value / edge.noise
    return f" ({number(round(ratio)) if ratio >= 9.5 else number(ratio, 2)} σ)"


def time_words(seconds: float) -> str:
    """Short time in ms, else in s, to three digits. Time in s."""
    return f"{number(seconds * 1e3)} ms" if abs(seconds) < 1.0 else f"{number(seconds)} s"
