"""Time in which nothing at all was recorded: whatever a filter carried through it, no fault may rest on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import CODE, Assessment, Finding
from replay.arrays.envelope import bucket_of
from replay.faults import State
from replay.signals.timeline import Timeline

_LEAST_S = 0.25
_PERIODS = 10  # a gap lasts for more than so many periods of the slowest wheel or steering signal
_SETTLE_S = 0.25  # after a gap
_LEAST_SEEN = 0.5  # share of a fault's time of which something must have been recorded
Gap = tuple[int, int]


def recording_gaps(timeline: Timeline) -> list[Gap]:
    """Steps [start, stop) between two samples of any signal that are too far apart to be its rhythm."""
    regular = {n: p for n, p in timeline.periods_ns.items() if n not in timeline.stands}
    slow = [p for n, p in regular.items() if n.startswith(("wheel.", "steer.")) and p > 0]
    least = max(round(_LEAST_S / timeline.dt), _PERIODS * max(slow, default=0) // timeline.step_ns, 2)
    fresh = list(timeline.fresh.values())
    if not fresh:
        return []
    found, last = [], -1
    for part in timeline.blocks():
        seen = np.flatnonzero(np.logical_or.reduce([f[part] for f in fresh])) + part.start
        seen = np.r_[last, seen]
        wide = np.flatnonzero(np.diff(seen) > least)
        found += [(int(seen[k]) + 1, int(seen[k + 1])) for k in wide]
        last = int(seen[-1])
    if timeline.size - last > least:
        found.append((last + 1, timeline.size))
    return found


def without_gaps(assessment: Assessment, gaps: Sequence[Gap], timeline: Timeline) -> Assessment:
    """Leave nothing judged in the gaps: their state is `no_data`, faults end where they begin.

    A fault that reached into a gap ends at its edge and says so; one that was hardly seen outside is dropped.
    """
    if not gaps:
        return assessment
    states = assessment.states.copy()
    for start, stop in gaps:
        states[start:stop] = CODE[State.NO_DATA]
    kept = []
    for finding in assessment.findings:
        cut = _cut(finding, gaps, timeline.dt)
        if cut is None:
            mine = states[finding.start : finding.stop]
            mine[mine == CODE[State(finding.mode.value)]] = CODE[State.NOT_ASSESSED]
        else:
            kept.append(cut)
    reasons = {State.NO_DATA: "nothing was recorded", **assessment.reasons}
    return replace(
        assessment,
        states=states,
        findings=tuple(kept),
        reasons=reasons,
        columns={name: _blank(column, gaps, timeline.size) for name, column in assessment.columns.items()},
    )


def _cut(finding: Finding, gaps: Sequence[Gap], dt: float) -> Finding | None:
    start, stop = finding.start, finding.stop
    settle = round(_SETTLE_S / dt)
    if stop - start < 2 * settle and any(b <= start < b + settle for _, b in gaps):
        return None  # delays and lags are not yet filled with what came after the gap
    inside = [(a, b) for a, b in gaps if a < stop and b > start]
    if not inside:
        return finding
    gone = sum(min(b, stop) - max(a, start) for a, b in inside)
    if stop - start - gone < _LEAST_SEEN * (stop - start):
        return None
    sentences = []
    if inside[0][0] <= start:
        start = inside[0][1]
        sentences.append(
            f"Nothing was recorded for {(inside[0][1] - inside[0][0]) * dt:.2f} s before it: it may have begun then."
        )
    if inside[-1][1] >= stop:
        stop = inside[-1][0]
        sentences.append(
            f"Nothing was recorded for {(inside[-1][1] - stop) * dt:.2f} s after it: it may have lasted on."
        )
    if stop <= start:
        return None
    seen = finding.detected
    detected = None if seen is None else min(max(seen, start), stop - 1)
    return replace(finding, start=start, stop=stop, detected=detected, evidence=(*finding.evidence, *sentences))


def _blank(column: NDArray[np.floating], gaps: Sequence[Gap], size: int) -> NDArray[np.floating]:
    """A column of evidence with nothing in the gaps."""
    bucket = bucket_of(size)
    out = np.array(column)
    for start, stop in gaps:
        rows = slice(start, stop) if bucket == 1 else slice(2 * -(-start // bucket), 2 * (stop // bucket))
        out[rows] = np.nan
    return out
