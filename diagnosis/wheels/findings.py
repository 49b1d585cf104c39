"""From the segments of one wheel to findings, and to what stays open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.viterbi import first_lasting
from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.results.sentence import About, Sentence
from diagnosis.wheels.alive import lives
from diagnosis.wheels.blocks import per_sample
from diagnosis.wheels.isolation import Run, judge
from diagnosis.wheels.models import TOTAL_SENSOR, WheelFilterModel
from diagnosis.wheels.onset import onset_sentence, refined, released
from diagnosis.wheels.runs import Runs
from diagnosis.wheels.tracks import Segment
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

_HOLD_S = 0.1
_REACH_S = 0.4  # within which the raw signal shows an edge that the Kalman models did not place
_PROBABLE, _OF_STEP, _SEEN_STEP = 0.8, 0.5, 8.0  # a loss less probable needs a step; share that is one; times the noise
_MOST_STEPLESS = 0.85  # of a loss without one: a sensor that fades, or another cause of what the wheel does
_NO_STEP = Sentence(
    About.ONSET,
    "A sensor's loss that comes or goes at once makes a step, which is missing here: it fades, or something else than the sensor changed.",
)
_LEAST_HEALTHY = 0.95  # probability below which a side is not called healthy
_TOGETHER = 0.5  # of a run: where no wheel turns, none of them is known to be dead
_USUAL = 0.5  # below this it deviates by more than what healthy machines do


@dataclass(frozen=True)
class Weighed:
    """One segment, and all models' evidence over it.

    Attributes
    ----------
    segment : Segment
        In blocks.
    evidence, mean, cov : Array, shape (models,), (models, 4) and (models, 4, 4)
        As in `RunEvidence`, of its run.
    """

    segment: Segment
    evidence: Array
    mean: Array
    cov: Array


@dataclass(frozen=True)
class WheelPath:
    """One wheel and its segments.

    Attributes
    ----------
    y : Array, shape (n,)
        Measured speed [m/s].
    reference : Array, shape (n,)
        Commanded speed [m/s]; NaN where there is none.
    stands : NDArray[np.bool_], shape (n,)
        Where every wheel reads as if the machine stood.
    names : tuple[str, str]
        Names of speed and opening.
    model : WheelFilterModel
        Constants of its filters.
    dt, width : float, int
        Step [s] and samples per block.
    runs : Runs
        Of the Kalman models' path, in blocks.
    segments : Sequence[Weighed]
        Of both sides.
    expected, spread : Array, shape (blocks,)
        As in `RunEvidence`.
    healthy : Mapping[Side, Array], each of shape (blocks,)
        Probability that a side is healthy.
    raised : NDArray[np.bool_], shape (blocks,)
        Where a causal reading holds a fault for most probable.
    others : int
        Other wheels with a model.
    """

    y: Array
    reference: Array
    stands: NDArray[np.bool_]
    names: tuple[str, str]
    model: WheelFilterModel
    dt: float
    width: int
    runs: Runs
    segments: Sequence[Weighed]
    expected: Array
    spread: Array
    healthy: Mapping[Side, Array]
    raised: NDArray[np.bool_]
    others: int


@dataclass(frozen=True)
class WheelFindings:
    """What the segments of one wheel say.

    Attributes
    ----------
    findings : list[Finding]
        Faults of either side.
    opened : dict[Side, NDArray[np.bool_]], each of shape (n,)
        Where it stays open whether a side is healthy.
    unexplained : dict[Side, NDArray[np.bool_]], each of shape (n,)
        Where that is more than what the model's own errors do on healthy missions too.
    """

    findings: list[Finding] = field(default_factory=list)
    opened: dict[Side, NDArray[np.bool_]] = field(default_factory=dict)
    unexplained: dict[Side, NDArray[np.bool_]] = field(default_factory=dict)

    def of(self, side: Side) -> list[Finding]:
        """Findings of a side, and those of the union of both."""
        return [f for f in self.findings if f.side in (side, Side.SENSOR_OR_ACTUATOR)]


def findings_of(path: WheelPath, limits: Limits) -> WheelFindings:
    """Judge the segments of one wheel.

    Parameters
    ----------
    path : WheelPath
        The wheel.
    limits : Limits
        What counts.
    """
    y, out = path.y, WheelFindings()
    for side, p in path.healthy.items():
        out.opened[side] = np.asarray(per_sample(p < _LEAST_HEALTHY, path.width, y.size))
        out.unexplained[side] = np.asarray(per_sample(p < _USUAL, path.width, y.size))
    for w in path.segments:
        start, stop = _edges(path, w.segment)
        if stop <= start:
            continue
        together = float(np.mean(path.stands[start:stop])) > _TOGETHER
        alive = together or lives(y[start:stop], path.reference[start:stop], path.model.noise, path.model.span)
        run = Run(start, stop, w.segment.side, w.segment.pooled, w.evidence, w.mean, w.cov, path.others, alive)
        verdict = judge(run, y[start:stop], path.model, limits, path.names, path.dt)
        if verdict.hidden:
            out.opened[Side.ACTUATOR][start:stop] = True
        found = verdict.finding
        if found is None or _repeated(found, out.findings):
            continue
        if _stepless(path, found):
            if found.probability < _PROBABLE:
                continue
            found = limited(found, _MOST_STEPLESS, _NO_STEP)
        out.findings.append(_detected(path, w.segment, found))
    blind = [f for f in out.findings if f.side is Side.SENSOR and f.mode.total]
    out.findings[:] = [f for f in out.findings if f.side is not Side.ACTUATOR or _seen(f, blind) > 0.5]
    return out


def _seen(finding: Finding, blind: Sequence[Finding]) -> float:
    """Share of a valve's finding in which the wheel's speed is known."""
    hidden = sum(max(0, min(f.stop, finding.stop) - max(f.start, finding.start)) for f in blind)
    return 1.0 - hidden / (finding.stop - finding.start)


def _repeated(finding: Finding, before: Sequence[Finding]) -> bool:
    """Whether a finding is one of the union of both sides that the other side gave already."""
    return any(
        f.side is Side.SENSOR_OR_ACTUATOR
        and finding.side is f.side
        and f.start < finding.stop
        and finding.start < f.stop
        for f in before
    )


def _stepless(path: WheelPath, finding: Finding) -> bool:
    """Whether a sensor's loss lacks the step of its reading with which one begins and ends, where it does so at once.

    At a speed at which a step is no more than the noise, none is missed.
    """
    if (finding.side, finding.mode) != (Side.SENSOR, FaultMode.INEFFICIENT):
        return False
    lost, reach, y = finding.epsilon.value if finding.epsilon else 0.0, 2 * path.width, path.y
    missed = 0
    for edge in (finding.start, finding.stop):
        low, high = max(0, edge - reach), min(y.size, edge + reach)
        around = y[low:high][np.isfinite(y[low:high])]
        if edge == 0 or edge >= y.size or around.size < 2:
            continue
        step = lost * float(np.median(np.abs(around)))
        if float(np.max(np.abs(np.diff(around)))) >= _OF_STEP * step:
            return False
        missed += step > _SEEN_STEP * path.model.noise
    return missed > 0


def _edges(path: WheelPath, segment: Segment) -> tuple[int, int]:
    """Samples [start, stop) of a segment, at the raw rate where a sensor's fault shows them."""
    y, width, noise, m = path.y, path.width, path.model.noise, segment.model
    exact, far = 2 * width, round(_REACH_S / path.dt)
    start, stop = segment.start * width, min(y.size, segment.stop * width)
    start = refined(start, y, exact if (path.runs.start == segment.start).any() else far, m, noise)
    if stop < y.size:
        reach = exact if (path.runs.stop == segment.stop).any() else far
        stop = released(stop, y, reach) if m in TOTAL_SENSOR else refined(stop, y, reach, m, noise)
    return start, stop


def _detected(path: WheelPath, segment: Segment, finding: Finding) -> Finding:
    """The finding with the sample of its detection, and a sentence about its onset."""
    hold = path.width * path.dt
    causal = first_lasting(path.raised, segment.start, segment.stop, 2, max(1, round(_HOLD_S / hold)))
    seen = None if causal is None else max(finding.start, min(causal * path.width, finding.stop - 1))
    shape = onset_sentence(finding.start, path.y, path.model, path.dt, path.names[0], finding.side)
    return replace(finding, detected=seen, evidence=(*finding.evidence, shape))
