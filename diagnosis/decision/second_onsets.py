"""Every finding's onset once more by filterpy, and how well both agree, beside the evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.second_onset import SAMPLES, Readings, Second, channel_model, second_onsets
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.arrays.quantiles import median_known
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
Part = tuple[str, str]

_NEEDED = ("residual", "threshold", "expected")
_AROUND_S = {Tier.DIRECT: 0.0}  # second measurements show an onset to the sample; models, by seconds
_AROUND_BY_MODELS_S = 1.5
_AT_THE_EDGE = 2  # samples: an onset so near the first of the readings that are stepped over is rather before them
_MOST = 40  # findings of a mission, the surest first: what is computed again here costs time


def with_second_onsets(assessments: Mapping[Part, Assessment], dt: float) -> dict[Part, Assessment]:
    """The same with a sentence on each finding: when filterpy, stepped sample by sample over the readings, sees it begin.

    Parameters
    ----------
    assessments : Mapping[Part, Assessment]
        By component and side.
    dt : float
        Step [s].
    """
    ranked = sorted((f for a in assessments.values() for f in a.findings), key=lambda f: (-f.probability, f.start))
    kept = {(f.start, f.stop, f.side, f.mode) for f in ranked[:_MOST]}
    asked = {
        (part, i): found
        for part, a in assessments.items()
        for i, f in enumerate(a.findings)
        if (f.start, f.stop, f.side, f.mode) in kept and (found := _around(f, a, dt)) is not None
    }
    onsets = second_onsets([a.readings for a in asked.values()])
    texts = {key: _said(one, onset, dt) for (key, one), onset in zip(asked.items(), onsets, strict=True)}
    return {
        part: replace(a, findings=tuple(_with(f, texts.get((part, i))) for i, f in enumerate(a.findings)))
        for part, a in assessments.items()
    }


def _with(finding: Finding, text: str | None) -> Finding:
    return finding if text is None else replace(finding, evidence=(*finding.evidence, text))


class _Around(NamedTuple):
    """Every `stride`-th sample from `first` on, around an onset at `start` [steps]."""

    start: int
    first: int
    stride: int
    readings: Readings


def _around(finding: Finding, a: Assessment, dt: float) -> _Around | None:
    """The readings around an onset; None where they are not kept, or the row is none of the tables'."""
    if finding.mode is FaultMode.OUTSIDE_TABLE or finding.start == 0 or any(n not in a.columns for n in _NEEDED):
        return None
    around = _AROUND_S.get(finding.tier, _AROUND_BY_MODELS_S)
    stride = max(1, round(around / dt / SAMPLES))
    reach = SAMPLES * stride
    first, last = max(0, finding.start - reach), min(finding.start + reach, finding.stop)
    columns = steps_between(a, _NEEDED, first, last)
    if columns is None:
        return None
    residual, threshold, expected = (c[::stride] for c in columns)
    y = residual + expected
    known = np.isfinite(y)
    noise = float(median_known(threshold)) / 3.0 if np.isfinite(threshold).any() else 0.0
    later = first + np.arange(y.size) * stride >= finding.start
    silent = bool(known[~later].any()) and 4.0 * known[later].mean() < known[~later].mean()  # nothing to step over
    if not known.any() or noise <= 0.0 or silent:
        return None
    behind = known & np.isfinite(expected) & later
    model = channel_model(noise, y[behind], expected[behind], dt * stride)
    # a valve behind a wheel model shows in the speed only: any departure from the expected one is its fault
    shown = finding.side is Side.SENSOR or finding.tier is Tier.DIRECT
    row = State(finding.mode.value) if shown else State.NOISY
    return _Around(finding.start, first, stride, Readings(y, expected, model, row))


def _said(asked: _Around, found: Second | None, dt: float) -> str:
    """The sentence."""
    start, first, stride, _ = asked
    if found is None:
        return (
            "A second filter (filterpy), stepped over the readings around the onset, sees none there that stands out."
        )
    off = (first + found.place * stride - start) * dt
    if off < 0 and first > 0 and found.place <= _AT_THE_EDGE:
        return (
            f"A second filter (filterpy), stepped over the readings around it, sees no onset among them: by its models those of {_size(off)} before it fit "
            "the fault better than a healthy part already."
        )
    when = (
        f"A second filter (filterpy), stepped over the readings around it, sees the onset at {start * dt + off:.3f} s"
    )
    if abs(off) < 0.5 * dt * stride:
        return f"{when}: the same {'sample' if stride == 1 else 'moment'}."
    fit = "a healthy part better than the fault" if off > 0 else "the fault better than a healthy part"
    return (
        f"{when}: {_size(off)} {'later' if off > 0 else 'earlier'}, for by its models the readings between fit {fit}."
    )


def _size(off: float) -> str:
    """A time [s] in words, without its sign."""
    return f"{1e3 * abs(off):.0f} ms" if abs(off) < 1.0 else f"{abs(off):.1f} s"


def steps_between(a: Assessment, names: Sequence[str], first: int, last: int) -> tuple[Array, ...] | None:
    """Some columns at steps [first, last), each of shape (last − first,); None where only envelopes of them are kept."""
    if a.columns[names[0]].size == a.states.size:
        return tuple(np.asarray(a.columns[n][first:last], np.float64) for n in names)
    near = a.closeups
    if near is None or any(n not in near.columns for n in names):
        return None
    at = np.searchsorted(near.step, [first, last])
    if at[1] - at[0] != last - first:
        return None
    return tuple(np.asarray(near.columns[n][at[0] : at[1]], np.float64) for n in names)
