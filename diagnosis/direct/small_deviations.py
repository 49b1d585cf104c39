"""Small deviations that several valves of a machine have are how they are built and measured, and no fault of one of them.

Coils warm, supplies fall, and a position sensor has a zero and a gain of its own: each keeps a healthy valve some hundredths off its
command for long, which evidence that grows with time takes for a certain loss or noise. How far off valves usually are, and are
at the same time, is taken from the others; a finding that is no further off is left open, or healthy where it is hardly off at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.low_speed import left_open
from diagnosis.results.assessment import Assessment, Finding
from replay.arrays.numeric import without_nan
from replay.faults import FaultMode, State

_SMALL = 0.1  # of the span, root mean square: a larger deviation is none of a healthy valve, whatever is usual
_SMALL_OTHERS = 0.15  # the same while others are off as well
_SHARE, _SHARE_OTHERS = 0.2, 0.3  # of its command, likewise: by habit, and while others are off as well
_WINDOW_S, _KNOWN, _WINDOWS = 2.0, 0.25, 4  # s; of it, in which readings come; fewer windows show nothing
_USUAL, _BEYOND = 0.9, 1.8  # quantile of the windows, and times it
_BEYOND_OTHERS = 1.6  # times what the others are off meanwhile
_EITHER = 0.3  # probability of a share beside a constant
_HARDLY, _LOST = 0.08, 0.25  # of the command, root mean square; of ε: less than a loss that counts by default
_EXPECTED = 0.03  # of the span: what a valve's advice calls as expected
_VALVES = 3  # fewer show no habit


def without_small_deviations(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment]
) -> dict[str, Assessment]:
    """Assessments of valves without findings that are no further off than other valves usually are.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Positions beside their commands, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    """
    if not any(a.findings for a in assessments.values()):
        return dict(assessments)
    assessments = {w: left_open(a, _exact(a, found[w]), State.HEALTHY) for w, a in assessments.items()}
    if len(found) < _VALVES:
        return assessments
    usual = {w: _usual(one) for w, one in found.items()}
    out = {}
    for w, a in assessments.items():
        others = [other for other in found if other != w]
        most = max(usual[other] for other in others)
        small = [
            f
            for f in a.findings
            if _may_be_small(f) and _small(f, found[w], most, _meanwhile(f, [found[x] for x in others]))
        ]
        built = [f for f in small if _hardly_off(f, found[w])]
        out[w] = left_open(left_open(a, built, State.HEALTHY), [f for f in small if not any(f is b for b in built)])
    return out


def _exact(a: Assessment, one: IdentifiedPair) -> list[Finding]:
    """Noise, or what is in no row, of a position that is as near to its command as one may expect of a healthy valve."""
    steady = [f for f in a.findings if f.mode in (FaultMode.NOISY, FaultMode.OUTSIDE_TABLE) and _hardly_off(f, one)]
    return [f for f in steady if (off := _off(f, one)[0]) is not None and off < _EXPECTED * one.pair.span]


def _hardly_off(finding: Finding, one: IdentifiedPair) -> bool:
    """Whether a position that is off as others are is so by less than a tenth of its command, and has surely not lost a quarter of it."""
    off, asked = _off(finding, one)
    lost = finding.epsilon is not None and finding.epsilon.high >= _LOST
    return off is not None and not finding.mode.total and off < _HARDLY * asked and not lost


def _may_be_small(finding: Finding) -> bool:
    """Whether a finding is a share or noise, or may as well be a share: nothing moved."""
    return not finding.mode.total or any(h.mode == FaultMode.INEFFICIENT and h.p >= _EITHER for h in finding.hypotheses)


def _usual(one: IdentifiedPair) -> float:
    """How far a position usually is off where its valve opens, at most [unit]: of windows that no large deviation is in; 0 without any."""
    dt = one.pair.dt
    width = max(1, round(_WINDOW_S / dt))
    size = one.samples.y.size // width * width
    use = (one.samples.status[:size] == PAIR) & ~one.samples.quiet[:size]
    off = np.where(use, without_nan(one.samples.y[:size] - one.samples.x[:size]), 0.0).reshape(-1, width)
    count = np.count_nonzero(use.reshape(-1, width), axis=1)
    known_s = count * one.model.dt  # a position may be slower than the timeline
    size_of = np.sqrt((off**2).sum(axis=1) / np.maximum(count, 1))[known_s > _KNOWN * _WINDOW_S]
    small = size_of[size_of < _SMALL * one.pair.span]
    return float(np.quantile(small, _USUAL)) if small.size >= _WINDOWS else 0.0


def _meanwhile(finding: Finding, others: Sequence[IdentifiedPair]) -> float:
    """How far other positions are off during a finding [unit], by their median; 0 unless two are known."""
    off = [x for one in others if (x := _off(finding, one)[0]) is not None]
    return float(np.median(off)) if len(off) >= _VALVES - 1 else 0.0


def _off(finding: Finding, one: IdentifiedPair) -> tuple[float | None, float]:
    """Deviation of a position and its command during a finding, root mean square [unit]; None where nothing is known."""
    y, x, status, *_ = one.samples.part(finding.start, finding.stop)
    use = status == PAIR
    if not use.any():
        return None, 0.0
    off, asked = (float(np.sqrt(np.mean(z[use] ** 2))) for z in (y - x, x))
    return off, asked


def _small(finding: Finding, one: IdentifiedPair, usual: float, meanwhile: float) -> bool:
    """Whether a position is off by little beside what is usual, or meanwhile of others [unit], and by a small share of its command.

    Off by a constant, it is no share: what others are off by at the same time is the measure.
    """
    off, asked = _off(finding, one)
    by_habit = min(_BEYOND * usual, _SHARE * asked, _SMALL * one.pair.span)
    as_others = min(_BEYOND_OTHERS * meanwhile, _SHARE_OTHERS * asked, _SMALL_OTHERS * one.pair.span)
    if finding.mode is FaultMode.OUTSIDE_TABLE:
        as_others = min(_BEYOND_OTHERS * meanwhile, _SMALL * one.pair.span)
    return off is not None and off < max(by_habit, as_others)
