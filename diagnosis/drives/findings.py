"""Rows of the sensor's table on a speed beside the one that the effort echoes: runs, evidence, ε̂ and saturation term."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.drives.path import ROW, RowModel, most_probable, state_evidence
from diagnosis.estimation import fault_models
from diagnosis.estimation.fault_size import estimate_fault
from diagnosis.estimation.segments import Run, merge_equal
from diagnosis.results.assessment import Finding
from diagnosis.results.fault_rows import ROWS
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

_MODE = {
    fault_models.STUCK: FaultMode.STUCK,
    fault_models.NO_SIGNAL: FaultMode.NO_SIGNAL,
    fault_models.INEFFICIENT: FaultMode.INEFFICIENT,
    fault_models.NOISY: FaultMode.NOISY,
}
_SOFT = (fault_models.INEFFICIENT, fault_models.NOISY)
_MEAN_HEALTHY_S = 60.0
_BRIEF_S = 0.3  # a soft run this short beside a longer one is part of it
_GAP_S = 0.15
_SHORTEST_SOFT_S = 0.2
_SHORTEST_HARD = 5  # samples without change that count at least
_TEMPER = 0.25
_EDGE_S = 0.1
_LEAST_CORE = 0.2


@dataclass(frozen=True)
class EchoPair:
    """Measured speed beside the echoed one.

    Attributes
    ----------
    y, x : Array, shape (n,)
        Measured and echoed speed [m/s]; NaN where not valid.
    slack : Array, shape (n,)
        Standard deviation of what the echo may be off for long [m/s].
    status : NDArray[np.int8], shape (n,)
        As in `diagnosis.estimation.fault_models`.
    quiet : NDArray[np.bool_], shape (n,)
        Where the drive is neither commanded nor moving.
    lead : int
        Steps by which the echo comes later than the speed.
    noise, core, lsb : float
        Healthy noise of y − x, that of its exact samples, and the rounding step of y [m/s].
    exact : float
        Share of exact samples [1].
    span : float
        Largest plausible speed [m/s].
    dt : float
        Step [s].
    name : str
        Of the speed's channel.
    """

    y: Array
    x: Array
    slack: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    lead: int
    noise: float
    core: float
    exact: float
    lsb: float
    span: float
    dt: float
    name: str

    def model(self) -> RowModel:
        """Noise and prior of the path of rows."""
        return RowModel(
            noise=self.noise,
            core=max(self.core, _LEAST_CORE * self.noise),
            exact=self.exact,
            constant_noise=max(self.lsb / np.sqrt(12), self.noise / 50),
            span=self.span,
            switch_cost=float(np.log(_MEAN_HEALTHY_S / self.dt * 8)),
        )


def find_rows(pair: EchoPair, limits: Limits) -> tuple[list[Finding], Array, int]:
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
    row, lead = most_probable(pair.y, pair.x, pair.slack, pair.status, pair.quiet, model)
    cut = np.flatnonzero(np.r_[True, row[1:] != row[:-1]])
    runs = [Run(int(a), int(b), int(row[a])) for a, b in zip(cut, np.r_[cut[1:], row.size], strict=True)]
    out, below = [], 0
    for run in tidy(runs, pair.dt):
        finding = _finding(run, pair, model, limits, lead)
        if finding is None:
            below += 1
        else:
            out.append(finding)
    return out, lead, below


def tidy(runs: list[Run], dt: float) -> list[Run]:
    """Faulty runs: soft ones separated by little are one, brief ones belong to the longer one that they touch."""
    gap, brief = max(2, round(_GAP_S / dt)), max(3, round(_BRIEF_S / dt))
    runs = merge_equal(runs, gap, _SOFT)
    changed = True
    while changed:
        changed = False
        for k in range(1, len(runs)):
            a, b = runs[k - 1], runs[k]
            if fault_models.HEALTHY in (a.row, b.row):
                continue
            short, long = (a, b) if a.size <= b.size else (b, a)
            if short.row in _SOFT and (short.size < brief or long.row in _SOFT):
                runs[k - 1 : k + 1] = [Run(a.start, b.stop, long.row)]
                changed = True
                break
        runs = merge_equal(runs, gap, _SOFT)
    return [run for run in runs if run.row != fault_models.HEALTHY]


def _finding(run: Run, pair: EchoPair, model: RowModel, limits: Limits, lead: Array) -> Finding | None:
    """A run as a finding; None where it lies below the limits or the evidence is thin."""
    part = slice(run.start, run.stop)
    status = pair.status[part]
    use = (status == fault_models.PAIR) | (status == fault_models.BLIND)
    y, x = pair.y[part][use], pair.x[part][use]
    seconds = run.size * pair.dt
    before = pair.y[: run.start][np.isin(pair.status[: run.start], (fault_models.PAIR, fault_models.BLIND))]
    last = float(before[-1]) if before.size else float("nan")
    by_state = state_evidence(pair.y[part], pair.x[part], pair.slack[part], status, pair.quiet[part], model, last)
    evidence = np.array([by_state[i == ROW].max() for i in range(len(ROWS))])
    row = run.row
    if row in _SOFT:
        if np.count_nonzero(status == fault_models.PAIR) < max(5, _SHORTEST_SOFT_S / pair.dt):
            return None  # too little of it has an echo beside it
        y, x = pair.y[part][status == fault_models.PAIR], pair.x[part][status == fault_models.PAIR]
        row = (
            fault_models.NOISY
            if evidence[fault_models.NOISY] > evidence[fault_models.INEFFICIENT]
            else fault_models.INEFFICIENT
        )
    elif use.any() and y.size < _SHORTEST_HARD:
        return None
    gain = float(evidence[row] - evidence[fault_models.HEALTHY])
    # into the row and out of it again; a fault that lasts to the end of the log need not end
    if gain < (2.0 if run.stop < pair.y.size else 1.5) * model.switch_cost:
        return None
    if row == fault_models.STUCK and abs(float(np.mean(y))) <= max(3 * model.constant_noise, limits.min_sat):
        row = fault_models.NO_SIGNAL
    estimate = estimate_fault(row, y, x, _instrument(pair, model), "m/s", None)
    if estimate is None:
        return None
    epsilon, sat, delta = estimate
    mode = _MODE[row]
    if row == fault_models.INEFFICIENT:
        if delta > 1.0 + limits.min_epsilon or delta < -limits.min_epsilon:
            mode = FaultMode.OUTSIDE_TABLE
        elif epsilon is not None and epsilon.value < limits.min_epsilon:
            return None
    beside = y[np.isfinite(x)] - x[np.isfinite(x)]
    deviation = float(np.sqrt(np.mean(beside**2))) if beside.size else 0.0
    if row == fault_models.NOISY and math.sqrt(max(deviation**2 - pair.noise**2, 0.0)) < limits.min_sat:
        return None
    prior = np.log(np.array([0.8, 0.05, 0.05, 0.05, 0.05]))
    tempered = prior + np.clip(_TEMPER * (evidence - evidence.max()), -700, 0)
    p = np.exp(tempered - tempered.max())
    p /= p.sum()
    if row == fault_models.NO_SIGNAL:
        p[fault_models.NO_SIGNAL] += p[fault_models.STUCK]
        p[fault_models.STUCK] = 0.0
    ranked = sorted((Hypothesis("sensor", r, float(q)) for r, q in zip(ROWS, p, strict=True)), key=lambda h: -h.p)
    raised = _raised(lead, run, max(3, round(_EDGE_S / pair.dt)))
    return Finding(
        start=run.start,
        stop=run.stop,
        side=Side.SENSOR,
        mode=mode,
        probability=float(p[row]),
        hypotheses=tuple(ranked),
        epsilon=epsilon,
        sat=sat,
        evidence=_sentences(row, pair, y, x, seconds, delta, deviation, gain, model.switch_cost),
        tier="drive",
        detected=None if raised is None else min(max(raised + max(0, pair.lead), run.start), pair.y.size - 1),
    )


def _instrument(pair: EchoPair, model: RowModel) -> fault_models.ModeModel:
    """The same noise for the estimate of ε and sat, which knows no late samples."""
    return fault_models.ModeModel(
        noise=model.noise,
        constant_noise=model.constant_noise,
        tolerance=model.core,
        span=model.span,
        switch_cost=model.switch_cost,
        dt=pair.dt,
    )


def _raised(lead: Array, run: Run, slack: int) -> int | None:
    """First sample of a run from which on a fault is more probable than none by what was known then; None for never."""
    inside = lead[run.start : max(run.start + 1, run.stop - min(slack, run.size // 4))]
    calm = np.flatnonzero(inside <= 0)
    first = int(calm[-1]) + 1 if calm.size else 0
    return run.start + first if first < inside.size else None


def _sentences(
    row: int,
    pair: EchoPair,
    y: Array,
    x: Array,
    seconds: float,
    delta: float,
    deviation: float,
    gain: float,
    least: float,
) -> tuple[str, ...]:
    """What decided, in figures."""
    out = []
    if row in (fault_models.STUCK, fault_models.NO_SIGNAL) and y.size:
        out.append(
            f"{pair.name} stayed within {float(np.ptp(y)):.2g} m/s of {float(np.mean(y)):.4g} m/s for {seconds:.2f} s, while the "
            f"drive was commanded; healthy samples differ by {pair.noise:.2g} m/s."
        )
    elif row in (fault_models.STUCK, fault_models.NO_SIGNAL):
        out.append(f"{pair.name} delivered nothing for {seconds:.2f} s while the controller went on.")
    else:
        out.append(
            f"{pair.name} was {delta:.3f} times the speed that the controller answered to, over {seconds:.2f} s; the rest has a "
            f"root mean square of {float(np.sqrt(np.mean((y - delta * x) ** 2))):.3g} m/s, healthy noise is {pair.noise:.2g} m/s."
        )
    if deviation > pair.noise:
        out.append(
            f"The logged speed is not the one that the controller acted on (difference {deviation:.3g} m/s root mean square), "
            "so the drive obeys and the speed's channel is at fault."
        )
    out.append(f"Log-evidence against healthy: {gain:.0f}; a fault is considered from {least:.0f}.")
    return tuple(out)
