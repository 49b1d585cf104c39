"""From a wheel's run in one model to a finding: alternatives with probabilities, ε̂ and saturation term, raw-rate edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.wheels import step_kernel as ws
from diagnosis.wheels.models import WheelFilterModel
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

_TEMPER = 0.1
_PRIOR = np.log(np.where(np.arange(ws.MODELS) == ws.HEALTHY, 0.6, 0.4 / (ws.MODELS - 1)))
_SIDES = (Side.SENSOR, Side.ACTUATOR)
_PATH_SHARE = 0.5  # of the most probable row's probability, from which on the path's row is stated
_WEAK_GAIN = 0.35  # a sensor's gain below this hides what the valve does
_LEAST_DISTURBANCE_S = 2.0  # shorter ones are what the model gets wrong while a wheel recovers
_STEEP, _HALF = 1.2, 5.9  # calibrated on tuning seeds: half of the valve findings with exp(5.9) are right
_NOISY_EVIDENCE, _LEAST_NOISE_S = 500.0, 1.0  # per second; seconds
_USUAL = 0.25
_LEAST_TRUST, _NO_TRUST = 0.5, 0.05  # a finding is stated from the first on; below the second it leaves nothing open
_NOISY_LOSS = 0.35  # 95 % of the errors of a noisy sensor's ε̂ on tuning seeds
_LEAST_PART = 0.02  # a hypothesis below this is left out of the text


@dataclass(frozen=True)
class Run:
    """One stretch of one wheel: samples [start, stop), the path's model, and every model's evidence and state.

    Attributes
    ----------
    evidence : Array, shape (models,)
        Log-likelihoods; −inf where a model is not considered.
    mean, cov : Array, shape (models, 4) and (models, 4, 4)
        States at its end.
    """

    start: int
    stop: int
    model: int
    evidence: Array
    mean: Array
    cov: Array


@dataclass(frozen=True)
class Verdict:
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


def probabilities(run: Run) -> dict[tuple[str, str], float]:
    """Probability of every row; several models of one row add up.

    The models' errors are no white noise, so that their log-likelihoods count for a tenth (calibrated on simulated
    missions by `tests/benchmarks/accuracy.py`).
    """
    weight = _PRIOR + np.clip(_TEMPER * (run.evidence - run.evidence.max()), -700.0, 0.0)
    p = np.exp(weight - weight.max())
    p /= p.sum()
    out: dict[tuple[str, str], float] = {}
    for name, q in zip(ws.NAMES, p, strict=True):
        out[name] = out.get(name, 0.0) + float(q)
    return out


def judge(
    run: Run,
    y: Array,
    model: WheelFilterModel,
    limits: Limits,
    names: tuple[str, str],
    dt: float,
    *,
    gains: bool,
) -> Verdict:
    """Turn a run into a finding.

    Parameters
    ----------
    run : Run
        The run.
    y : Array, shape (stop − start,)
        Measured speed [m/s]; NaN where there is none.
    model : WheelFilterModel
        The wheel.
    limits : Limits
        What counts.
    names : tuple[str, str]
        Speed and opening, for the text.
    dt : float
        Step [s].
    gains : bool
        Whether the wheel model is good enough to judge gains and the valve by.
    """
    pooled = probabilities(run)
    own = ws.NAMES[run.model]
    known = y[np.isfinite(y)]
    silent = known.size == 0 or abs(float(np.mean(known))) <= 3 * model.rounding
    if silent and run.model in (ws.S_STUCK, ws.S_NONE):  # stuck at zero and no signal are one row of the table
        pooled["sensor", "no_signal"] += pooled.pop(("sensor", "stuck"))
    drained = float(run.mean[ws.A_STUCK, 3]) / model.K
    if abs(drained) < max(limits.min_sat, 1.5 * model.load / model.K):  # stuck shut is no control signal
        pooled["actuator", "no_signal"] += pooled.pop(("actuator", "stuck"))
    ranked = sorted(pooled.items(), key=lambda item: -item[1])
    faulty = {side: sum(p for (s, _), p in ranked if s == side.value) for side in _SIDES}
    open_sides = tuple(side for side in _SIDES if faulty[side] > 1 - limits.min_probability)
    side = max(_SIDES, key=lambda s: faulty[s])
    best = next(((name, p) for name, p in ranked if name[0] == side.value), None)
    if best is None:
        return Verdict(None)
    if own[0] == side.value and pooled.get(own, 0.0) > _PATH_SHARE * best[1]:
        best = own, pooled[own]  # the path knows what came before and after
    (_, mode), probability = best
    ahead = float(np.max(run.evidence[[n[0] == side.value for n in ws.NAMES]]) - run.evidence[ws.HEALTHY])
    if side is Side.ACTUATOR and _chance(ahead) < _NO_TRUST:
        return Verdict(None, tuple(s for s in open_sides if s is not side))
    usual = side is Side.ACTUATOR and _chance(ahead) < _USUAL
    stated = side
    if faulty[side] < limits.min_probability:
        other = Side.ACTUATOR if side is Side.SENSOR else Side.SENSOR
        both = probability + pooled.get((other.value, mode), 0.0)
        if mode != "inefficient" or both < limits.min_probability:
            return Verdict(None, open_sides, usual)
        stated, probability = Side.SENSOR_OR_ACTUATOR, both
    m = int(np.argmax(np.where([n == (side.value, mode) for n in ws.NAMES], run.evidence, -np.inf)))
    supported = m
    if mode == "no_signal":  # also what is stuck at nothing
        m = ws.S_NONE if side is Side.SENSOR else ws.A_NONE
        stuck = ws.S_STUCK if side is Side.SENSOR else ws.A_STUCK
        supported = m if run.evidence[m] >= run.evidence[stuck] else stuck
    plain = m in (ws.S_STUCK, ws.S_NONE, *range(ws.S_WHITE_3, ws.S_OU_SMALL))
    if not gains and not plain:
        return Verdict(None, _SIDES)
    trust = _trust(run, supported, (run.stop - run.start) * dt)
    if trust < _LEAST_TRUST:
        return Verdict(None, tuple({*open_sides, side}), usual)
    probability *= trust
    trusted = [(name, p * trust + (1 - trust if name[1] == "healthy" else 0.0)) for name, p in ranked]
    ranked = sorted(trusted, key=lambda item: -item[1])
    epsilon, sat = _estimate(m, known, run, model)
    if epsilon is not None and m in (ws.S_GAIN, ws.A_GAIN) and epsilon.value < limits.min_epsilon:
        return Verdict(None)
    brief = (run.stop - run.start) * dt < _LEAST_DISTURBANCE_S
    if m == ws.A_BIAS and (brief or (epsilon is not None and epsilon.high < 0)):
        return Verdict(None, (*open_sides, Side.ACTUATOR), usual)  # the model's own error, or nothing that is lost
    return Verdict(
        Finding(
            start=run.start,
            stop=run.stop,
            side=stated,
            mode=FaultMode(mode),
            probability=min(1.0, probability),
            hypotheses=tuple(Hypothesis(s, n, q) for (s, n), q in ranked if q >= 5e-4),
            epsilon=epsilon,
            sat=sat,
            evidence=_sentences(run, m, stated, mode, known, ranked, names, dt),
            tier="signal" if m in (ws.S_STUCK, ws.S_NONE) else "model",
        ),
        _left_open(open_sides, side, m, run),
    )


def _trust(run: Run, m: int, seconds: float) -> float:
    """Share of findings with this much evidence that are faults at all, on simulated missions with many faults.

    A wheel that recovers, a tyre that slips or a wrong share of the pump's flow may speak against a healthy wheel too,
    with hundreds of units of log-evidence; a loss of a sensor's gain, its silence or constancy are never their work.
    """
    ahead = float(run.evidence[m] - run.evidence[ws.HEALTHY])
    if m >= ws.A_GAIN:
        return _chance(ahead)
    if m >= ws.S_WHITE_3:  # what a recovering wheel does may look like a second of noise
        return 1.0 if ahead > _NOISY_EVIDENCE * seconds and seconds > _LEAST_NOISE_S else 0.4
    return 1.0


def _chance(ahead: float) -> float:
    """The same for valves by their log-evidence against a healthy wheel."""
    return float(1 / (1 + np.exp(-_STEEP * (np.log(max(ahead, 1.0)) - _HALF))))


def _left_open(open_sides: tuple[Side, ...], side: Side, m: int, run: Run) -> tuple[Side, ...]:
    """Sides that stay open beside a finding: also the valve under a sensor that shows hardly anything of it."""
    left = {s for s in open_sides if s is not side}
    if ws.S_GAIN <= m <= ws.S_OU_LARGE and float(run.mean[m, 1]) < _WEAK_GAIN:
        left.add(Side.ACTUATOR)
    return tuple(left)


def _sentences(
    run: Run,
    m: int,
    side: Side,
    mode: str,
    known: Array,
    ranked: list[tuple[tuple[str, str], float]],
    names: tuple[str, str],
    dt: float,
) -> tuple[str, ...]:
    """What decided, with figures."""
    seconds = (run.stop - run.start) * dt
    ahead = run.evidence[m] - run.evidence[ws.HEALTHY]
    lines = [
        f"Over {seconds:.3f} s the model “{ws.NAMES[m][0]} {mode.replace('_', ' ')}” explains {names[0]} better than a "
        f"healthy wheel by a log-evidence of {ahead:.0f}."
    ]
    if m in (ws.S_STUCK, ws.S_NONE) and known.size:
        lines.append(f"{names[0]} stayed within {float(np.ptp(known)):.2g} m/s of {float(np.mean(known)):.4g} m/s.")
    stated = ws.NAMES[m][0], mode
    second = next((item for item in ranked if item[0][1] != "healthy" and item[0] != stated), None)
    if second is not None and second[1] >= _LEAST_PART:
        lines.append(f"Next best: {second[0][0]} {second[0][1].replace('_', ' ')} with {100 * second[1]:.0f} %.")
    if side is Side.SENSOR_OR_ACTUATOR:
        lines.append("Without a second measurement a loss of gain of the sensor and of the valve look alike here.")
    return tuple(lines)


def _estimate(m: int, y: Array, run: Run, model: WheelFilterModel) -> tuple[Epsilon | None, Sat | None]:
    """ε̂ and the saturation term of a model from its state at the end of the run."""
    z, P = run.mean[m], run.cov[m]
    g, g_std = float(z[1]), float(np.sqrt(max(P[1, 1], 0.0)))
    loss = Epsilon(1 - g, 1 - g - 1.96 * g_std, 1 - g + 1.96 * g_std)
    if m in (ws.S_STUCK, ws.S_NONE):
        if not y.size:
            return Epsilon(1.0, 1.0, 1.0), None
        level, rms = float(np.mean(y)), float(np.sqrt(np.mean(y**2)))
        half = 1.96 * model.rounding
        return Epsilon(1.0, 1.0, 1.0), Sat(level, rms, level - half, level + half, "m/s")
    if m in (ws.S_GAIN, ws.A_GAIN):
        return loss, None
    half = 1.96 * float(np.sqrt(max(P[3, 3], 0.0)))
    if m in (ws.A_STUCK, ws.A_NONE):
        level = float(z[3]) / model.K if m == ws.A_STUCK else 0.0
        half /= model.K
        return Epsilon(1.0, 0.0, 1.0), Sat(level, abs(level), level - half, level + half, "of full opening")
    eps = max(1 - g, 0.05)
    if m == ws.A_BIAS:
        level, half = float(z[3]) / model.K, half / model.K
        return loss, Sat(level / eps, abs(level) / eps, (level - half) / eps, (level + half) / eps, "of full opening")
    # gain and bias of a noisy sensor trade off against each other while the speed hardly changes
    half_loss = max(1.96 * g_std, _NOISY_LOSS)
    loss = Epsilon(1 - g, max(0.0, 1 - g - half_loss), min(1.0, max(1 - g + half_loss, 1 - g)))
    noise = float(np.sqrt(np.mean((y - np.mean(y)) ** 2))) if y.size else 0.0
    level = float(z[3]) / eps
    return loss, Sat(level, float(np.hypot(level, noise / eps)), level - half / eps, level + half / eps, "m/s")


def onset_sentence(start: int, y: Array, model: WheelFilterModel, dt: float, name: str, side: Side) -> str:
    """What the shape of the onset says: a sensor's fault may jump by more than a wheel can, a valve's bends."""
    low, high = max(1, start - 2), min(y.size, start + 3)
    if high <= low or start == 0:
        return "The fault was there from the first sample, so its onset says nothing."
    steps = np.abs(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]))
    largest = float(steps.max())
    fastest = float(np.nan_to_num(np.abs(y[low - 1 : high])).max())
    able = (model.K + fastest) * min(1.0, dt / model.tau)  # by a wheel whose valve opens wholly the other way
    jump = f"At its onset {name} jumps by {largest:.2g} m/s within one sample ({largest / model.noise:.0f} times its noise)"
    beyond = largest > max(8 * model.noise, able)
    if side is Side.ACTUATOR:
        if beyond:
            return f"{jump}: a valve's fault alone does not explain that."
        return f"At its onset {name} bends with its lag, no step exceeds {largest:.2g} m/s: as a wheel does that its valve leaves."
    if beyond:
        return f"{jump}: a sensor can, a wheel cannot."
    return f"{jump}." if largest > 8 * model.noise else f"At its onset no step of {name} exceeds {largest:.2g} m/s."


def refined(start: int, y: Array, reach: int, m: int, noise: float) -> int:
    """Onset of a sensor's fault at the raw rate: it jumps within one sample, or stops changing.

    Parameters
    ----------
    start : int
        Sample at which the run begins, to a block.
    y : Array, shape (n,)
        Measured speed [m/s].
    reach : int
        Samples to look around.
    m : int
        Model of the run.
    noise : float
        White noise of the sensor [m/s].
    """
    low, high = max(1, start - reach), min(y.size, start + reach + 1)
    if high - low < 2 or not (ws.S_STUCK <= m <= ws.S_OU_LARGE):
        return start
    steps = np.abs(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]))
    at = int(np.argmax(steps))
    if steps[at] > 8 * noise:
        return low + at
    if m in (ws.S_STUCK, ws.S_NONE):
        moving = np.flatnonzero(steps > 0)
        return low + int(moving[-1]) if moving.size else low - 1
    return start
