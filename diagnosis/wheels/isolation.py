"""Isolation: which row of the tables a run of one wheel is, with probabilities, and whether that is stated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.fault_rows import mode_words
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Kind, Tier, part_name
from diagnosis.wheels.calibration import RunContext, calibrated
from diagnosis.wheels.estimates import estimate
from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    ODD,
    ROW_OF_MODEL,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_OU_SMALL,
    S_STUCK,
    S_WHITE_3,
    TOTAL_SENSOR,
    Row,
    WheelFilterModel,
)
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

_ODD_COST = 2.0  # by which an unusual load must explain more than the usual one
_SIDES = (Side.SENSOR, Side.ACTUATOR)
_WEAK_GAIN = 0.35  # a sensor's gain below this hides what the valve does
_LEAST_DISTURBANCE_S = 1.0  # shorter ones are what the model gets wrong while a wheel recovers
_LEAVES_OPEN = 0.05  # probability that a side is faulty above which it is not called healthy
_USUAL = 0.75  # probability of a healthy wheel above which a run leaves nothing unexplained
_LEAST_SIDE, _LEAST_ROW = 0.65, 0.45  # probabilities of a side and of its row from which on a finding is stated
_LEAST_PART = 0.02  # a hypothesis below this is left out of the text
_LEAST_HYPOTHESIS = 5e-4
#: Models that need no model of the wheel: a sensor that is constant, silent or has white noise.
_WITHOUT_PLANT = (*TOTAL_SENSOR, *range(S_WHITE_3, S_OU_SMALL))

Ranking = list[tuple[Row | None, float]]


@dataclass(frozen=True)
class Run:
    """One stretch of one wheel: samples [start, stop), the path's model, and every model's evidence and state.

    Attributes
    ----------
    evidence : Array, shape (models,)
        Log-likelihoods; −inf where a model is not considered.
    mean, cov : Array, shape (models, 4) and (models, 4, 4)
        States at its end.
    context : RunContext
        What else is known of it.
    """

    start: int
    stop: int
    model: int
    evidence: Array
    mean: Array
    cov: Array
    context: RunContext

    def ahead(self, m: int) -> float:
        """Log-evidence of model m against a healthy wheel, also one under an unusual load."""
        return float(self.evidence[m] - max(self.evidence[HEALTHY], self.evidence[ODD] - _ODD_COST))


@dataclass(frozen=True)
class RunVerdict:
    """What a run says.

    Attributes
    ----------
    finding : Finding or None
        Where it is a fault.
    open_sides : tuple[Side, ...]
        Sides of which it leaves open whether they are healthy.
    usual : bool
        Whether that is no more than what the model's own errors do on healthy missions too.
    """

    finding: Finding | None
    open_sides: tuple[Side, ...] = ()
    usual: bool = False


@dataclass(frozen=True)
class _Weighed:
    """Rows of a run by their probability; `row` is the one that holds if any does."""

    pooled: dict[Row | None, float]
    ranked: Ranking
    faulty: dict[Side, float]
    row: Row


def judge(
    run: Run,
    y: Array,
    model: WheelFilterModel,
    limits: Limits,
    names: tuple[str, str],
    dt: float,
    *,
    gains: bool,
) -> RunVerdict:
    """Turn a run into a finding.

    Parameters
    ----------
    run, model, limits
        The run, its wheel, and what counts.
    y : Array, shape (stop − start,)
        Measured speed [m/s]; NaN where there is none.
    names : tuple[str, str]
        Speed and opening, for the text.
    dt : float
        Step [s].
    gains : bool
        Whether the wheel model is good enough to judge gains and the valve by.
    """
    known, seconds = y[np.isfinite(y)], (run.stop - run.start) * dt
    weighed = _weighed(run, known, model)
    side = weighed.row[0]
    open_sides = tuple(s for s in _SIDES if weighed.faulty[s] > _LEAVES_OPEN)
    usual = weighed.pooled[None] > _USUAL
    stated = _stated(weighed)
    if stated is None:
        return RunVerdict(None, open_sides, usual)
    m, _ = _models_of(run, weighed.row)
    if not gains and m not in _WITHOUT_PLANT:
        return RunVerdict(None, _SIDES)
    epsilon, sat = estimate(m, known, run.mean[m], run.cov[m], model)
    if epsilon is not None and m in (S_GAIN, A_GAIN) and epsilon.value < limits.min_epsilon:
        return RunVerdict(None)
    if m == A_BIAS and (seconds < _LEAST_DISTURBANCE_S or (epsilon is not None and epsilon.high < 0)):
        return RunVerdict(None, (*open_sides, Side.ACTUATOR), usual)  # the model's own error, or nothing that is lost
    finding = Finding(
        start=run.start,
        stop=run.stop,
        side=stated[0],
        mode=weighed.row[1],
        probability=min(1.0, stated[1]),
        hypotheses=tuple(Hypothesis(*_names(row), q) for row, q in weighed.ranked if q >= _LEAST_HYPOTHESIS),
        epsilon=epsilon,
        sat=sat,
        evidence=_sentences(run, m, (stated[0], weighed.row), known, weighed.ranked, names, seconds),
        tier=Tier.SIGNAL if m in TOTAL_SENSOR else Tier.MODEL,
    )
    return RunVerdict(finding, _left_open(open_sides, side, m, run))


def _weighed(run: Run, y: Array, model: WheelFilterModel) -> _Weighed:
    """Rows of a run by their probability; rows that the data cannot tell apart are one."""
    pooled = calibrated(run.model, run.evidence, run.context)
    silent = y.size == 0 or abs(float(np.mean(y))) <= 3 * model.rounding
    if silent and run.model in TOTAL_SENSOR:  # stuck at zero and no signal are one row of the table
        pooled[Side.SENSOR, FaultMode.NO_SIGNAL] += pooled.pop((Side.SENSOR, FaultMode.STUCK))
    ranked = sorted(pooled.items(), key=lambda item: -item[1])
    faulty = {side: sum(p for row, p in ranked if row is not None and row[0] is side) for side in _SIDES}
    side = max(_SIDES, key=lambda s: faulty[s])
    row = next(row for row, _ in ranked if row is not None and row[0] is side)
    return _Weighed(pooled, ranked, faulty, row)


def _stated(weighed: _Weighed) -> tuple[Side, float] | None:
    """Side that is stated, which is the union for a loss of gain of either, and its probability; None: too uncertain."""
    (side, mode), probability = weighed.row, weighed.pooled[weighed.row]
    if weighed.faulty[side] >= _LEAST_SIDE and probability >= _LEAST_ROW:
        return side, probability
    other = Side.ACTUATOR if side is Side.SENSOR else Side.SENSOR
    both = probability + weighed.pooled.get((other, mode), 0.0)
    if mode is not FaultMode.INEFFICIENT or both < _LEAST_SIDE:
        return None
    return Side.SENSOR_OR_ACTUATOR, both


def _models_of(run: Run, row: Row) -> tuple[int, int]:
    """Model of a row by which the fault is estimated, and the one whose evidence supports it."""
    side, mode = row
    if mode is FaultMode.NO_SIGNAL:  # also what is stuck at nothing
        m, stuck = (S_NONE, S_STUCK) if side is Side.SENSOR else (A_NONE, A_STUCK)
        return m, m if run.evidence[m] >= run.evidence[stuck] else stuck
    m = int(np.argmax(np.where([r == row for r in ROW_OF_MODEL], run.evidence, -np.inf)))
    return m, m


def _names(row: Row | None) -> tuple[str, str]:
    """Side and mode of a row as a hypothesis names them."""
    return ("none", "healthy") if row is None else (row[0].value, row[1].value)


def _left_open(open_sides: tuple[Side, ...], side: Side, m: int, run: Run) -> tuple[Side, ...]:
    """Sides that stay open beside a finding: also the valve under a sensor that shows hardly anything of it."""
    left = {s for s in open_sides if s is not side}
    if S_GAIN <= m <= S_OU_LARGE and float(run.mean[m, 1]) < _WEAK_GAIN:
        left.add(Side.ACTUATOR)
    return tuple(left)


def _sentences(
    run: Run,
    m: int,
    stated: tuple[Side, Row],
    known: Array,
    ranked: Ranking,
    names: tuple[str, str],
    seconds: float,
) -> tuple[str, ...]:
    """What decided, with figures; `stated` is the side that is stated, and the row."""
    side, row = stated
    lines = [
        f"Over {seconds:.3f} s the model “{_words(row)}” explains {names[0]} better than a "
        f"healthy wheel by a log-evidence of {run.ahead(m):.0f}."
    ]
    if m in TOTAL_SENSOR and known.size:
        lines.append(f"{names[0]} stayed within {float(np.ptp(known)):.2g} m/s of {float(np.mean(known)):.4g} m/s.")
    for other, probability in ranked:
        if other is not None and other != row:
            if probability >= _LEAST_PART:
                lines.append(f"Next best: {_words(other)} with {100 * probability:.0f} %.")
            break
    if side is Side.SENSOR_OR_ACTUATOR:
        lines.append(
            "Without a second measurement, a loss of gain of the sensor and one of the valve cannot be distinguished here."
        )
    return tuple(lines)


def _words(row: Row) -> str:
    side, mode = row
    return f"{part_name(Kind.WHEEL, side)} {mode_words(side, mode)}"
