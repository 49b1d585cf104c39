"""From the most probable path of one wheel to findings, and to what its runs leave open."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.debounce import debounced
from diagnosis.estimation.viterbi import first_lasting
from diagnosis.results.assessment import Finding
from diagnosis.wheels.blocks import per_sample
from diagnosis.wheels.calibration import RunContext
from diagnosis.wheels.isolation import Run, judge
from diagnosis.wheels.models import HEALTHY, S_GAIN, S_NONE, S_STUCK, TOTAL_SENSOR, WheelFilterModel
from diagnosis.wheels.onset import onset_sentence, refined, released
from diagnosis.wheels.run_kernel import RunEvidence
from diagnosis.wheels.runs import Runs
from diagnosis.wheels.step_kernel import RESTS
from replay.faults import Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

_HOLD_S = 0.1
_CONSTANT_S = 0.5  # a shorter time of one value may be a hold
_ODD_S, _GAP_S = 0.5, 0.2


@dataclass(frozen=True)
class Surroundings:
    """What a wheel's judgement is weighed by, beside its own path.

    Attributes
    ----------
    misfit : float
        What the wheels' plants leave of the speed in the windows that agree best [1].
    opening : Array, shape (blocks,)
        Mean effective opening [fraction].
    usual : float
        Its usual size where the wheel drives [fraction].
    others : Array, shape (blocks,)
        Other wheels that are taken to be faulty.
    unseen, doubtful : NDArray[np.bool_], shape (blocks,)
        Where the opening lies beyond what a healthy wheel was seen with, and where a steering angle is in doubt.
    """

    misfit: float
    opening: Array
    usual: float
    others: Array
    unseen: NDArray[np.bool_]
    doubtful: NDArray[np.bool_]


@dataclass(frozen=True)
class WheelPath:
    """One wheel on its most probable path.

    Attributes
    ----------
    y : Array, shape (n,)
        Measured speed [m/s].
    names : tuple[str, str]
        Names of speed and opening.
    model : WheelFilterModel
        Constants of its filters.
    dt, width : float, int
        Step [s] and samples per block.
    runs : Runs
        Of the path, in blocks.
    evidence : RunEvidence
        Of all models over the runs.
    raised : NDArray[np.bool_], shape (blocks,)
        Where a causal reading holds a fault for most probable.
    fault : Array, shape (blocks,)
        Probability by the same that the wheel is not healthy.
    habit : NDArray[np.int8], shape (blocks,)
        As in `WheelBlocks`.
    odd : NDArray[np.bool_], shape (blocks,)
        Where a healthy wheel under an unusual load is most probable: what its valve does then stays open.
    surroundings : Surroundings
        What its judgement is weighed by besides.
    """

    y: Array
    names: tuple[str, str]
    model: WheelFilterModel
    dt: float
    width: int
    runs: Runs
    evidence: RunEvidence
    raised: NDArray[np.bool_]
    fault: Array
    habit: NDArray[np.int8]
    odd: NDArray[np.bool_]
    surroundings: Surroundings


@dataclass(frozen=True)
class WheelFindings:
    """What the runs of one wheel say.

    Attributes
    ----------
    findings : list[Finding]
        Faults of either side in order of time.
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


def findings_of(path: WheelPath, limits: Limits, *, gains: bool) -> WheelFindings:
    """Judge the runs of one wheel.

    Parameters
    ----------
    path : WheelPath
        The wheel.
    limits : Limits
        What counts.
    gains : bool
        Whether the wheel model is good enough to judge gains and the valve by.
    """
    y, runs, evidence = path.y, path.runs, path.evidence
    none = {side: np.zeros(y.size, dtype=np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)}
    out = WheelFindings(opened=none, unexplained={side: at.copy() for side, at in none.items()})
    odd = np.asarray(per_sample(path.odd, path.width, y.size))
    out.opened[Side.ACTUATOR][debounced(odd, round(_GAP_S / path.dt), round(_ODD_S / path.dt))] = True
    for r in np.flatnonzero(runs.model != HEALTHY).tolist():
        start, stop = _edges(path, r)
        if stop <= start:
            continue
        if runs.model[r] in TOTAL_SENSOR and path.model.constant_noise >= path.model.noise and not _rests(path, r):
            held = y[start:stop][np.isfinite(y[start:stop])]
            moves = held.size > 0 and float(np.ptp(held)) > 0  # by a rounding step at least: it is not stuck
            expected = held.size > 0 and _as_expected(path, r, float(np.median(held)))
            if moves or expected:
                for side in _left_by_rounding(moves=moves, expected=expected):
                    out.opened[side][start:stop] = True
                continue
        run = Run(
            start=start,
            stop=stop,
            model=_constant(path, r, y[start:stop]),
            evidence=evidence.evidence[r],
            mean=evidence.mean[r],
            cov=evidence.cov[r],
            context=_context(path, r, (stop - start) * path.dt),
        )
        verdict = judge(run, y[start:stop], path.model, limits, path.names, path.dt, gains=gains)
        for side in verdict.open_sides:
            out.opened[side][start:stop] = True
            if not verdict.usual:
                out.unexplained[side][start:stop] = True
        if verdict.finding is not None:
            out.findings.append(_detected(path, r, verdict.finding))
    return out


def _left_by_rounding(*, moves: bool, expected: bool) -> tuple[Side, ...]:
    """Sides that stay open where a steady speed has no noise because of its rounding.

    A speed that a healthy wheel would have says nothing against the valve, and nothing of the sensor unless it moves. Any other
    speed that moves is no stuck sensor; what it is instead, such as a valve that stands open, the run does not tell.
    """
    if expected:
        return () if moves else (Side.SENSOR,)
    return (Side.SENSOR, Side.ACTUATOR)


def _constant(path: WheelPath, r: int, y: Array) -> int:
    """Model of a run: no signal or stuck where a sensor that seems to give a share of the speed gives one value alone."""
    m = int(path.runs.model[r])
    held = y[np.isfinite(y)]
    if m != S_GAIN or held.size * path.dt < _CONSTANT_S or float(np.ptp(held)) > 0:
        return m
    if held[0] == 0.0:
        return S_NONE
    return S_STUCK if _rests(path, r) else m


def _rests(path: WheelPath, r: int) -> bool:
    """Whether a stepwise sensor kept its value for longer than its kind does, in most of a run."""
    return bool(np.mean(path.habit[path.runs.start[r] : path.runs.stop[r]] == RESTS) > 0.5)


def _context(path: WheelPath, r: int, seconds: float) -> RunContext:
    """What is known of a run beside its evidence."""
    runs, around = path.runs, path.surroundings
    part = slice(int(runs.start[r]), max(int(runs.stop[r]), int(runs.start[r]) + 1))
    u = around.opening[part]
    return RunContext(
        seconds=seconds,
        misfit=around.misfit,
        others=float(around.others[part].mean()),
        unseen=float(around.unseen[part].mean()),
        doubtful=float(around.doubtful[part].mean()),
        changes=float(u.std() / max(around.usual, 1e-6)),
        before=int(runs.model[r - 1]) if r > 0 else HEALTHY,
        after=int(runs.model[r + 1]) if r + 1 < runs.model.size else HEALTHY,
    )


def _edges(path: WheelPath, r: int) -> tuple[int, int]:
    """Samples [start, stop) of a run, at the raw rate where a sensor's fault shows them."""
    runs, y, width, noise = path.runs, path.y, path.width, path.model.noise
    m = int(runs.model[r])
    start = refined(int(runs.start[r]) * width, y, 2 * width, m, noise)
    stop = min(y.size, int(runs.stop[r]) * width)
    after = int(runs.model[r + 1]) if r + 1 < runs.model.size else HEALTHY
    if after == HEALTHY and stop < y.size:
        stop = released(stop, y, 2 * width) if m in TOTAL_SENSOR else refined(stop, y, 2 * width, m, noise)
    return start, stop


def _as_expected(path: WheelPath, r: int, level: float) -> bool:
    """Whether a healthy wheel would have stayed near `level` [m/s] over the run."""
    expected = path.evidence.expected[path.runs.start[r] : path.runs.stop[r]]
    return float(np.abs(expected - level).max(initial=0.0)) < 3 * path.model.load


def _detected(path: WheelPath, r: int, finding: Finding) -> Finding:
    """The finding with the sample of its detection, and a sentence about its onset."""
    first, last, hold = int(path.runs.start[r]), int(path.runs.stop[r]), path.width * path.dt
    causal = first_lasting(path.raised, first, last, 2, max(1, round(_HOLD_S / hold)))
    seen = None if causal is None else max(finding.start, min(causal * path.width, finding.stop - 1))
    shape = onset_sentence(finding.start, path.y, path.model, path.dt, path.names[0], finding.side)
    return replace(finding, detected=seen, evidence=(*finding.evidence, shape))
