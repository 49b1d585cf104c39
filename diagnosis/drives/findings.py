"""Rows of the sensor's table on a speed beside the one that the effort implies: runs, evidence, ε̂ and saturation term."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import BLIND, PAIR
from diagnosis.channels.zero_level import zero_level
from diagnosis.drives.models import ROW, RowModel
from diagnosis.drives.path import most_probable, state_evidence
from diagnosis.drives.speed_pair import SpeedPair
from diagnosis.estimation.fault_models import (
    HEALTHY,
    NO_SIGNAL,
    SCALED_ROWS,
    STUCK,
    TOTAL_ROWS,
    VARYING_ROWS,
    ModeModel,
)
from diagnosis.estimation.fault_size import estimate_fault
from diagnosis.estimation.row_probability import row_probabilities
from diagnosis.estimation.segments import Run, merge_equal
from diagnosis.results.assessment import Finding
from diagnosis.results.fault_rows import ROWS, codes
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, Sentence, lasting
from diagnosis.results.sizes import kept_to, probable_words
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

_SOFT = codes(lambda mode: not mode.total, Side.SENSOR)
#: Rows that states on the grid stand for.
_KNOWN = tuple(int(row) for row in np.unique(ROW))
_BRIEF_S = 0.3  # a soft run this short beside a longer one is part of it
_GAP_S = 0.15
_SHORTEST_SOFT_S = 0.2
_SHORTEST_HARD = 5  # samples without change that count at least
_EDGE_S = 0.1


@dataclass(frozen=True, eq=False)
class Isolated:
    """A run with its row.

    Attributes
    ----------
    run : Run
        Samples and row.
    y, x : Array, shape (m,)
        Measured and implied speed of the samples that count [m/s].
    p : Array, shape (rows,)
        Probability of each row.
    gain : float
        Log-evidence of the row against healthy.
    """

    run: Run
    y: Array
    x: Array
    p: Array
    gain: float

    @property
    def deviation(self) -> float:
        """Root mean square of y − x [m/s]; 0 where there is none."""
        beside = self.y[np.isfinite(self.x)] - self.x[np.isfinite(self.x)]
        return float(np.sqrt(np.mean(beside**2))) if beside.size else 0.0


def find_rows(pair: SpeedPair, limits: Limits) -> tuple[list[Finding], Array, int]:
    """Find faults of the speed's channel.

    Returns
    -------
    findings : list[Finding]
        In order of time.
    lead : Array, shape (n,)
        Causal log-odds of a fault.
    below : int
        How many deviations lie below the limits.
    """
    model = pair.model()
    row, lead = most_probable(pair.samples, model)
    cut = np.flatnonzero(np.r_[True, row[1:] != row[:-1]])
    runs = [Run(int(a), int(b), int(row[a])) for a, b in zip(cut, np.r_[cut[1:], row.size], strict=True)]
    out, below = [], 0
    for run in merged_runs(runs, pair.dt):
        isolated = _isolated(run, pair, model, limits)
        finding = None if isolated is None else _finding(isolated, pair, model, limits, lead)
        if finding is None:
            below += 1
        else:
            out.append(finding)
    return out, lead, below


def merged_runs(runs: list[Run], dt: float) -> list[Run]:
    """Faulty runs: soft ones separated by little are one, brief ones belong to the longer one that they touch.

    `dt` in s.
    """
    gap, brief = max(2, round(_GAP_S / dt)), max(3, round(_BRIEF_S / dt))
    runs = merge_equal(runs, gap, _SOFT)
    changed = True
    while changed:
        changed = False
        for k in range(1, len(runs)):
            a, b = runs[k - 1], runs[k]
            if HEALTHY in (a.row, b.row):
                continue
            short, long = (a, b) if a.size <= b.size else (b, a)
            if short.row in _SOFT and (short.size < brief or long.row in _SOFT):
                runs[k - 1 : k + 1] = [Run(a.start, b.stop, long.row)]
                changed = True
                break
        runs = merge_equal(runs, gap, _SOFT)
    return [run for run in runs if run.row != HEALTHY]


def _isolated(run: Run, pair: SpeedPair, model: RowModel, limits: Limits) -> Isolated | None:
    """Row of a run and the evidence for it; None where that is thin."""
    samples = pair.samples.part(run.start, run.stop)
    paired = samples.status == PAIR
    use = paired | (samples.status == BLIND)
    by_state = state_evidence(samples, model, _last_before(pair, run.start))
    evidence = np.array([by_state[i == ROW].max(initial=-np.inf) for i in range(len(ROWS))])
    row = run.row
    if row in _SOFT:
        if np.count_nonzero(paired) < max(5, _SHORTEST_SOFT_S / pair.dt):
            return None  # too little of it has an implied speed beside it
        use = paired
        row = max(_SOFT, key=lambda r: float(evidence[r]))
    elif use.any() and np.count_nonzero(use) < _SHORTEST_HARD:
        return None
    y, x = samples.y[use], samples.x[use]
    gain = float(evidence[row] - evidence[HEALTHY])
    if gain < thinnest(model.switch_cost, ends=run.stop < pair.samples.y.size):
        return None
    if row == STUCK and abs(float(np.mean(y))) <= max(3 * model.constant_noise, zero_level(model.span, limits.min_sat)):
        row = NO_SIGNAL
    p = row_probabilities(evidence)
    if row == NO_SIGNAL:
        p[NO_SIGNAL] += p[STUCK]
        p[STUCK] = 0.0
    return Isolated(replace(run, row=row), y, x, p, gain)


def thinnest(switch_cost: float, *, ends: bool) -> float:
    """Least log-evidence of a finding: into its row and out of it again; one that lasts to the end of the log need not end.

    Log-evidences, without a unit [1].
    """
    return (2.0 if ends else 1.5) * switch_cost


def _last_before(pair: SpeedPair, start: int) -> float:
    """Last sample of the speed before a step; NaN for none."""
    before = pair.samples.y[:start][np.isin(pair.samples.status[:start], (PAIR, BLIND))]
    return float(before[-1]) if before.size else float("nan")


def _finding(isolated: Isolated, pair: SpeedPair, model: RowModel, limits: Limits, lead: Array) -> Finding | None:
    """A run as a finding; None where it lies below the limits."""
    run, p = isolated.run, isolated.p
    estimate = estimate_fault(run.row, isolated.y, isolated.x, _filter_model(pair, model), "m/s", None)
    if estimate is None:
        return None
    epsilon, sat, delta = estimate
    mode = FaultMode(ROWS[run.row])
    if run.row in SCALED_ROWS:
        if delta > 1.0 + limits.min_epsilon or delta < -limits.min_epsilon:
            mode = FaultMode.OUTSIDE_TABLE
        elif epsilon is not None and epsilon.value < limits.min_epsilon:
            return None
    if run.row in VARYING_ROWS and math.sqrt(max(isolated.deviation**2 - pair.noise**2, 0.0)) < limits.min_sat:
        return None
    named = {run.row: mode.value}
    hypotheses = [Hypothesis(Side.SENSOR.value, named.get(row, ROWS[row].value), float(p[row])) for row in _KNOWN]
    raised = _detected(lead, run, max(3, round(_EDGE_S / pair.dt)))
    last = pair.samples.y.size - 1
    return Finding(
        start=run.start,
        stop=run.stop,
        side=Side.SENSOR,
        mode=mode,
        probability=float(p[run.row]),
        hypotheses=tuple(sorted(hypotheses, key=lambda h: -h.p)),
        epsilon=epsilon,
        sat=sat,
        evidence=_sentences(isolated, pair, delta),
        tier=Tier.DRIVE,
        detected=None if raised is None else min(max(raised + max(0, pair.lead), run.start), last),
    )


def _filter_model(pair: SpeedPair, model: RowModel) -> ModeModel:
    """The same noise for the estimate of ε and sat, which knows no late samples."""
    return ModeModel(
        noise=model.noise,
        constant_noise=model.constant_noise,
        tolerance=model.core,
        span=model.span,
        switch_cost=model.switch_cost,
        dt=pair.dt,
    )


def _detected(lead: Array, run: Run, slack: int) -> int | None:
    """First sample of a run from which on a fault is more probable than none by what was known then; None for never."""
    inside = lead[run.start : max(run.start + 1, run.stop - min(slack, run.size // 4))]
    calm = np.flatnonzero(inside <= 0)
    first = int(calm[-1]) + 1 if calm.size else 0
    return run.start + first if first < inside.size else None


def _sentences(isolated: Isolated, pair: SpeedPair, delta: float) -> tuple[str, ...]:
    """What decided, in figures."""
    row, y, x, deviation = isolated.run.row, isolated.y, isolated.x, isolated.deviation
    seconds = isolated.run.size * pair.dt
    out = []
    if row in TOTAL_ROWS and y.size:
        out.append(
            f"{pair.name} {kept_to(float(np.min(y)), float(np.max(y)), 'm/s')} for {lasting(seconds, 2)}, while the "
            f"drive was commanded; healthy samples differ by {plain(pair.noise, 2)} {{speed_unit}}."
        )
    elif row in TOTAL_ROWS:
        out.append(f"{pair.name} delivered nothing for {lasting(seconds, 2)} while the controller went on.")
    else:
        out.append(
            f"{pair.name} was {delta:.3f} times the speed that the controller answered to, over {lasting(seconds, 2)}; the rest has a "
            f"root mean square of {plain(float(np.sqrt(np.mean((y - delta * x) ** 2))))} {{speed_unit}}, healthy noise is {plain(pair.noise, 2)} {{speed_unit}}."
        )
    if deviation > pair.noise:
        out.append(
            f"The logged speed is not the one that the controller acted on (difference {plain(deviation)} {{speed_unit}} root mean square), "
            "so the drive follows its command and the channel of the speed is faulty."
        )
    out.append(Sentence(About.TIMES, f"{pair.name} is {probable_words(isolated.gain)}."))
    return tuple(out)
