"""Every finding's onset once more by filterpy, and how well both agree, beside the evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.second_onset import SAMPLES, channel_model, second_onset
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
Part = tuple[str, str]

_NEEDED = ("residual", "threshold", "expected")
_AROUND_S = {Tier.DIRECT: 0.0}  # second measurements show an onset to the sample; models, by seconds
_AROUND_BY_MODELS_S = 1.5
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
    out = {}
    for part, a in assessments.items():
        found = tuple(_with_second(f, a, dt) if (f.start, f.stop, f.side, f.mode) in kept else f for f in a.findings)
        out[part] = replace(a, findings=found)
    return out


def _with_second(finding: Finding, a: Assessment, dt: float) -> Finding:
    text = said(finding, a, dt)
    return replace(finding, evidence=(*finding.evidence, text)) if text else finding


def said(finding: Finding, a: Assessment, dt: float) -> str:
    """The sentence; empty where the readings around the onset are not kept, or the row is none of the tables'."""
    if finding.mode is FaultMode.OUTSIDE_TABLE or finding.start == 0 or any(n not in a.columns for n in _NEEDED):
        return ""
    around = _AROUND_S.get(finding.tier, _AROUND_BY_MODELS_S)
    stride = max(1, round(around / dt / SAMPLES))
    reach = SAMPLES * stride
    first, last = max(0, finding.start - reach), min(finding.start + reach, finding.stop)
    columns = _steps(a, first, last)
    if columns is None:
        return ""
    residual, threshold, expected = (c[::stride] for c in columns)
    y = residual + expected
    known = np.isfinite(y)
    noise = float(np.nanmedian(threshold)) / 3.0 if np.isfinite(threshold).any() else 0.0
    if not known.any() or noise <= 0.0:
        return ""
    behind = np.isfinite(y) & np.isfinite(expected) & (first + np.arange(y.size) * stride >= finding.start)
    model = channel_model(noise, y[behind], expected[behind], dt * stride)
    # a valve behind a wheel model shows in the speed only: any departure from the expected one is its fault
    shown = finding.side is Side.SENSOR or finding.tier is Tier.DIRECT
    row = State(finding.mode.value) if shown else State.NOISY
    found = second_onset(y, expected, model, row)
    if found is None:
        return "filterpy, stepped over the readings around the onset, sees no onset there that stands out."
    off = (first + found.place * stride - finding.start) * dt
    when = f"filterpy, stepped over the readings around it, sees the onset at {finding.start * dt + off:.3f} s"
    if abs(off) < 0.5 * dt * stride:
        return f"{when}: the same {'sample' if stride == 1 else 'moment'}."
    size = f"{1e3 * abs(off):.0f} ms" if abs(off) < 1.0 else f"{abs(off):.1f} s"
    return f"{when}: {size} {'later' if off > 0 else 'earlier'}."


def _steps(a: Assessment, first: int, last: int) -> tuple[Array, ...] | None:
    """Readings at steps [first, last); None where only envelopes of them are kept."""
    if a.columns[_NEEDED[0]].size == a.states.size:
        return tuple(np.asarray(a.columns[n][first:last], np.float64) for n in _NEEDED)
    near = a.closeups
    if near is None or any(n not in near.columns for n in _NEEDED):
        return None
    at = np.searchsorted(near.step, [first, last])
    if at[1] - at[0] != last - first:
        return None
    return tuple(np.asarray(near.columns[n][at[0] : at[1]], np.float64) for n in _NEEDED)
