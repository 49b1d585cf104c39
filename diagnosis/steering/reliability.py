"""How often findings on an axle that has its angle and command alone turn out right: their probability is not above that.

The filters' evidence knows their own models alone, and is sure of what these leave out: brief remainders of a fault, stretches
beside another one, two faults at once. `_WEIGHTS` is a logistic regression of what was right among the findings on simulated
machines of the structures for tuning; ``tests/benchmarks/calibrate_steering.py`` fits it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.excitation import asked as moving
from diagnosis.steering.path import AxleFilter
from diagnosis.steering.side_findings import SideFindings, span_of
from replay.faults import FaultMode, Side, State

_WEIGHTS = (-4.46, 4.72, -2.24, -0.69, -0.99)  # constant, and of `features_of`
_LONG_S = 6.0  # from here on a finding gains nothing by being longer
_NEAR_S = 1.0
_OVERLAP = 0.2
_ASKED, _PEAK = 0.01, 0.98  # of full opening: a command below this, but for its peaks, asks for nothing
_KNOWN, _OBEYED = (
    0.9,
    0.02,
)  # share of blocks with an opening, and how far from its command one lies that obeys, of full opening
_MOVED_S = 0.3  # for which a command must move its axle
_LEAST_TRAVEL = 0.03  # rad that a command must ask for: less is lost in a healthy dead band
_LEAST = 0.6  # probability from which a finding is stated

_PAIRED = 0.65  # how often a partial fault beside one of the other side was right: 18 of 28 on tuning seeds
_VALVE = 0.6  # how often a loss of a valve alone was the valve's: 7 of 11 in campaigns
_SENSOR_ALIKE = "An angle that is read as so much less would change as slowly: 60 of 100 such losses were the valve's on simulated machines."
_NOTHING, _MAYBE = (
    0.1,
    0.6,
)  # a loss of which no more is sure, and its probability: of 72 losses on tuning seeds four were so, two of them wrong
_FROM_NONE = "Its own bounds hardly tell this loss from none, which makes it less probable."
_SORT = "Findings of this length and company"
_BESIDE = "Partial faults found beside one of the other side"

#: A stretch: first and last moment [s], or samples.
Stretch = tuple[float, float]


def features_of(
    own: Stretch, mode: FaultMode, same: Sequence[Stretch], other: Sequence[Stretch]
) -> NDArray[np.float64]:
    """What tells how reliable a finding is, shape (4,).

    Parameters
    ----------
    own, mode
        The finding.
    same, other : Sequence[tuple[float, float]]
        Other findings on its side of the axle, and those on the other side.

    Returns
    -------
    NDArray[np.float64]
        Logarithm of its length up to 6 s, whether another one of its side is near, whether one of the other side overlaps, and
        whether it is a loss.
    """
    start, stop = own
    near = any(a < stop + _NEAR_S and b > start - _NEAR_S for a, b in same)
    shared = max((min(b, stop) - max(a, start) for a, b in other), default=0.0)
    loss = mode in (FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT)
    length = max(stop - start, 0.05)
    return np.array([np.log(min(length, _LONG_S)), near, shared > _OVERLAP * length, loss], dtype=np.float64)


def commanded(valve: SideFindings, command: NDArray[np.float64], axle: AxleFilter) -> SideFindings:
    """The valve's findings without those of a valve that is said to give too little while hardly anything is asked of it.

    An opening that is measured, and lies where its command is, refutes them; else they stay unexplained.

    Parameters
    ----------
    valve : SideFindings
        Of one axle.
    command : NDArray[np.float64], shape (n,)
        Of its valve [fraction].
    axle : AxleFilter
        The axle: where its command moves it by more than the sensor's noise, and where its valve's opening follows, or not,
        the command's jitter.
    """
    length, share = axle.blocks.length, axle.blocks.redundancy.share
    kept, open_, refuted = [], list(valve.unexplained), list(valve.refuted)
    for f in valve.findings:
        asked = np.abs(command[f.start : f.stop])
        asked = asked[np.isfinite(asked)]
        lacks = f.mode in (FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT)
        blocks = span_of(f, length)
        jitter_tells = bool(np.isfinite(share[slice(*blocks)]).any())
        moved = jitter_tells or (moving(axle, *blocks)[2] >= _MOVED_S and _travel(axle, *blocks) >= _LEAST_TRAVEL)
        if lacks and not (asked.size and float(np.quantile(asked, _PEAK)) >= _ASKED and moved):
            (refuted if _obeyed(axle, *blocks) else open_).append(blocks)
        else:
            kept.append(f)
    return SideFindings(tuple(kept), tuple(open_), tuple(refuted))


def _obeyed(axle: AxleFilter, start: int, stop: int) -> bool:
    """Whether a valve's opening is measured all through blocks [start, stop), and but for its peaks lies where its command is."""
    twice = axle.blocks.redundancy
    apart = np.abs(twice.opening[start:stop] - twice.command[start:stop])
    known = np.isfinite(apart)
    return float(np.mean(known)) >= _KNOWN and float(np.quantile(apart[known], _PEAK)) <= _OBEYED


def _travel(axle: AxleFilter, start: int, stop: int) -> float:
    """How far a healthy valve would turn its axle in blocks [start, stop), between the extremes [rad]."""
    angle = np.cumsum(np.nan_to_num(axle.driven.command[start:stop])) * axle.blocks.dt
    return float(np.ptp(angle)) if angle.size else 0.0


def weighed(found: Mapping[Side, SideFindings], length: int, dt: float) -> dict[Side, SideFindings]:
    """Findings of both sides of an axle with the probability that such findings deserve; unlikely ones stay open.

    Parameters
    ----------
    found : Mapping[Side, SideFindings]
        By side.
    length : int
        Samples per block.
    dt : float
        Sample [s].
    """
    spans = {side: [(f.start * dt, f.stop * dt) for f in one.findings] for side, one in found.items()}
    out = {}
    for side, one in found.items():
        kept, open_ = [], list(one.unexplained)
        others = [s for who, stretches in spans.items() if who is not side for s in stretches]
        for k, f in enumerate(one.findings):
            same = [s for j, s in enumerate(spans[side]) if j != k]
            mine = (
                f
                if f.tier is Tier.SIGNAL
                else _as_usual(f, _usually(features_of(spans[side][k], f.mode, same, others)), _SORT)
            )
            if mine.probability >= _LEAST:
                kept.append(_or_sensor(mine) if f.tier is not Tier.SIGNAL else mine)
            else:
                open_.append(span_of(f, length))
        out[side] = SideFindings(tuple(kept), tuple(open_))
    return out


def lost_by_model(found: Mapping[Side, SideFindings], length: int, dt: float) -> dict[Side, SideFindings]:
    """Findings of an axle whose opening is measured and whose angle is not; a loss of the sensor alone deserves what `weighed` gives.

    A brief want of oil looks like a loss of the sensor to a model that knows the opening: a valve that obeys cannot have it.
    Arguments as of `weighed`.
    """
    sensor = found[Side.SENSOR]
    lost = tuple(f for f in sensor.findings if f.mode is FaultMode.INEFFICIENT)
    told = weighed(found, length, dt)[Side.SENSOR]
    likely = {(f.start, f.stop): f for f in told.findings}
    kept = tuple(
        f if f not in lost else likely[f.start, f.stop]
        for f in sensor.findings
        if f not in lost or (f.start, f.stop) in likely
    )
    open_ = [span_of(f, length) for f in lost if (f.start, f.stop) not in likely]
    return {**found, Side.SENSOR: sensor._replace(findings=kept, unexplained=(*sensor.unexplained, *open_))}


def paired(found: Mapping[Side, SideFindings]) -> dict[Side, SideFindings]:
    """Findings of both sides of an axle that has second measurements: partial ones beside one of the other side are uncertain.

    What a stuck valve or a noisy angle leaves unexplained looks like a small loss or a disturbance of the other side.
    """
    out = dict(found)
    for side, one in found.items():
        others = [(f.start, f.stop) for who, of in found.items() if who is not side for f in of.findings]
        kept = tuple(
            _as_usual(f, _PAIRED, _BESIDE) if not f.mode.total and _shared((f.start, f.stop), others) else f
            for f in one.findings
        )
        out[side] = one._replace(findings=kept)
    return out


def told_from_none(found: Mapping[Side, SideFindings]) -> dict[Side, SideFindings]:
    """Findings of both sides of an axle; a loss whose bounds reach down to hardly any is no surer than may be.

    A model that is wrong by a lag makes much of one brief motion, of which a loss of any size explains as much.
    """

    def no_surer(f: Finding) -> Finding:
        vague = f.mode is FaultMode.INEFFICIENT and f.epsilon is not None and f.epsilon.low < _NOTHING
        return limited(f, _MAYBE, _FROM_NONE) if vague else f

    return {side: one._replace(findings=tuple(map(no_surer, one.findings))) for side, one in found.items()}


def _shared(own: Stretch, others: Sequence[Stretch]) -> bool:
    """Whether another stretch covers some of a stretch."""
    return max((min(b, own[1]) - max(a, own[0]) for a, b in others), default=0.0) > _OVERLAP * (own[1] - own[0])


def _or_sensor(finding: Finding) -> Finding:
    """A loss of a valve as what it may be as well: an angle that loses as much changes as slowly, but for a step at its onset.

    The loss is one of the sensor where its gain fades, or the axle was straight when it began.
    """
    if finding.side is not Side.ACTUATOR or finding.mode is not FaultMode.INEFFICIENT or finding.probability <= _VALVE:
        return finding
    least = limited(finding, _VALVE, _SENSOR_ALIKE)
    moved = finding.probability - _VALVE
    sensor = Hypothesis(Side.SENSOR.value, finding.mode.value, moved)
    named = [replace(h, p=max(0.0, h.p - moved)) if h.mode == State.HEALTHY.value else h for h in least.hypotheses]
    return replace(least, hypotheses=tuple(sorted([*named, sensor], key=lambda h: -h.p)))


def _usually(features: NDArray[np.float64]) -> float:
    """Share of findings of this sort that were right."""
    return float(1.0 / (1.0 + np.exp(-_WEIGHTS[0] - features @ np.array(_WEIGHTS[1:]))))


def _as_usual(finding: Finding, share: float, words: str) -> Finding:
    """A finding that is no more probable than findings of its sort are right."""
    return limited(finding, share, f"{words} were right in {100 * share:.0f} of 100 cases on simulated machines.")
