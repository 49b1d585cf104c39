"""From the path through the rows to findings: runs with their ends, row, ε̂, saturation term, probability and evidence."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import BLIND, PAIR
from diagnosis.direct.fault_runs import fault_runs
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.isolation import Isolated, estimate_run, isolate
from diagnosis.direct.onset import refine
from diagnosis.direct.sentences import BOUNDS, OF_SAT, alike_sentence, sentences
from diagnosis.direct.timing import timing_explains
from diagnosis.estimation.fault_models import HEALTHY, INEFFICIENT, STUCK, TOTAL_ROWS, VARYING_ROWS
from diagnosis.estimation.one_cause import with_one_cause
from diagnosis.estimation.segments import Run, with_leads
from diagnosis.estimation.simple_causes import Measured
from diagnosis.estimation.spikes import with_spikes
from diagnosis.estimation.viterbi import ModePath
from diagnosis.results.assessment import Finding
from diagnosis.results.fault_rows import ROWS, codes_of
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Flags = NDArray[np.bool_]

_SHORTEST_S = 0.01
_HOLD_S = 0.1
_LEAD_S, _TAIL_S, _CHAIN_S = 0.3, 0.1, 0.05
_SETTLED_LAGS = 5.0  # after a fault a channel returns with its lag
_CLEAR = 3.0  # times the noise
_LEFT_S = (
    0.03  # for which a command must leave the opening of a valve that is said to be stuck there, beside the valve's lag
)
_AS_TRUE = 0.03  # of what a sensor measures: as far off may a healthy one be
_LOST = 0.03  # of the span: as far from its command a healthy valve rests within its dead band
_HYSTERESIS, _RESTS_S = 0.025, 10.0  # of the span, off a healthy valve's command, for no longer than this
_MIDDLE, _MOSTLY = 0.04, 0.98  # of the span: about its middle a valve opens nothing; of the time
_ZERO = 0.01  # of the span: as far apart may two healthy instruments have their zero
_ALIKE_P = 0.3  # probability of each of two rows that a constant cannot tell
_ONE_GAIN, _SAME_P = 0.05, 0.95  # of a gain; that a share which is lost elsewhere too is one
_OPEN_S, _DOUBT, _FAR_OFF = 0.5, 0.05, 0.2  # s; probability of a healthy channel; of the span
_SLOW = 0.1  # of its mean, by which a reference changes that hardly moves
_SAME_SHARE = "The same share is lost in another fault of this part that shows it better; the bounds are of both."
_GROWTH_S = 0.1  # a shorter time of growth is not worth a sentence


@dataclass(frozen=True)
class FaultsFound:
    """What the runs of a path come to.

    Attributes
    ----------
    findings : list[Finding]
        In order of time.
    timing : list[Run]
        Runs that a delay or rounding explains.
    below : int
        Number of runs below the limits or with thin evidence.
    """

    findings: list[Finding]
    timing: list[Run]
    below: int


def find_faults(path: ModePath, found: IdentifiedPair, limits: Limits) -> FaultsFound:
    """Findings of a path.

    Parameters
    ----------
    path : ModePath
        Most probable rows.
    found : IdentifiedPair
        The pair.
    limits : Limits
        Smallest ε and saturation term that count.
    """
    dt, size = found.pair.dt, path.model.size
    shortest = max(3, round(_SHORTEST_S / dt))
    told = {
        run: None if run.row in VARYING_ROWS else finding_of(run, found, limits)
        for run in fault_runs(path, found.samples, found.model, dt, shortest, found.relation.play)
    }
    # a gain within the limits is none: what varies beside it does not lead up to it
    runs = [run for run, finding in told.items() if run.row in VARYING_ROWS or finding is not None]
    returns = _TAIL_S + _SETTLED_LAGS * (found.relation.lag + max(0.0, found.relation.delay * dt))
    chained = with_leads(runs, *(max(2, round(s / dt)) for s in (_LEAD_S, returns, _CHAIN_S)))
    open_ = [run for run, f in told.items() if f is None and run.row in TOTAL_ROWS and _left_open(run, found, limits)]
    findings, timing, below = [], open_, len(told) - len(runs)
    for i, (main, start, stop) in enumerate(chained):
        before, after = chained[i - 1][2] if i else 0, chained[i + 1][1] if i + 1 < len(chained) else size
        limit = (before if start == main.start else main.start, after if stop == main.stop else main.stop)
        run = _refined(main, found, limit)
        finding = told.get(run) or finding_of(run, found, limits)
        if finding is None:
            below += 1
        elif timing_explains(found, run, finding.mode):
            timing.append(run)
        else:
            whole = Run(
                min(start, run.start) if start < main.start else run.start,
                max(stop, run.stop) if stop > main.stop else run.stop,
                run.row,
            )
            findings.append(_widened(finding, run, whole, dt, _detected(path, whole, dt, shortest, found.lag)))
    beside = [_as_beside(f, findings, found) for f in findings]
    measured = _measured(found, limits)
    return FaultsFound(with_one_cause(with_spikes(beside, measured), measured), timing, below)


def _left_open(run: Run, found: IdentifiedPair, limits: Limits) -> bool:
    """Whether a run that is no finding is nothing healthy either: it lasts, is far off its reference, and is by no means a healthy channel."""
    if (run.stop - run.start) * found.pair.dt < _OPEN_S or (seen := isolate(run, found, _least(found, limits))) is None:
        return False
    return float(seen.p[HEALTHY]) < _DOUBT and seen.seen.deviation > _FAR_OFF * found.pair.span


def _measured(found: IdentifiedPair, limits: Limits) -> Measured:
    """The pair as one cause is looked for in it."""
    pair, (y, x, status, *_) = found.pair, found.samples
    use = np.isin(status, (PAIR, BLIND))
    return Measured(y, x, use, pair.dt, (pair.y_name, pair.x_name), pair.unit, found.model.noise, _least(found, limits))


def _least(found: IdentifiedPair, limits: Limits) -> float:
    """Smallest constant that counts [unit of y]."""
    return limits.min_sat if found.pair.side is Side.SENSOR else limits.min_opening * found.pair.span


def finding_of(run: Run, found: IdentifiedPair, limits: Limits) -> Finding | None:
    """A run as a finding; None where it lies below the limits or the evidence is thin."""
    isolated = isolate(run, found, _least(found, limits))
    if isolated is None:
        return None
    mode = _mode_of(isolated, found, limits)
    if mode is None:
        return None
    pair, run, p = found.pair, isolated.run, isolated.p
    if p[HEALTHY] > p[run.row] or _hysteresis(isolated, found):
        return None
    ahead = [r for r in codes_of(pair.side) if r != HEALTHY and p[r] >= p[run.row]]
    p[ahead] = p[ahead].mean()  # what other rows explain as well is called by none of them more surely
    epsilon, sat, _ = isolated.estimate
    if epsilon is not None and mode is not FaultMode.OUTSIDE_TABLE:
        epsilon = epsilon.as_share()
    lines = sentences(isolated, found, mode, epsilon)
    share = _left_share(isolated)
    if run.row in (STUCK, INEFFICIENT) and isolated.seen.still and share is not None:
        # nothing moved: a constant value and a constant share of a constant are the same
        if run.row == STUCK or p[STUCK] > p[INEFFICIENT]:
            p[STUCK] = p[INEFFICIENT] = (p[STUCK] + p[INEFFICIENT]) / 2
        if run.row == STUCK:
            epsilon = Epsilon(1.0, 1.0 - share, 1.0)  # all, if it is stuck; else what is not left
        lines += (alike_sentence(found),)
    shift = max(0, round(found.lag)) if pair.side is Side.ACTUATOR else 0
    named = {run.row: mode.value}  # a gain beyond the table has the probability of the row that it was found by
    hypotheses = [
        Hypothesis(pair.side.value, named.get(row, ROWS[row].value), float(p[row])) for row in codes_of(pair.side)
    ]
    return Finding(
        start=max(0, run.start - shift),
        stop=max(1, run.stop - shift),
        side=pair.side,
        mode=mode,
        probability=float(p[run.row]),
        hypotheses=tuple(sorted(hypotheses, key=lambda h: -h.p)),
        epsilon=epsilon,
        sat=sat,
        evidence=lines,
        tier=Tier.DIRECT,
    )


def _hysteresis(isolated: Isolated, found: IdentifiedPair) -> bool:
    """Whether a valve rests about its middle where it is told to, or is off its command by no more than its hysteresis for a while."""
    pair, run, seen = found.pair, isolated.run, isolated.seen
    if pair.side is not Side.ACTUATOR or not seen.use.any():
        return False
    brief = (run.stop - run.start) * pair.dt < _RESTS_S
    both = np.maximum(np.abs(seen.y[seen.use]), np.abs(seen.x[seen.use]))
    rests = float(np.nanquantile(both, _MOSTLY)) < _MIDDLE * pair.span
    return rests or (brief and seen.deviation < _HYSTERESIS * pair.span)


def _as_beside(finding: Finding, all_of_them: Sequence[Finding], found: IdentifiedPair) -> Finding:
    """A share of a constant, or one of which little else is left, as what it is where the channel moved: the same loss of gain.

    A part that sticks does not stick at just that share of its command, and noise does not leave it.
    """
    p = {h.mode: h.p for h in finding.hypotheses}
    size, likely = finding.epsilon, p.get(FaultMode.INEFFICIENT, 0.0)
    if size is None:
        return finding
    lost = size.low if finding.mode is FaultMode.STUCK else size.value
    still = (
        finding.mode in (FaultMode.STUCK, FaultMode.INEFFICIENT)
        and likely == p.get(FaultMode.STUCK, 0.0)
        and likely >= _ALIKE_P
    )
    calm = finding.mode.varying and finding.sat is not None and finding.sat.rms * lost <= _LOST * found.pair.span
    share = _share_of_slow(finding, found) if finding.mode is FaultMode.STUCK and not still else None
    lost = lost if share is None else 1.0 - share
    beside = (f.epsilon for f in all_of_them if f.mode is FaultMode.INEFFICIENT and f.probability > 2 * _ALIKE_P)
    if not (still or calm or share is not None) or not any(
        e is not None and abs(e.value - lost) <= _ONE_GAIN for e in beside
    ):
        return finding
    both = 2 * likely if still else likely + p[finding.mode]
    p |= {FaultMode.STUCK if still else finding.mode: (1.0 - _SAME_P) * both, FaultMode.INEFFICIENT: _SAME_P * both}
    bounds = f"(95 %: {1 - lost - _ONE_GAIN:.3f} to {1 - lost + _ONE_GAIN:.3f})"
    said = (e for e in finding.evidence if OF_SAT not in e)
    return replace(
        finding,
        mode=FaultMode.INEFFICIENT,
        probability=p[FaultMode.INEFFICIENT],
        hypotheses=tuple(sorted((replace(h, p=p[h.mode]) for h in finding.hypotheses), key=lambda h: -h.p)),
        epsilon=Epsilon(lost, lost - _ONE_GAIN, lost + _ONE_GAIN),
        sat=None,
        evidence=(*(re.sub(BOUNDS, bounds, e) for e in said), _SAME_SHARE),
    )


def _share_of_slow(finding: Finding, found: IdentifiedPair) -> float | None:
    """What a value is of a reference that moves by little meanwhile [1]; None where it is no share of it."""
    y, x, status, *_ = found.samples.part(finding.start, finding.stop)
    y, x = y[status == PAIR], x[status == PAIR]
    middle = float(np.mean(x)) if x.size else 0.0
    if middle == 0.0 or float(np.std(x)) > _SLOW * abs(middle):
        return None
    share = float(np.mean(y)) / middle
    return share if 0.0 < share < 1.0 else None


def _left_share(isolated: Isolated) -> float | None:
    """What a constant value is of a reference that hardly moves [1]; None where it is no share of it."""
    seen = isolated.seen
    x, y = (float(np.mean(c[seen.use])) if seen.use.any() else 0.0 for c in (seen.x, seen.y))
    share = y / x if x != 0.0 else np.inf
    return share if 0.0 <= share <= 1.0 else None


def _mode_of(isolated: Isolated, found: IdentifiedPair, limits: Limits) -> FaultMode | None:
    """Mode of an isolated run; None where it lies below the limits or may be noise."""
    seen, noise = isolated.seen, isolated.seen.noise
    mode = FaultMode(ROWS[isolated.run.row])
    if mode.scaled:
        return _mode_of_gain(isolated, noise, found, limits)
    if mode.varying:
        counts = limits.min_sat / 2 if found.pair.side is Side.SENSOR else _least(found, limits)
        least = max(2.5 * found.model.noise, 1.5 * noise, counts)
        return None if seen.deviation < least else mode
    # a reference that hardly moves is as constant
    away = np.count_nonzero(np.abs(seen.y - seen.x)[seen.use] > _CLEAR * noise) * found.pair.dt
    if found.pair.side is Side.ACTUATOR:
        relation = found.relation
        returns = _LEFT_S + 2.0 * (relation.lag + max(0.0, relation.delay * found.pair.dt))
        # a relation found in the mission is no truer than half a saturation term
        least = max(_CLEAR * noise, _LOST * found.pair.span, limits.min_sat / 2)
        return None if seen.deviation < least or away < returns else mode
    # what leaves its place for a sample now and then, as a noisy reference does at rest, moves nothing
    lasts = _longest(np.abs(seen.y - seen.x)[seen.use] > _CLEAR * noise) * found.pair.dt
    if np.isfinite(seen.y).any() and lasts < min(_LEFT_S, 0.5 * isolated.run.size * found.pair.dt):
        return None
    known = seen.x[seen.use]
    if seen.deviation < _AS_TRUE * (float(np.sqrt(np.mean(known**2))) if known.size else 0.0):
        return None
    at_rest = known.size and max(seen.deviation, float(np.max(np.abs(known)))) < limits.min_sat / 2
    return None if at_rest else mode  # it repeats what it had, which is true


def _longest(there: Flags) -> int:
    """Length of the longest stretch."""
    edge = np.flatnonzero(np.diff(np.r_[False, there, False].astype(np.int8)))
    return int(np.max(edge[1::2] - edge[::2], initial=0))


def _mode_of_gain(isolated: Isolated, noise: float, found: IdentifiedPair, limits: Limits) -> FaultMode | None:
    """Inefficient, or outside the table where the gain is; None where ε is too small or nothing moves."""
    epsilon, _, delta = isolated.estimate
    outside = delta > 1.0 + limits.min_epsilon or delta < -limits.min_epsilon
    if not outside and epsilon is not None and epsilon.value < limits.min_epsilon:
        return None
    reference = isolated.seen.x[isolated.seen.use]
    if abs(1.0 - delta) * math.sqrt(float((reference**2).mean())) < max(0.5 * noise, _ZERO * found.pair.span):
        return None  # what is lost of hardly anything is the reference's own noise, or where both have their zero
    return FaultMode.OUTSIDE_TABLE if outside else FaultMode.INEFFICIENT


def _refined(run: Run, found: IdentifiedPair, between: tuple[int, int]) -> Run:
    """A noisy run with its ends where its own gain puts them."""
    estimate = estimate_run(run, found) if run.row in VARYING_ROWS else None
    return run if estimate is None else refine(run, found.samples, estimate[2], found.model, *between)


def _widened(finding: Finding, run: Run, whole: Run, dt: float, detected: int | None) -> Finding:
    """A finding with the time in which it grew or faded, and the moment at which it was raised."""
    evidence = finding.evidence
    if run.start - whole.start > _GROWTH_S / dt:
        evidence += (f"Before that it grew for {(run.start - whole.start) * dt:.2f} s.",)
    return replace(
        finding,
        start=max(0, finding.start - (run.start - whole.start)),
        stop=finding.stop + (whole.stop - run.stop),
        evidence=evidence,
        detected=detected,
    )


def _detected(path: ModePath, run: Run, dt: float, slack: int, lag: float) -> int | None:
    """Sample at which the fault would have been raised causally: both y and the reference beside it have arrived."""
    raised = path.crossing(run.start, run.stop, slack, max(slack, round(_HOLD_S / dt)))
    return None if raised is None else min(raised + max(0, math.ceil(-lag)), path.model.size - 1)
