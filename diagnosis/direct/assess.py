"""Direct evidence: a measurement beside an independent one of the same quantity.

L4 with v against v_true for a sensor, L8 with u_applied against u_a for an actuator; the same for steering angles.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.debounce import FLICKER_S, steadied
from diagnosis.channels.noise import relative_lag, shifted, unresolved
from diagnosis.channels.pairs import Pair, mode_model, neighbours, sample_status, timing_explains, unsettled
from diagnosis.direct.evidence import evidence_columns, sentences
from diagnosis.direct.fault_runs import fault_runs, inner
from diagnosis.direct.onset import Channel, refine
from diagnosis.direct.screen import screened
from diagnosis.estimation import fault_models
from diagnosis.estimation.fault_size import estimate_fault
from diagnosis.estimation.segments import Run, with_leads
from diagnosis.estimation.viterbi import ModePath, most_probable
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.evidence_columns import steps_of
from diagnosis.results.loss import loss_of
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from replay.arrays.spill import keep
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits

Array = NDArray[np.float64]

_MODE = {
    fault_models.STUCK: FaultMode.STUCK,
    fault_models.NO_SIGNAL: FaultMode.NO_SIGNAL,
    fault_models.INEFFICIENT: FaultMode.INEFFICIENT,
    fault_models.NOISY: FaultMode.NOISY,
}
_WEARING = (CODE[State.HEALTHY], CODE[State.INEFFICIENT])
# From tuning missions, by `python tests/benchmarks/calibrate_direct.py`: share of findings that are not what they seem, and
# the length at which half of those in a log too slow for its commands are.
_TEMPER, _LAPSE, _COARSE_S = 0.25, 0.01, 1.7
_MAX_LAG_S = 0.05
_SHORTEST_S = 0.01
_HOLD_S = 0.1
_COARSE_COST = 0.2  # where a log is too slow for its commands, what is left of them looks like a fault's drift
_LEAD_S, _TAIL_S, _CHAIN_S = 0.3, 0.1, 0.05
_SAID_S = 0.1
_CLEARLY = 2.0  # times as probable as the path's row, from which on another one is stated


def assess_pair(pair: Pair, limits: Limits) -> Assessment:
    """Judge a channel by its reference.

    Parameters
    ----------
    pair : Pair
        Channel, reference and circumstances.
    limits : Limits
        Smallest ε and saturation term that count.
    """
    usable = pair.fresh & np.isfinite(pair.y) & np.isfinite(pair.x)
    max_lag = max(1, round(_MAX_LAG_S / pair.dt)) if pair.dt <= _MAX_LAG_S else 0
    least_lag = 0 if pair.side is Side.ACTUATOR else -max_lag
    lag = relative_lag(pair.y, pair.x, usable & ~pair.quiet, least_lag, max_lag)
    x = keep(shifted(pair.x, lag))
    pair = replace(pair, moved=x)
    status = sample_status(pair.y, x, pair.fresh, pair.alive, pair.dt)
    model, lsb = mode_model(pair, x, status, 0.25 * limits.min_sat)
    blind, share = np.zeros(x.size, dtype=np.bool_), 0.0
    if pair.side is Side.ACTUATOR:  # a command may jump from step to step, a speed may not
        paired = status == fault_models.PAIR
        blind, share = unresolved(np.where(paired, pair.y - x, np.nan), x, paired, model.noise, pair.dt)
    if share:
        blind &= unsettled(x, model.noise)
        status[blind & paired] = fault_models.BLIND
        model = replace(model, drift_cost=model.drift_cost + _COARSE_COST)
    channel = Channel(pair.y, x, status, pair.quiet)
    path = most_probable(pair.y, x, screened(pair.y, x, status, model.noise), pair.quiet, model)
    shortest = max(3, round(_SHORTEST_S / pair.dt))
    findings = []
    below = 0
    runs = fault_runs(path, channel, model, pair.dt, shortest)
    chained = with_leads(runs, *(max(2, round(s / pair.dt)) for s in (_LEAD_S, _TAIL_S, _CHAIN_S)))
    coarse = neighbours(x) if share else None
    for i, (main, start, stop) in enumerate(chained):
        before, after = chained[i - 1][2] if i else 0, chained[i + 1][1] if i + 1 < len(chained) else x.size
        limit = (before if start == main.start else main.start, after if stop == main.stop else main.stop)
        run = _refined(main, pair, channel, model, coarse, limit)
        finding = _finding(run, pair, channel, model, limits, lag, coarse)
        if finding is None:
            below += 1
        elif timing_explains(pair, run, finding.mode, share):
            blind[run.start : run.stop] = True
        else:
            whole = Run(
                min(start, run.start) if start < main.start else run.start,
                max(stop, run.stop) if stop > main.stop else run.stop,
                run.row,
            )
            findings.append(_widened(finding, run, whole, pair.dt, _detected(path, whole, pair.dt, shortest, lag)))
    states = _states(pair, x, status, blind, findings)
    pictured = evidence_columns(pair, x, status, model, path, steps_of(findings, x.size, pair.dt))
    notes = [
        f"{pair.y_name} against {pair.x_name}: noise {model.noise:.2g} {pair.unit}, rounding step {lsb:.2g} {pair.unit}, "
        f"delay {lag * pair.dt * 1e3:.3g} ms."
    ]
    if below:
        notes.append(f"{below} deviations of {pair.y_name} lie below the limits of the machine file.")
    return Assessment(
        states=states,
        reasons={
            State.NOT_EXCITED: "nothing is commanded and nothing moves",
            State.NO_DATA: "no samples",
            State.NOT_ASSESSED: "the command changes faster than the log's rate or the valve's lag can resolve"
            if pair.side is Side.ACTUATOR
            else "what deviates may be a delay or the rounding of the channel",
        },
        findings=tuple(findings),
        columns=pictured.columns,
        closeups=pictured.closeups,
        loss=loss_of(pair.y, x, (status == fault_models.PAIR) & np.isin(states, _WEARING), pair.dt),
        tier="direct",
        notes=tuple(notes),
    )


def _widened(finding: Finding, run: Run, whole: Run, dt: float, detected: int | None) -> Finding:
    """A finding with the time in which it grew or faded, and the moment at which it was raised."""
    evidence = finding.evidence
    if run.start - whole.start > _SAID_S / dt:
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


def _estimate(
    run: Run, pair: Pair, channel: Channel, model: fault_models.ModeModel, coarse: Array | None
) -> tuple[Epsilon | None, Sat | None, float] | None:
    """ε̂, the saturation term and δ̂ of a run; see `estimate_fault`."""
    part = slice(run.start, run.stop)
    use = np.isin(channel.status[part], (fault_models.PAIR, fault_models.BLIND))
    known = pair.instruments if coarse is None else coarse
    instruments = None if known is None else np.nan_to_num(known[part][use])
    return estimate_fault(run.row, pair.y[part][use], channel.x[part][use], model, pair.unit, instruments)


def _refined(
    run: Run,
    pair: Pair,
    channel: Channel,
    model: fault_models.ModeModel,
    coarse: Array | None,
    between: tuple[int, int],
) -> Run:
    """A noisy run with its ends where its own gain puts them."""
    estimate = _estimate(run, pair, channel, model, coarse) if run.row == fault_models.NOISY else None
    return run if estimate is None else refine(run, channel, estimate[2], model, *between)


def _finding(
    run: Run,
    pair: Pair,
    channel: Channel,
    model: fault_models.ModeModel,
    limits: Limits,
    lag: float,
    coarse: Array | None,
) -> Finding | None:
    """Estimate ε and sat of a run; None where it lies below the limits or the evidence is thin."""
    estimate = _estimate(run, pair, channel, model, coarse)
    if estimate is None:
        return None
    part = slice(run.start, run.stop)
    y, ref, st = pair.y[part], channel.x[part], channel.status[part]
    use = np.isin(st, (fault_models.PAIR, fault_models.BLIND))
    evidence = channel.part(*inner(run)).evidence(model)
    if evidence[run.row] - evidence[fault_models.HEALTHY] < model.switch_cost:
        return None
    prior = np.log(np.array([0.8, 0.05, 0.05, 0.05, 0.05]))
    tempered = prior + np.clip(_TEMPER * (evidence - evidence.max()), -700, 0)
    p = np.exp(tempered - tempered.max())
    p /= p.sum()
    zero = not use.any() or abs(float(np.mean(y[use]))) <= 3 * model.constant_noise / np.sqrt(min(use.sum(), 100))
    still = bool(use.any()) and float(np.std(ref[use])) < 2 * model.noise
    row = _row(run.row, p, zero=zero, still=still)
    if row != run.row:  # the path came by this one from its neighbours or for want of time to change
        other = _estimate(replace(run, row=row), pair, channel, model, coarse)
        if other is not None:
            run, estimate = replace(run, row=row), other
    gain = evidence[run.row] - evidence[fault_models.HEALTHY]
    p = _with_lapses(p, run.row, None if coarse is None else run.size * pair.dt)
    if run.row in (fault_models.STUCK, fault_models.NO_SIGNAL) and zero:
        # stuck at zero, a gain of zero and no signal are one row of the table
        run = Run(run.start, run.stop, fault_models.NO_SIGNAL)
        p[fault_models.NO_SIGNAL] += p[fault_models.STUCK] + p[fault_models.INEFFICIENT]
        p[[fault_models.STUCK, fault_models.INEFFICIENT]] = 0.0
    shifted_away = still and abs(float(np.mean(ref[use]))) > 3 * model.noise and not 0.0 <= estimate[2] <= 1.0
    if run.row == fault_models.INEFFICIENT and shifted_away:  # a constant of its own, not a share
        run = Run(run.start, run.stop, fault_models.STUCK)
        estimate = _estimate(run, pair, channel, model, coarse)
        if estimate is None:
            return None
    mode = _MODE[run.row]
    epsilon, sat, delta = estimate
    deviation = float(np.sqrt(np.mean((y[use] - ref[use]) ** 2))) if use.any() else float("inf")
    if mode is FaultMode.INEFFICIENT:
        if delta > 1.0 + limits.min_epsilon or delta < -limits.min_epsilon:
            mode = FaultMode.OUTSIDE_TABLE
        elif epsilon is not None and epsilon.value < limits.min_epsilon:
            return None
        if abs(1.0 - delta) * float(np.sqrt(np.mean(ref[use] ** 2))) < 0.5 * model.noise:
            return None  # what is lost of hardly anything is the reference's own noise
    if pair.side is Side.ACTUATOR and mode in (FaultMode.STUCK, FaultMode.NO_SIGNAL) and deviation < 2.5 * model.noise:
        return None  # the command hardly moved: a noisy reading of it looks constant too
    if mode is FaultMode.NOISY and deviation < max(2.5 * model.noise, limits.min_sat / 2):
        return None
    if epsilon is not None and mode is not FaultMode.OUTSIDE_TABLE:
        epsilon = epsilon.as_share()
    lines = sentences(run.row, mode, pair, y, ref, use, st, model, epsilon, sat, gain, deviation)
    if run.row in (fault_models.STUCK, fault_models.INEFFICIENT) and still:
        # nothing moved: a constant value and a constant share of a constant are the same
        p[fault_models.STUCK] = p[fault_models.INEFFICIENT] = (p[fault_models.STUCK] + p[fault_models.INEFFICIENT]) / 2
        lines += (f"{pair.x_name} hardly moved in this time, so that stuck and inefficient look alike.",)
    shift = round(lag) if pair.side is Side.ACTUATOR else 0
    side = pair.side.value
    hypotheses = sorted(
        (Hypothesis(side, r, float(q)) for r, q in zip(fault_models.ROWS, p, strict=True)), key=lambda h: -h.p
    )
    return Finding(
        start=max(0, run.start - max(0, shift)),
        stop=max(1, run.stop - max(0, shift)),
        side=pair.side,
        mode=mode,
        probability=float(p[run.row]),
        hypotheses=tuple(hypotheses),
        epsilon=epsilon,
        sat=sat,
        evidence=lines,
        tier="direct",
    )


def _row(row: int, p: Array, *, zero: bool, still: bool) -> int:
    """The path's row of a run, or another fault's where that is clearly more probable.

    Parameters
    ----------
    row : int
        Row of the path.
    p : Array, shape (5,)
        Probabilities of the rows.
    zero, still : bool
        Whether the channel stays at zero, and whether its reference hardly moves: some rows are alike then.
    """
    faults = [r for r in range(p.size) if r != fault_models.HEALTHY]
    best = max(faults, key=lambda r: float(p[r]))
    constant = {
        fault_models.STUCK,
        fault_models.NO_SIGNAL,
        *([fault_models.INEFFICIENT] if row != fault_models.INEFFICIENT else []),
    }
    alike = (zero and {row, best} <= constant) or (
        still and {row, best} <= {fault_models.STUCK, fault_models.INEFFICIENT}
    )
    return best if p[best] > _CLEARLY * p[row] and not alike else row


def _with_lapses(p: Array, row: int, seconds: float | None) -> Array:
    """Probabilities of the rows, lessened by how often a finding is not the fault that it seems, shape (5,).

    In a log too slow for its commands (`seconds` long; None elsewhere) most short findings are pieces of another fault,
    so that what the row loses goes to the other faults.
    """
    kept = 1.0 - _LAPSE
    if seconds is not None:
        kept *= seconds**2 / (seconds**2 + _COARSE_S**2)
    out = p.copy()
    others = [r for r in range(p.size) if r not in (fault_models.HEALTHY, row)]
    out[others] += p[row] * (1.0 - kept) / len(others)
    out[row] = p[row] * kept
    return out


def _states(
    pair: Pair, x: Array, status: NDArray[np.int8], blind: NDArray[np.bool_], findings: list[Finding]
) -> NDArray[np.int8]:
    """State of every sample: faults, healthy where something moves, else not excited or no data."""
    brief = round(FLICKER_S / pair.dt)
    quiet = ~steadied(~pair.quiet, brief, brief)
    states = np.where(quiet, CODE[State.NOT_EXCITED], CODE[State.HEALTHY]).astype(np.int8)
    known = np.isfinite(pair.y) & np.isfinite(pair.x)
    nothing = ~known & (status != fault_models.SILENT)
    states[nothing] = CODE[State.NO_DATA]
    states[blind & known] = CODE[State.NOT_ASSESSED]
    for f in findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    return states
