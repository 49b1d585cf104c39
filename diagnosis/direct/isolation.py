"""Isolation: which row of the table a faulty run is, the path's or another one by its evidence and its samples."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import BLIND, PAIR
from diagnosis.channels.zero_level import APART, zero_level
from diagnosis.direct.behind_play import gain_behind_play
from diagnosis.direct.calm import calm_row, is_one_value
from diagnosis.direct.fault_runs import inner, motion_left
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.stated_row import not_silent, stated_row, with_lapses
from diagnosis.estimation.fault_models import (
    HEALTHY,
    INEFFICIENT,
    NO_SIGNAL,
    STUCK,
    TOTAL_ROWS,
    VARYING_ROWS,
)
from diagnosis.estimation.fault_size import estimate_fault
from diagnosis.estimation.filter_kernel import segment_evidence
from diagnosis.estimation.row_probability import row_probabilities
from diagnosis.estimation.segments import Run
from diagnosis.results.fault_rows import codes_of
from diagnosis.results.result import Epsilon, Sat
from replay.arrays.quantiles import median_of
from replay.faults import Side

Array = NDArray[np.float64]
#: ε̂, the saturation term and δ̂.
Estimate = tuple[Epsilon | None, Sat | None, float]

_BURST_S = 0.6  # at which half of the bursts of noise are what a motion leaves out: right were 12 of 48 below 1 s, 8 of 8 up to 3 s
#: A valve that stands for so short does what its drive's limits, its supply or another fault make it do as probably: right were 0 of 8 below 1.2 s.
_BRIEF_S, _LEAST_BRIEF = 0.8, 0.55
_WILD, _WILD_S, _WILD_SAMPLES = 10.0, 0.04, 4.0  # times the noise; motion that a wrong time may be off by
_RESTLESS, _RESTLESS_P = 0.1, 0.8  # share of changing news from which a channel is not stuck, and how probably so
_OF_PLAY = 0.3  # of its width per rms opening: standard deviation of the gain that a play leaves in simulated valves
_CALM_P, _NEARLY_P = (
    0.95,
    0.65,
)  # that a steady row is the fault's which leaves hardly anything; nearly as much as counts
_NOTHING = 0.05  # of the span, root mean square: a channel that shows more is not silent, however rough its usual noise


@dataclass(frozen=True, eq=False)
class RunSamples:
    """Samples of one run.

    Attributes
    ----------
    y, x : Array, shape (m,)
        Measured value and reference of all steps [unit of y].
    status : NDArray[np.int8], shape (m,)
        See `diagnosis.channels.sample_status`.
    use : NDArray[np.bool_], shape (m,)
        Steps with both values.
    zero : bool
        Whether the channel stays at zero.
    loud : bool
        Whether it shows so much that it is not silent.
    still : bool
        Whether its reference hardly moves, or what a share of it leaves of its motion.
    deviation : float
        Root mean square of y − x [unit of y]; infinite where there is none.
    noise : float
        Root mean square of what a healthy channel would show in its place [unit of y].
    """

    y: Array
    x: Array
    status: NDArray[np.int8]
    use: NDArray[np.bool_]
    zero: bool
    loud: bool
    still: bool
    deviation: float
    noise: float


@dataclass(frozen=True, eq=False)
class Isolated:
    """A run with its row.

    Attributes
    ----------
    run : Run
        Samples and row.
    seen : RunSamples
        Its samples.
    estimate : Estimate
        By that row.
    p : Array, shape (rows,)
        Probability of each row.
    gain : float
        Log-evidence of the row against healthy.
    restless : bool
        Whether it is a sensor's whose readings keep changing.
    """

    run: Run
    seen: RunSamples
    estimate: Estimate
    p: Array
    gain: float
    restless: bool = False


def run_samples(run: Run, found: IdentifiedPair, min_sat: float = 0.0) -> RunSamples:
    """Samples of a run and what they look like; what keeps below `min_sat` [unit of y] about a sensor's or a valve's zero is zero."""
    y, x, status, _, white, passing, _ = found.samples.part(run.start, run.stop)
    use = np.isin(status, (PAIR, BLIND))
    model = found.model
    power = model.noise**2 * white[use] + model.tolerance**2 * (passing[use] - 1.0)
    noise = float(np.sqrt(power.mean())) if use.any() else model.noise
    play = found.relation.play
    slack = 3 * model.constant_noise / np.sqrt(min(use.sum(), 100)) + 0.6 * play if use.any() else 0.0
    size = float(np.sqrt(np.mean(y[use] ** 2))) if use.any() else 0.0
    loud = size > _NOTHING * found.pair.span
    middle = abs(float(median_of(y[use]))) if use.any() else 0.0
    rests = zero_level(found.pair.span, min_sat) if found.pair.side is Side.SENSOR else min_sat
    zero = (middle <= slack and not loud) or (middle <= max(slack, rests) and size <= min_sat)
    still = bool(use.any()) and _hardly_moves(y[use], x[use], 2 * noise, 2 * play)
    deviation = float(np.sqrt(np.mean((y[use] - x[use]) ** 2))) if use.any() else float("inf")
    return RunSamples(y, x, status, use, zero, loud, still, deviation, noise)


def _hardly_moves(y: Array, x: Array, least: float, play: float) -> bool:
    """Whether a reference, or the share of it that y is, moves by less than `least`, or the reference within a play."""
    power = float(x @ x)
    return motion_left(x, float(x @ y) / power if power > 0.0 else 1.0) < least or float(np.ptp(x)) < play


def estimate_run(run: Run, found: IdentifiedPair) -> Estimate | None:
    """ε̂, the saturation term and δ̂ of a run; see `estimate_fault`."""
    y, x, status, *_ = found.samples.part(run.start, run.stop)
    use = np.isin(status, (PAIR, BLIND))
    known = found.instruments
    instruments = None if known is None else np.nan_to_num(known[run.start : run.stop][use])
    estimate = estimate_fault(run.row, y[use], x[use], found.model, found.pair.unit, instruments)
    if estimate is None or run.row in TOTAL_ROWS:
        return estimate
    epsilon, sat, delta = estimate
    return estimate if epsilon is None else (epsilon.with_gain(_gain_std(x[use], found, delta, run)), sat, delta)


def _gain_std(x: Array, found: IdentifiedPair, delta: float, run: Run) -> float:
    """Standard deviation of a gain as a share of it: what the healthy channel's own varies by, and the side of the play it is on.

    A speed sensor's own varies by a share. What keeps a valve from its command, such as friction or an offset of its
    position, stays as large as it was where only a part of the opening is left.
    """
    spread = found.gain_spread(run.start, run.stop)
    large = float(np.sqrt(np.mean(x**2))) if x.size else 0.0
    if found.pair.side is Side.SENSOR or large <= 0.0 or delta == 0.0:
        return spread.share
    off = spread.share * max(spread.size, large) + _OF_PLAY * found.relation.play
    return min(off / (large * abs(delta)), 1.0)


def isolate(run: Run, found: IdentifiedPair, min_sat: float) -> Isolated | None:
    """Row of a run, its probability and its estimates; None where the evidence against healthy is thin.

    Parameters
    ----------
    run : Run
        Samples, and the row of the path.
    found : IdentifiedPair
        The pair.
    min_sat : float
        Smallest saturation term that counts [unit of y].
    """
    estimate = estimate_run(run, found)
    if estimate is None:
        return None
    model = found.model
    evidence = segment_evidence(found.samples.part(*inner(run)), model)
    if evidence[run.row] - evidence[HEALTHY] < model.switch_cost:
        return None
    p = row_probabilities(evidence, model.side)
    seen = run_samples(run, found, min_sat)
    if seen.loud:
        p = not_silent(p, model.side)
    row = stated_row(run.row, p, zero=seen.zero, still=seen.still)
    if row != run.row:  # the path came by this one from its neighbours or for want of time to change
        other = estimate_run(replace(run, row=row), found)
        if other is not None:
            run, estimate = replace(run, row=row), other
    if found.relation.play and run.row in VARYING_ROWS and (delta := gain_behind_play(run, found)) is not None:
        p[INEFFICIENT], p[run.row] = p[run.row], p[INEFFICIENT]
        run = replace(run, row=INEFFICIENT)
        estimate = _of_gain(delta, estimate_run(run, found)) or estimate
    restless = found.pair.side is Side.SENSOR and _changes(seen) > _RESTLESS
    calm = _calm_row_of(seen, min_sat, APART * found.pair.span) if run.row in VARYING_ROWS else None
    if calm is not None and not (calm == STUCK and restless):
        other = estimate_run(replace(run, row=calm), found)
        if other is not None:
            both = p[run.row] + p[calm]
            sure = _calm_row_of(seen, 0.5 * min_sat, APART * found.pair.span) == calm
            sure_p = _CALM_P if sure else _NEARLY_P
            p[calm], p[run.row] = sure_p * both, (1.0 - sure_p) * both
            run, estimate = replace(run, row=calm), other
    gain = float(evidence[run.row] - evidence[HEALTHY])
    seconds = run.size * found.pair.dt
    p = with_lapses(p, run.row, model.side, seconds if found.coarse else None)
    if run.row in VARYING_ROWS and not _wild(seen, found.pair.dt):
        burst = seconds**2 / (seconds**2 + _BURST_S**2)
        p[HEALTHY] += p[run.row] * (1.0 - burst)
        p[run.row] *= burst
        ahead = [r for r in codes_of(model.side) if r != HEALTHY and p[r] >= p[run.row]]
        p[ahead] = p[ahead].mean()  # that it is brief tells nothing of which row it is
    if run.row in TOTAL_ROWS and seen.zero:
        # stuck at zero, a gain of zero and no signal are one row of the table
        run = replace(run, row=NO_SIGNAL)
        p[NO_SIGNAL] += p[STUCK] + p[INEFFICIENT]
        p[[STUCK, INEFFICIENT]] = 0.0
    if run.row in TOTAL_ROWS and found.pair.side is Side.ACTUATOR:
        lasts = max(_LEAST_BRIEF, seconds**4 / (seconds**4 + _BRIEF_S**4))
        p[HEALTHY] += p[run.row] * (1.0 - lasts)
        p[run.row] *= lasts
    if run.row == STUCK and seen.still and restless:
        # nothing moved, but the last digit did: a stuck channel does not do that
        other = estimate_run(replace(run, row=INEFFICIENT), found)
        if other is not None and 0.0 < other[2] < 1.0:
            run, estimate = replace(run, row=INEFFICIENT), other
            both = p[STUCK] + p[INEFFICIENT]
            p[INEFFICIENT], p[STUCK] = _RESTLESS_P * both, (1.0 - _RESTLESS_P) * both
    if run.row == INEFFICIENT and not restless and _shifted_away(seen, estimate[2], seen.noise):
        # a constant of its own, not a share
        run = replace(run, row=STUCK)
        p[STUCK], p[INEFFICIENT] = max(p[STUCK], p[INEFFICIENT]), min(p[STUCK], p[INEFFICIENT])
        other = estimate_run(run, found)
        if other is None:
            return None
        estimate = other
    return Isolated(run, seen, estimate, p, gain, restless)


def _wild(seen: RunSamples, dt: float) -> bool:
    """Whether readings are further off than noise and any timing of the motion put them: spikes, however brief."""
    x = seen.x[seen.use]
    slope = float(np.sqrt(np.mean(np.gradient(x) ** 2))) / dt if x.size > 1 else 0.0
    return seen.deviation > max(_WILD * seen.noise, slope * max(_WILD_S, _WILD_SAMPLES * dt))


def _calm_row_of(seen: RunSamples, min_sat: float, zero: float) -> int | None:
    y, x = seen.y[seen.use], seen.x[seen.use]
    if seen.still:
        return STUCK if is_one_value(y, x, min_sat) else None
    return calm_row(y, x, min_sat, zero)


def _changes(seen: RunSamples) -> float:
    """Share of the news of a run that differ from the value before."""
    y = seen.y[seen.use]
    return float(np.mean(np.diff(y) != 0.0)) if y.size > 1 else 0.0


def _of_gain(delta: float, estimate: Estimate | None) -> Estimate | None:
    """An estimate of a loss of gain with another δ."""
    if estimate is None or estimate[0] is None:
        return estimate
    half = 0.5 * (estimate[0].high - estimate[0].low)
    return Epsilon(1.0 - delta, 1.0 - delta - half, 1.0 - delta + half), None, delta


def _shifted_away(seen: RunSamples, delta: float, noise: float) -> bool:
    """Whether a gain beside a reference that hardly moves is no share of it."""
    return seen.still and abs(float(np.mean(seen.x[seen.use]))) > 3 * noise and not 0.0 <= delta <= 1.0
