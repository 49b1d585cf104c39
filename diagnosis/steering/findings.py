"""Stretches of a steering axle's path turned into findings: which fault, how probable, and what may be stated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from diagnosis.results.assessment import Finding
from diagnosis.results.fault_rows import mode_words
from diagnosis.results.machine_words import part_token
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, Sentence, lasting
from diagnosis.results.sizes import amount, probable_words
from diagnosis.results.vocabulary import Kind, Tier
from diagnosis.steering.dead_readings import LEAST_ASKED_S, at_rest, lapse
from diagnosis.steering.excitation import asked
from diagnosis.steering.fault_size import estimate_size, level_of
from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.isolation import NO_FAULT, Explanation, evidence_of_explanations
from diagnosis.steering.model_bank import COLOURED, HEALTHY, NO_SIGNAL, NOISY, STUCK
from diagnosis.steering.onset import refined_sensor, refined_valve
from diagnosis.steering.path import AxleFilter
from diagnosis.steering.path_refinement import runs_of
from diagnosis.steering.side_findings import SideFindings, span_of
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits

#: A side and mode; None and None where the axle is healthy.
Fault = tuple[Side | None, FaultMode | None]

_TEMPER = 0.35
_MOST = 0.6  # of a mission: the longest fault of a valve whose opening nobody measures
_BRIEF_S = 0.9  # a shorter stretch is rather what the model leaves out
_FRAGMENT_S = 2.0  # a row that holds for less beside another one is rather its end
_BELIEVED_S = 4.0  # for how long before and after a motion that did not come a valve's fault is believed
_LEAST_NAMED, _LEAST_LISTED = 0.005, 5e-4  # probabilities from which on another explanation is named in words, listed
_NO_FAULT: Fault = (None, None)


@dataclass(frozen=True)
class Judged:
    """A run of blocks in one row of one side, and the finding on it (None where nothing may be stated)."""

    start: int
    stop: int
    finding: Finding | None


class _Run(NamedTuple):
    """A faulty run of blocks of one side, and the axle that it is on."""

    side: Side
    start: int
    stop: int
    row: int
    axle: AxleFilter
    path: SteeringPath
    limits: Limits
    command_logged: bool = True

    @property
    def seconds(self) -> float:
        return (self.stop - self.start) * self.axle.blocks.dt


class _Choice(NamedTuple):
    """The most probable explanation of a run: side that is stated, fault, row of the filter, probability."""

    stated: Side
    side: Side
    mode: FaultMode
    row: int
    probability: float

    @property
    def dead_sensor(self) -> bool:
        """Whether the channel alone shows it."""
        return self.side is Side.SENSOR and self.mode.total

    @property
    def needs_motion(self) -> bool:
        """Whether only a motion that is asked for can show it."""
        return self.side is Side.ACTUATOR and self.mode in (FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT)


def findings_of(side: Side, inputs: AxleInputs, axle: AxleFilter, path: SteeringPath, limits: Limits) -> SideFindings:
    """Faults of one side, with their ends at the samples that show them."""
    judged = judge_side(side, axle, path, limits, command_logged=bool({"u", "u_applied"} & inputs.logged))
    length = axle.blocks.length
    findings = [refined_sensor(j.finding, inputs, length) for j in judged if j.finding is not None]
    if side is Side.ACTUATOR:
        findings = [refined_valve(f, inputs.valve_deviation, length) for f in findings]
    return SideFindings(tuple(findings), tuple((j.start, j.stop) for j in judged if j.finding is None))


def judge_side(
    side: Side, axle: AxleFilter, path: SteeringPath, limits: Limits, *, command_logged: bool = True
) -> list[Judged]:
    """Judge every faulty run of one side; `command_logged`: what the valve is told is known, not put in the place of it."""
    rows = path.sensor if side is Side.SENSOR else path.actuator
    rows = np.where(rows == COLOURED, NOISY, rows)
    out: list[Judged] = []
    for start, stop, row in runs_of(rows):
        if row == HEALTHY:
            continue
        one = _judge(_Run(side, start, stop, row, axle, path, limits, command_logged))
        last = out[-1] if out else None
        if last is not None and last.stop == start and _one_fault(last, one, axle.blocks.dt):
            longer = max(last, one, key=lambda j: j.stop - j.start)
            assert longer.finding is not None
            length = axle.blocks.length
            out[-1] = Judged(last.start, stop, replace(longer.finding, start=last.start * length, stop=stop * length))
        else:
            out.append(one)
    return out


def _one_fault(a: Judged, b: Judged, dt: float) -> bool:
    """Whether two runs that follow each other are one fault: of one row, or one of them brief beside the other."""
    if a.finding is None or b.finding is None or a.finding.side is not b.finding.side:
        return False
    brief, longer = sorted(((a.stop - a.start) * dt, (b.stop - b.start) * dt))
    return a.finding.mode is b.finding.mode or (brief < _FRAGMENT_S and longer > 2 * brief)


def apart(sensor: SideFindings, valve: SideFindings, length: int) -> SideFindings:
    """The valve's findings without those in which the sensor's fault is what the angle shows.

    An angle that its sensor scales or shakes is of no use to judge the valve behind it: there it stays open.

    Parameters
    ----------
    sensor, valve : SideFindings
        Of one axle whose valve is judged by the angle.
    length : int
        Samples per block.
    """
    blurred = [f for f in sensor.findings if not f.mode.total]
    kept, open_ = [], list(valve.unexplained)
    for f in valve.findings:
        shared = sum(max(0, min(f.stop, b.stop) - max(f.start, b.start)) for b in blurred)
        if 2 * shared > f.stop - f.start:
            open_.append(span_of(f, length))
        else:
            kept.append(f)
    return SideFindings(tuple(kept), tuple(open_))


def _judge(run: _Run) -> Judged:
    """The finding on a run, if one may be stated."""
    limits, length = run.limits, run.axle.blocks.length
    evidence = evidence_of_explanations(run.side, run.start, run.stop, run.axle, run.path, limits.min_opening)
    ranked = _ranked(evidence, run)
    gain = max(evidence.values()) - evidence[NO_FAULT]
    choice = _chosen(evidence, ranked, limits.min_probability)
    if choice is None or gain <= 0:
        return Judged(run.start, run.stop, None)
    epsilon, sat = estimate_size(choice.side, choice.row, run.start, run.stop, run.axle, run.path)
    stuck_valve = choice.side is Side.ACTUATOR and choice.mode is FaultMode.STUCK
    hypotheses = tuple(_hypothesis(fault, p) for fault, p in ranked if p >= _LEAST_LISTED)
    if stuck_valve and sat is not None and abs(sat.mean) < limits.min_opening:
        hypotheses = _at_zero(hypotheses)
        choice, sat = choice._replace(mode=FaultMode.NO_SIGNAL, probability=hypotheses[0].p), None
    start, stop = run.start, run.stop
    if choice.needs_motion and not run.axle.model.opening_measured:
        first, last, seconds = asked(run.axle, start, stop)
        if seconds < LEAST_ASKED_S:
            return Judged(run.start, run.stop, None)
        pad = round(_BELIEVED_S / run.axle.blocks.dt)
        start, stop = max(start, first - pad), min(stop, last + pad)
    if not _may_be_stated(choice, epsilon, run) or (
        choice.dead_sensor and at_rest(run.axle, run.start, run.stop, command_logged=run.command_logged)
    ):
        return Judged(run.start, run.stop, None)
    finding = Finding(
        start=start * length,
        stop=stop * length,
        side=choice.stated,
        mode=choice.mode,
        probability=min(1.0, choice.probability),
        hypotheses=hypotheses,
        epsilon=epsilon,
        sat=sat,
        evidence=_sentences(choice, gain, ranked, run),
        tier=Tier.SIGNAL if choice.dead_sensor else Tier.MODEL,
    )
    return Judged(start, stop, finding)


def _at_zero(hypotheses: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Hypotheses of a valve that is stuck where it lets nothing through: it has no signal."""
    row = (Side.ACTUATOR.value, FaultMode.NO_SIGNAL.value)
    alike = {(Side.ACTUATOR.value, FaultMode.STUCK.value), row}
    rest = [h for h in hypotheses if (h.side, h.mode) not in alike]
    dead = Hypothesis(*row, sum(h.p for h in hypotheses if (h.side, h.mode) in alike))
    return tuple(sorted([dead, *rest], key=lambda h: -h.p))


def _ranked(evidence: Mapping[Explanation, float], run: _Run) -> list[tuple[Fault, float]]:
    """Faults and their probabilities, the most probable first; rows of one mode are one fault."""
    top = max(evidence.values())
    weight = {key: np.exp(max(-700.0, _TEMPER * (value - top))) for key, value in evidence.items()}
    total = sum(weight.values())
    dead = run.side is Side.SENSOR and run.row in (STUCK, NO_SIGNAL)
    zero = dead and level_of(run.start, run.stop, run.axle)[0] == 0.0
    pooled: dict[Fault, float] = {}
    for key, w in weight.items():
        fault: Fault = key.side, key.mode
        if zero and fault == (Side.SENSOR, FaultMode.STUCK):
            fault = Side.SENSOR, FaultMode.NO_SIGNAL  # stuck at zero and no signal are one row of the table
        pooled[fault] = pooled.get(fault, 0.0) + float(w / total)
    return sorted(pooled.items(), key=lambda item: -item[1])


def _chosen(
    evidence: Mapping[Explanation, float], ranked: Sequence[tuple[Fault, float]], least: float
) -> _Choice | None:
    """The most probable fault; None where the axle is healthy.

    Where neither side is probable enough, a loss of gain may be stated of both.
    """
    (side, mode), probability = ranked[0]
    if side is None or mode is None:
        return None
    stated = side
    if mode is FaultMode.INEFFICIENT and probability < least:
        both = sum(p for (_, m), p in ranked if m is mode)
        if both >= least:
            stated, probability = Side.SENSOR_OR_ACTUATOR, both
    row = max((key for key in evidence if key.side is side), key=lambda key: evidence[key]).row
    return _Choice(stated, side, mode, row, probability)


def _may_be_stated(choice: _Choice, epsilon: Epsilon | None, run: _Run) -> bool:
    """Whether the choice is probable, large and lasting enough, and on the side that the run is of."""
    limits = run.limits
    elsewhere = choice.stated not in (run.side, Side.SENSOR_OR_ACTUATOR)
    modelled = choice.side is Side.ACTUATOR and not run.axle.model.opening_measured
    too_long = modelled and run.stop - run.start > _MOST * run.path.model.size
    small = choice.mode is FaultMode.INEFFICIENT and epsilon is not None and epsilon.value < limits.min_epsilon
    flicker = lapse(run.axle, run.start, run.stop) if choice.dead_sensor else run.seconds < _BRIEF_S
    return not (choice.probability < limits.min_probability or too_long or small or flicker or elsewhere)


def _sentences(choice: _Choice, gain: float, ranked: Sequence[tuple[Fault, float]], run: _Run) -> tuple[str, ...]:
    """What decided, one sentence each."""
    channel = run.axle.names[0]
    more = probable_words(gain, f"with “{_words((choice.side, choice.mode))}”", "with a healthy axle")
    words = f"Over {lasting(run.seconds, 2)} {channel} is {more}."
    lines: list[str] = [Sentence(About.TIMES, words)]
    if choice.dead_sensor:
        level, spread, count = level_of(run.start, run.stop, run.axle)
        lines.append(
            f"{channel} stayed at {amount(level, 'rad')}, give or take {amount(0.5 * spread, 'rad', 2)}, over {count} samples."
            if count
            else f"{channel} delivered nothing while other channels of its source did."
        )
    fault, probability = next((item for item in ranked[1:] if item[0] != _NO_FAULT), (_NO_FAULT, 0.0))
    if probability >= _LEAST_NAMED:
        lines.append(f"Next best: {_words(fault)} with {100 * probability:.1f} %.")
    if choice.stated is Side.SENSOR_OR_ACTUATOR:
        lines.append(
            "Without a second measurement, a loss of gain of the sensor and one of the {valve} cannot be distinguished here."
        )
    return tuple(lines)


def _hypothesis(fault: Fault, probability: float) -> Hypothesis:
    side, mode = fault
    if side is None or mode is None:
        return Hypothesis("none", State.HEALTHY.value, probability)
    return Hypothesis(side.value, mode.value, probability)


def _words(fault: Fault) -> str:
    """Part and mode: ``steering valve stuck``."""
    hypothesis = _hypothesis(fault, 1.0)
    return f"{part_token(Kind.STEER, hypothesis.side)} {mode_words(hypothesis.side, hypothesis.mode)}"
