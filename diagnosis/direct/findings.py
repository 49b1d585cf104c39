"""From the path through the rows to findings: runs with their ends, row, ε̂, saturation term, probability and evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.channels.sample_status import BLIND, PAIR
from diagnosis.direct.fault_runs import fault_runs
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.isolation import Isolated, estimate_run, isolate
from diagnosis.direct.onset import refine
from diagnosis.direct.same_share import as_beside, as_excess_beside
from diagnosis.direct.same_value import in_one_row
from diagnosis.direct.sentences import END_SENTENCE, RANGE_SENTENCE, alike_sentence, sentences
from diagnosis.direct.slow_deviation import not_noise
from diagnosis.direct.stated_mode import least_constant, mode_of
from diagnosis.direct.stated_row import as_sure, of_a_constant
from diagnosis.direct.timing import timing_explains
from diagnosis.estimation.by_itself import told_by_itself
from diagnosis.estimation.changing_gain import as_changing_gain
from diagnosis.estimation.fault_models import HEALTHY, INEFFICIENT, STUCK, TOTAL_ROWS, VARYING_ROWS
from diagnosis.estimation.one_cause import with_one_cause
from diagnosis.estimation.one_delay import with_one_delay
from diagnosis.estimation.segments import Run, with_leads
from diagnosis.estimation.simple_causes import Measured
from diagnosis.estimation.spells import in_spells
from diagnosis.estimation.spikes import with_spikes
from diagnosis.estimation.viterbi import ModePath
from diagnosis.results.alike import hardly_moves, or_at_its_end, or_shifted
from diagnosis.results.assessment import Finding
from diagnosis.results.fault_rows import ROWS, codes_of
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.arrays.quantiles import median_of, quantile_known
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

_SHORTEST_S = 0.01
_HOLD_S = 0.1
_LEAD_S, _TAIL_S, _CHAIN_S = 0.3, 0.1, 0.05
_SETTLED_LAGS = 5.0  # after a fault a channel returns with its lag
_CLEAR = 3.0  # times the noise
_WITHIN_P = 0.7  # of noise whose root mean square stays below that, at most; all of it from one more time the noise on
_MOST_SHIFTED = 0.4  # of the span: no channel that lives is off by more
_END, _SAME_WAY = 0.97, 0.3  # of the span: where a valve stands, and at least what it is told, the same way
_LARGEST, _BEYOND = 0.999, 0.9  # of the largest reading; of the time
_LESS, _SHOWN = 0.9, 0.1  # of the largest reading, and of all: as many are less, of a sensor that lives
_HYSTERESIS, _RESTS_S = 0.025, 10.0  # of the span, off a healthy valve's command, for no longer than this
_MIDDLE, _MOSTLY = 0.04, 0.98  # of the span: about its middle a valve opens nothing; of the time
_OF_USUAL = 2.0  # times what it is off its command by, nearly all of the mission: its own hysteresis
_OPEN_S, _DOUBT, _FAR_OFF = 0.5, 0.05, 0.2  # s; probability that counts for nothing; of the span
_MOST_HEALTHY = 0.35  # that bounds of a loss which was found leave to a healthy channel: it deviates all the same
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
        if finding is None or (run.row in VARYING_ROWS and run.stop * dt <= returns):  # what came before is not known
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
    beside = [as_excess_beside(as_beside(f, findings, found), findings, found) for f in findings]
    measured = _measured(found, limits)
    joined = with_one_delay(with_one_cause(with_spikes(beside, measured), measured), measured)
    spells = [part for f in joined for part in in_spells(as_changing_gain(f, measured), measured)]
    kept = [told_by_itself(f, measured) for f in spells]
    return FaultsFound(
        in_one_row([not_noise(part, measured, found.pair.habit.window) for parts in kept for part in parts], measured),
        timing,
        below + sum(not parts for parts in kept),
    )


def _left_open(run: Run, found: IdentifiedPair, limits: Limits) -> bool:
    """Whether a run that is no finding is nothing healthy either: it lasts, is far off its reference, and is by no means a healthy channel."""
    if (run.stop - run.start) * found.pair.dt < _OPEN_S or (
        seen := isolate(run, found, least_constant(found, limits))
    ) is None:
        return False
    return float(seen.p[HEALTHY]) < _DOUBT and seen.seen.deviation > _FAR_OFF * found.pair.span


def _measured(found: IdentifiedPair, limits: Limits) -> Measured:
    """The pair as one cause is looked for in it."""
    pair, (y, x, status, *_) = found.pair, found.samples
    use = np.isin(status, (PAIR, BLIND))
    return Measured(
        y,
        x,
        use,
        pair.dt,
        (pair.y_name, pair.x_name),
        pair.unit,
        found.model.noise,
        least_constant(found, limits),
        limits.min_epsilon,
    )


def finding_of(run: Run, found: IdentifiedPair, limits: Limits) -> Finding | None:
    """A run as a finding; None where it lies below the limits or the evidence is thin."""
    isolated = isolate(run, found, least_constant(found, limits))
    if isolated is None:
        return None
    mode = mode_of(isolated, found, limits)
    if mode is None:
        return None
    pair, run, p = found.pair, isolated.run, isolated.p
    if p[HEALTHY] > p[run.row] or _hysteresis(isolated, found) or _unresolved(isolated, found):
        return None
    p = as_sure(p, run.row, pair.side)
    if run.row in VARYING_ROWS:
        times = isolated.seen.deviation / max(isolated.seen.noise, 1e-30)
        most = _WITHIN_P + (1.0 - _WITHIN_P) * max(times - _CLEAR, 0.0)
        more = max(float(p[run.row]) - most, 0.0)  # it deviates by hardly more than a healthy one may
        p[run.row] -= more
        p[HEALTHY] += more
    epsilon, sat, _ = isolated.estimate
    outside = run.row in VARYING_ROWS and mode is FaultMode.OUTSIDE_TABLE
    within = (
        1.0 - epsilon.exceeds_table(limits.min_epsilon) if epsilon is not None and outside else 0.0
    )  # a noisy one whose gain no row has
    if epsilon is not None and mode is FaultMode.INEFFICIENT:  # what its bounds leave to a healthy channel
        small = min(epsilon.below(limits.min_epsilon), _MOST_HEALTHY)
        p *= 1.0 - small
        p[HEALTHY] += small
        if p[HEALTHY] > p[run.row]:
            return None
    if epsilon is not None and mode is not FaultMode.OUTSIDE_TABLE:
        epsilon = epsilon.as_share()
    lines = sentences(isolated, found, mode, epsilon)
    share = _left_share(isolated)
    if run.row in (STUCK, INEFFICIENT) and isolated.seen.still and share is not None:
        # nothing moved: a constant value and a constant share of a constant are the same
        if run.row == STUCK or p[STUCK] > p[INEFFICIENT]:
            p = of_a_constant(p)
        if run.row == STUCK:
            epsilon = Epsilon(1.0, 1.0 - share, 1.0)  # all, if it is stuck; else what is not left
        if p[STUCK] > _DOUBT:
            lines += (alike_sentence(found),)
    shift = max(0, round(found.lag)) if pair.side is Side.ACTUATOR else 0
    named = {run.row: mode.value}  # a gain beyond the table has the probability of the row that it was found by
    noisy = [Hypothesis(pair.side.value, ROWS[run.row].value, within * float(p[run.row]))] if outside else []
    p[run.row] *= 1.0 - within
    p = as_sure(p, run.row, pair.side)
    hypotheses = [
        Hypothesis(pair.side.value, named.get(row, ROWS[row].value), float(p[row])) for row in codes_of(pair.side)
    ] + noisy
    told = Finding(
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
    if run.row != STUCK:
        return told
    if _at_its_end(isolated, found):
        return or_shifted(told, END_SENTENCE)
    if _beyond_its_range(isolated, found):
        return or_at_its_end(told, RANGE_SENTENCE)
    seen = isolated.seen
    stays = hardly_moves(seen.y[seen.use], seen.x[seen.use], _MOST_SHIFTED * pair.span)
    return or_shifted(told) if share is None and stays else told


def _unresolved(isolated: Isolated, found: IdentifiedPair) -> bool:
    """Whether a log too slow for its commands shows a moment that stays below the threshold: a command that flips from sample to sample."""
    brief = isolated.run.size * found.pair.dt < _OPEN_S
    return found.coarse and brief and isolated.seen.deviation < _CLEAR * isolated.seen.noise


def _hysteresis(isolated: Isolated, found: IdentifiedPair) -> bool:
    """Whether a valve rests about its middle where it is told to, or is off its command by no more than its hysteresis for a while."""
    pair, seen = found.pair, isolated.seen
    if pair.side is not Side.ACTUATOR or not seen.use.any():
        return False
    brief = int(np.count_nonzero(seen.use)) * found.model.dt < _RESTS_S  # a channel may be slower than the timeline
    both = np.maximum(np.abs(seen.y[seen.use]), np.abs(seen.x[seen.use]))
    rests = float(quantile_known(both, _MOSTLY)) < _MIDDLE * pair.span
    return rests or (brief and seen.deviation < min(_HYSTERESIS * pair.span, _OF_USUAL * found.usually_off))


def _at_its_end(isolated: Isolated, found: IdentifiedPair) -> bool:
    """Whether a valve stands at its end while its command, the same way, asks for less."""
    seen, span = isolated.seen, found.pair.span
    if found.pair.side is not Side.ACTUATOR or not seen.use.any():
        return False
    y, x = float(np.mean(seen.y[seen.use])), seen.x[seen.use] / span
    return abs(y) >= _END * span and bool(np.min(np.sign(y) * x) >= _SAME_WAY)


def _beyond_its_range(isolated: Isolated, found: IdentifiedPair) -> bool:
    """Whether a sensor stays at the largest reading that it ever shows while its reference is beyond that, the same way.

    It shows less elsewhere: one that is stuck for the whole mission has no other reading.
    """
    seen = isolated.seen
    if found.pair.side is not Side.SENSOR or not seen.use.any():
        return False
    y, x = seen.y[seen.use], seen.x[seen.use]
    most, sign = float(np.nanmax(np.abs(found.pair.y))), float(np.sign(median_of(y)))
    every = found.pair.y[np.isfinite(found.pair.y)]
    if float(np.mean(np.abs(every) < _LESS * most)) < _SHOWN:
        return False
    ends = float(np.mean(np.abs(y) >= _LARGEST * most)) > _BEYOND
    return ends and sign != 0.0 and float(np.mean(sign * x > np.abs(y) - _CLEAR * seen.noise)) > _BEYOND


def _left_share(isolated: Isolated) -> float | None:
    """What a constant value is of a reference that hardly moves [1]; None where it is no share of it."""
    seen = isolated.seen
    x, y = (float(np.mean(c[seen.use])) if seen.use.any() else 0.0 for c in (seen.x, seen.y))
    share = y / x if x != 0.0 else np.inf
    return share if 0.0 <= share <= 1.0 else None


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
