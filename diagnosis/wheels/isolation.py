"""Isolation: which row of the tables a segment of one wheel is, with probabilities, and whether that is stated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.fault_rows import mode_words
from diagnosis.results.machine_words import part_token
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, Sentence, lasting
from diagnosis.results.sizes import kept_to, probable_words
from diagnosis.results.vocabulary import Kind, Tier
from diagnosis.wheels.estimates import estimate
from diagnosis.wheels.models import (
    A_GAIN,
    A_NONE,
    HEALTHY,
    ODD,
    ROW_OF_MODEL,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    TOTAL_SENSOR,
    Row,
    WheelFilterModel,
)
from replay.arrays.quantiles import quantile_of
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

#: Said of what the trees claim although the Kalman filter of that row does not.
NOT_PREFERRED = "Its Kalman model alone would not be preferred to that of a healthy {wheel}."
_ODD_COST = 2.0  # by which an unusual load must explain more than the usual one
_WEAK_GAIN = 0.35  # a sensor's gain below this hides what the valve does
_LEAST_SIDE, _LEAST_ROW = 0.7, 0.5  # probabilities of a side and of its row from which on a finding is stated
_DOUBTED = 0.88  # the most that a row may have which the wheel's Kalman model does not prefer to a healthy wheel
_LEAST_OTHERS = 2  # of two wheels that differ, either may be the one whose speed is wrong
_LEAST_PART = 0.02  # a hypothesis below this is left out of the text
_LEAST_HYPOTHESIS = 5e-4
_AT_REST = ((Side.SENSOR, FaultMode.STUCK), (Side.SENSOR, FaultMode.NO_SIGNAL))
_MEAN_S, _FEW_MEANS, _EDGE_S, _INNER = 0.1, 10, 0.5, (0.02, 0.98)
_AT_MOST, _LEAST_MOVE = 6.0, 0.0063  # times the noise of a mean; of the span

Ranking = list[tuple[Row | None, float]]


@dataclass(frozen=True)
class Run:
    """One stretch of one side of a wheel: samples [start, stop), how probable each row is, every model's evidence and state.

    Attributes
    ----------
    side : Side
        Sensor or actuator.
    pooled : Mapping[Row or None, float]
        Probability of every row; None: no fault.
    evidence : Array, shape (models,)
        Log-likelihoods; −inf where a model is not considered.
    mean, cov : Array, shape (models, 4) and (models, 4, 4)
        States at its end.
    others : int
        Other wheels that show how fast the body moves.
    lives : bool
        Whether its readings tremble as ever at a steady command, or no wheel of the machine turns.
    """

    start: int
    stop: int
    side: Side
    pooled: Mapping[Row | None, float]
    evidence: Array
    mean: Array
    cov: Array
    others: int = 3
    lives: bool = False

    def ahead(self, m: int) -> float:
        """Log-evidence of model m against a healthy wheel, also one under an unusual load.

        A difference of log-likelihoods [1].
        """
        return float(self.evidence[m] - max(self.evidence[HEALTHY], self.evidence[ODD] - _ODD_COST))


@dataclass(frozen=True)
class RunVerdict:
    """What a run says.

    Attributes
    ----------
    finding : Finding or None
        Where it is a fault.
    hidden : bool
        Whether a sensor shows so little of the speed that nothing is known of the valve.
    """

    finding: Finding | None
    hidden: bool = False


@dataclass(frozen=True)
class _Weighed:
    """Rows of a run by their probability; `row` is the one of its side that holds if any does."""

    pooled: dict[Row | None, float]
    ranked: Ranking
    faulty: float
    row: Row


def judge(run: Run, y: Array, model: WheelFilterModel, limits: Limits, names: tuple[str, str], dt: float) -> RunVerdict:
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
    """
    known, seconds = y[np.isfinite(y)], (run.stop - run.start) * dt
    rests = not run.lives and (_rests(known, model, dt) or any(run.ahead(m) > 0 for m in TOTAL_SENSOR))
    weighed = _doubted(run, _weighed(run, known, model, rests=rests))
    stated = _stated(weighed, apart=run.others >= _LEAST_OTHERS)
    if stated is None:
        return RunVerdict(None)
    m = _model_of(run, weighed.row)
    if m == S_NONE and known.size < y.size / 2:  # it delivers nothing: the few readings at its edges say nothing of it
        known = known[:0]
    epsilon, sat = estimate(m, known, run.mean[m], run.cov[m], model)
    if epsilon is not None and m in (S_GAIN, A_GAIN) and epsilon.value < limits.min_epsilon:
        return RunVerdict(None)
    ranked = _undivided(weighed) if stated[0] is Side.SENSOR_OR_ACTUATOR else weighed.ranked
    finding = Finding(
        start=run.start,
        stop=run.stop,
        side=stated[0],
        mode=weighed.row[1],
        probability=min(1.0, stated[1]),
        hypotheses=tuple(Hypothesis(*_names(row), q) for row, q in ranked if q >= _LEAST_HYPOTHESIS),
        epsilon=epsilon,
        sat=sat,
        evidence=_sentences(run, m, (stated[0], weighed.row), known, weighed.ranked, names, seconds),
        tier=Tier.SIGNAL if m in TOTAL_SENSOR else Tier.MODEL,
    )
    return RunVerdict(finding, S_GAIN <= m <= S_OU_LARGE and float(run.mean[m, 1]) < _WEAK_GAIN)


def _weighed(run: Run, y: Array, model: WheelFilterModel, *, rests: bool) -> _Weighed:
    """Rows of a run by their probability; rows that the data cannot tell apart are one, and one that they rule out is none.

    `rests`: whether the readings may rest, as those of a sensor must that is stuck or gives no signal (L16 (4) with ε = 1).
    """
    pooled = dict(run.pooled)
    if not rests:  # what is ruled out counts for no other fault
        pooled[None] = pooled.get(None, 0.0) + sum(pooled.get(row, 0.0) for row in _AT_REST)
        pooled |= dict.fromkeys(_AT_REST, 0.0)
    silent = y.size == 0 or abs(float(np.mean(y))) <= 3 * model.rounding
    if silent and run.side is Side.SENSOR:  # stuck at zero and no signal are one row of the table
        pooled[Side.SENSOR, FaultMode.NO_SIGNAL] += pooled.pop((Side.SENSOR, FaultMode.STUCK))
    ranked = sorted(pooled.items(), key=lambda item: -item[1])
    own = [(row, p) for row, p in ranked if row is not None and row[0] is run.side]
    return _Weighed(pooled, ranked, sum(p for _, p in own), own[0][0])


def _doubted(run: Run, weighed: _Weighed) -> _Weighed:
    """Rows by their probability where the wheel's own model does not prefer the row to a healthy wheel: two that differ are no claim.

    A sensor that holds a value is seen by that value alone.
    """
    own = weighed.pooled[weighed.row]
    if weighed.row == (Side.SENSOR, FaultMode.STUCK) or own <= _DOUBTED or run.ahead(_model_of(run, weighed.row)) > 0:
        return weighed
    pooled = weighed.pooled | {weighed.row: _DOUBTED, None: weighed.pooled.get(None, 0.0) + own - _DOUBTED}
    ranked = sorted(pooled.items(), key=lambda item: -item[1])
    return _Weighed(pooled, ranked, weighed.faulty - own + _DOUBTED, weighed.row)


def _rests(y: Array, model: WheelFilterModel, dt: float) -> bool:
    """Whether the readings of a run, but for its edges, are one value but for their noise."""
    width, edge = max(1, round(_MEAN_S / dt)), min(round(_EDGE_S / dt), y.size // 5)
    inner = y[edge : y.size - edge]
    means = inner[: inner.size // width * width].reshape(-1, width).mean(axis=1)
    if means.size < _FEW_MEANS:
        return True
    low, high = quantile_of(means, _INNER)
    return bool(high - low <= _AT_MOST * model.noise / np.sqrt(width) + 2 * model.rounding + _LEAST_MOVE * model.span)


def _stated(weighed: _Weighed, *, apart: bool) -> tuple[Side, float] | None:
    """Side that is stated, which is the union for a loss of gain of either, and its probability; None: too uncertain.

    `apart`: whether the other wheels tell a loss of the sensor from one of the valve.
    """
    (side, mode), probability = weighed.row, weighed.pooled[weighed.row]
    if (apart or mode is not FaultMode.INEFFICIENT) and weighed.faulty >= _LEAST_SIDE and probability >= _LEAST_ROW:
        return side, probability
    other = Side.ACTUATOR if side is Side.SENSOR else Side.SENSOR
    both = probability + weighed.pooled.get((other, mode), 0.0)
    if mode is not FaultMode.INEFFICIENT or both < _LEAST_SIDE:
        return None
    return Side.SENSOR_OR_ACTUATOR, both


def _undivided(weighed: _Weighed) -> Ranking:
    """Rows by their probability where nothing tells a loss of the sensor from one of the valve: both have the same share of it."""
    mode = weighed.row[1]
    rows = [(Side.SENSOR, mode), (Side.ACTUATOR, mode)]
    half = sum(weighed.pooled.get(row, 0.0) for row in rows) / 2
    return sorted(({**weighed.pooled} | dict.fromkeys(rows, half)).items(), key=lambda item: -item[1])


def _model_of(run: Run, row: Row) -> int:
    """Model of a row by which the fault is estimated."""
    side, mode = row
    if mode is FaultMode.NO_SIGNAL:  # also what is stuck at nothing
        return S_NONE if side is Side.SENSOR else A_NONE
    return int(np.argmax(np.where([r == row for r in ROW_OF_MODEL], run.evidence, -np.inf)))


def _names(row: Row | None) -> tuple[str, str]:
    """Side and mode of a row as a hypothesis names them."""
    return ("none", "healthy") if row is None else (row[0].value, row[1].value)


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
    share = dict(ranked)[row]
    by_itself = m in TOTAL_SENSOR  # its channel alone shows it, whatever the opening
    fits = f"{names[0]} fits" if by_itself else f"{names[0]} and {names[1]} fit"
    words = f"Over {lasting(seconds, 3)} {fits} “{_words((side, row[1]))}”: on simulated machines with such signals it was this in "
    lines: list[str] = [Sentence(About.CASES, words, f"{100 * share:.0f}", " of 100 cases.")]
    ahead = run.ahead(m)
    if ahead > 0:
        words = f"{names[0]} is {probable_words(ahead, 'by its Kalman model', 'by that of a healthy {wheel}')}."
        lines.append(Sentence(About.TIMES, words))
    else:
        lines.append(NOT_PREFERRED)
    if m == S_NONE and not known.size:
        lines.append(f"{names[0]} delivered nothing in this time.")
    elif m in TOTAL_SENSOR and known.size:
        lines.append(f"{names[0]} {kept_to(float(np.min(known)), float(np.max(known)), 'm/s')}.")
    for other, probability in ranked:
        if other is not None and other != row:
            if probability >= _LEAST_PART:
                lines.append(Sentence(About.RIVAL, f"Next best: {_words(other)} with {100 * probability:.0f} %."))
            break
    if side is Side.SENSOR_OR_ACTUATOR:
        lines.append(
            "Without a second measurement, a loss of gain of the sensor and one of the {valve} cannot be distinguished here."
        )
    return tuple(lines)


def _words(row: Row) -> str:
    side, mode = row
    return f"{part_token(Kind.WHEEL, side)} {mode_words(side, mode)}"
