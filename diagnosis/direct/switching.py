"""How valves switch is no noise of one of them: spikes of as large a size on several valves, or at one opening, and a motion that comes late.

A bank of on/off valves that open and close unequally fast passes through another opening from one step to the next, for some milliseconds,
and one that shuts before it reverses is late then.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.low_speed import left_open
from diagnosis.results.assessment import Assessment, Finding
from replay.faults import FaultMode

Array = NDArray[np.float64]

_SPIKES, _OUTLIER, _EXPLAINED = 0.15, 6.0, 0.8  # of the samples; times the usual deviation; of the power
_ALIKE, _VALVES = 2.0, 2  # times as large at most; so many
_BRIEF_S, _LATEST_S, _STEP_S = 3.0, 0.3, 0.02  # of noise; of a motion; from trial to trial
_ONE, _PART, _MOMENT_S = (
    0.02,
    0.5,
    1.0,
)  # of full opening; of the time, that its command is there; shorter findings need not show that
_LEAVES = 0.7  # of the root mean square, which lateness leaves: 0.85 and more of true noise (six machines, tuning)


def without_switching(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment]
) -> dict[str, Assessment]:
    """Assessments of valves without brief noise that is a late motion, and noise of few spikes that several valves have of about one size, or that come at one opening.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Positions beside their commands, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    """
    sizes = {
        (w, f.start): size
        for w, a in assessments.items()
        for f in a.findings
        if f.mode is FaultMode.NOISY and (size := _spikes(found[w], f)) is not None
    }

    def shared(w: str, f: Finding) -> bool:
        own = sizes.get((w, f.start))
        if own is None or f.mode is not FaultMode.NOISY:
            return False
        alike = {v for (v, _), size in sizes.items() if 1.0 / _ALIKE <= size / own <= _ALIKE}
        return len(alike) >= _VALVES

    return {
        w: left_open(
            a, [f for f in a.findings if shared(w, f) or _is_late(found[w], f) or _at_one_opening(found[w], f)]
        )
        for w, a in assessments.items()
    }


def _is_late(one: IdentifiedPair, f: Finding) -> bool:
    """Whether brief noise of a position is its command some hundredths of a second ago."""
    dt = one.pair.dt
    if f.mode is not FaultMode.NOISY or (f.stop - f.start) * dt >= _BRIEF_S:
        return False
    most, step = round(_LATEST_S / dt), max(1, round(_STEP_S / dt))
    first = max(0, f.start - most)
    y, x, status, *_ = one.samples.part(first, f.stop)
    part = np.arange(f.start - first, y.size)
    left = []
    for late in range(0, min(most, f.start - first) + 1, step):
        use = (status[part] == PAIR) & (status[part - late] == PAIR)
        off = (y[part] - x[part - late])[use]
        left.append(float(np.mean(off * off)) if off.size else np.inf)
    return len(left) > 1 and min(left[1:]) < _LEAVES**2 * left[0]


def _at_one_opening(one: IdentifiedPair, f: Finding) -> bool:
    """Whether all spikes of a position's noise, of one size, come while its command passes one opening, at which its valves take turns."""
    y, x, status, *_ = one.samples.part(f.start, f.stop)
    use = (status == PAIR) & np.isfinite(y) & np.isfinite(x)
    if f.mode is not FaultMode.NOISY or not use.any():
        return False
    asked = x[use]
    sizes, spikes, explained = _outliers((y - x)[use])
    if not explained or float(np.max(sizes[spikes])) > _ALIKE * float(np.min(sizes[spikes])):
        return False
    low, high = (float(z) for z in (np.min(asked[spikes]), np.max(asked[spikes])))
    there = float(np.mean((asked >= low) & (asked <= high)))
    return high - low <= _ONE * one.pair.span and (there <= _PART or (f.stop - f.start) * one.pair.dt < _MOMENT_S)


def _spikes(one: IdentifiedPair, f: Finding) -> float | None:
    """Size of the spikes that make a position's noise [unit]; None where it is no such noise."""
    y, x, status, *_ = one.samples.part(f.start, f.stop)
    use = (status == PAIR) & np.isfinite(y) & np.isfinite(x)
    if not use.any():
        return None
    sizes, spikes, explained = _outliers((y - x)[use])
    few = np.count_nonzero(spikes) <= _SPIKES * sizes.size
    return float(np.median(sizes[spikes])) if few and explained else None


def _outliers(off: Array) -> tuple[Array, NDArray[np.bool_], bool]:
    """How far deviations lie from their median, which of them are spikes, each of shape (n,), and whether these make up nearly all of it."""
    sizes = np.abs(off - np.median(off))
    spikes = sizes > max(_OUTLIER * 1.4826 * float(np.median(sizes)), 1e-9)
    return sizes, spikes, bool(spikes.any() and np.sum(sizes[spikes] ** 2) > _EXPLAINED * np.sum(sizes**2))
