"""One run of a wheel's path turned into a finding: alternatives with their probabilities, ε̂, saturation term, reasons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis import wheel_filter as wf
from diagnosis import wheel_scan as ws
from diagnosis.assessment import Finding
from diagnosis.noise import COARSE_STEP_S, white_part
from diagnosis.result import Epsilon, Hypothesis, Sat
from replay.faults import FaultMode, Side
from replay.machine import Limits, Noise

Array = NDArray[np.float64]

_TEMPER = 0.1
_RUN_IN_S = 2.0


@dataclass(frozen=True)
class WheelData:
    """One wheel's channels; shapes (n,).

    Attributes
    ----------
    y, u : Array
        Measured speed [m/s] and valve opening [fraction] in force since the step before, the measured one where
        logged.
    common : Array
        Load shared with the other wheels, as a speed [m/s].
    slack : Array
        Error of the wheel model beyond the load [m/s]; 0 where it holds.
    status : NDArray[np.int8]
        As in `diagnosis.modes`.
    quiet : NDArray[np.bool_]
        Where the wheel is neither commanded nor moving.
    u_measured : bool
        Whether `u` is the measured opening, so that the valve is judged elsewhere.
    """

    y: Array
    u: Array
    common: Array
    slack: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    u_measured: bool
    dt: float
    span: float
    noise: Noise
    names: tuple[str, str]


def judge(
    start: int, stop: int, kind: int, data: WheelData, model: wf.WheelFilterModel, limits: Limits, gains: bool
) -> Finding | None:
    """Turn a run into a finding with the alternatives' probabilities; None where it does not hold."""
    begin = max(0, start - round(_RUN_IN_S / data.dt))
    part = slice(begin, stop)
    evidence, z, P = wf.segment_evidence(
        data.y[part],
        data.u[part],
        data.common[part],
        data.slack[part],
        data.status[part],
        data.quiet[part],
        start - begin,
        model,
    )
    if evidence[kind] - evidence[ws.HEALTHY] < model.switch_cost:
        return None
    prior = np.log(np.where(np.arange(ws.MODELS) == ws.HEALTHY, 0.6, 0.05))
    if data.u_measured:
        prior[ws.A_GAIN :] = -50.0  # the valve is judged by its own measurement
    tempered = prior + np.clip(_TEMPER * (evidence - evidence.max()), -700, 0)
    p = np.exp(tempered - tempered.max())
    p /= p.sum()
    use = data.status[start:stop] == 1
    y = data.y[start:stop][use]
    pooled: dict[tuple[str, str], float] = {}
    for name, q in zip(ws.NAMES, p, strict=True):
        pooled[name] = pooled.get(name, 0.0) + float(q)
    silent = y.size == 0 or abs(float(np.mean(y))) <= 3 * model.constant_noise
    if silent and kind in (ws.S_STUCK, ws.S_NONE):  # stuck at zero and no signal are one row of the table
        pooled["sensor", "no_signal"] += pooled.pop(("sensor", "stuck"))
    ranked = sorted(pooled.items(), key=lambda item: -item[1])
    (side_name, mode_name), probability = ranked[0]
    if mode_name == "healthy":
        return None
    side = Side(side_name)
    if probability < limits.min_probability:
        other = Side.ACTUATOR if side is Side.SENSOR else Side.SENSOR
        both = probability + pooled.get((other.value, mode_name), 0.0)
        if both >= limits.min_probability and mode_name == "inefficient":
            side, probability = Side.SENSOR_OR_ACTUATOR, both
    m = int(np.argmax(np.where([n == (side_name, mode_name) for n in ws.NAMES], evidence, -np.inf)))
    if not gains and m not in (ws.S_STUCK, ws.S_NONE, ws.S_WHITE_3, ws.S_WHITE_8, ws.S_WHITE_25):
        return None
    epsilon, sat = _estimate(m, y, z[m], P[m], model)
    if m == ws.A_STUCK and sat is not None and abs(sat.mean) < max(limits.min_sat, 2 * model.load / model.K):
        m, mode_name = ws.A_NONE, "no_signal"
    if epsilon is not None and m in (ws.S_GAIN, ws.A_GAIN) and epsilon.value < limits.min_epsilon:
        return None
    if data.u_measured and side is not Side.SENSOR:
        return None
    if _model_error_explains(m, data.y[start:stop], data.slack[start:stop], data.dt):
        probability = 0.0
    seconds = (stop - start) * data.dt
    lines = [
        f"Over {seconds:.3f} s the model “{side_name} {mode_name.replace('_', ' ')}” explains {data.names[0]} better than "
        f"a healthy wheel by a log-evidence of {evidence[m] - evidence[ws.HEALTHY]:.0f}; a fault is considered from "
        f"{model.switch_cost:.0f}."
    ]
    if m in (ws.S_STUCK, ws.S_NONE) and y.size:
        lines.append(f"{data.names[0]} stayed within {float(np.ptp(y)):.2g} m/s of {float(np.mean(y)):.4g} m/s.")
    second = next((item for item in ranked[1:] if item[0][1] != "healthy"), None)
    if second is not None and second[1] >= 0.005:
        lines.append(f"Next best: {second[0][0]} {second[0][1].replace('_', ' ')} with {100 * second[1]:.1f} %.")
    if side is Side.SENSOR_OR_ACTUATOR:
        lines.append("Without a second measurement a loss of gain of the sensor and of the valve look alike here.")
    return Finding(
        start=start,
        stop=stop,
        side=side,
        mode=FaultMode(mode_name),
        probability=min(1.0, probability),
        hypotheses=tuple(Hypothesis(s, n, q) for (s, n), q in ranked if q >= 5e-4),
        epsilon=epsilon,
        sat=sat,
        evidence=tuple(lines),
        tier="signal" if m in (ws.S_STUCK, ws.S_NONE) else "model",
    )


def _model_error_explains(m: int, y: Array, slack: Array, dt: float) -> bool:
    """Whether a finding may be nothing but the wheel model's error where it is in doubt.

    A model in doubt looks like a drifting sensor, and in a slow log like any fault of gain; in such a log noise must
    also exceed what the valve's switching between samples does to the speed.
    """
    if float(np.mean(slack > 0)) <= 0.3:
        return False
    if m == ws.S_DRIFT:
        return True
    if dt < COARSE_STEP_S or m < ws.S_GAIN:
        return False
    if m not in (ws.S_WHITE_8, ws.S_WHITE_25):
        return True
    return float(np.sqrt(np.mean(white_part(y) ** 2))) < float(np.mean(slack))


def _estimate(m: int, y: Array, z: Array, P: Array, model: wf.WheelFilterModel) -> tuple[Epsilon | None, Sat | None]:
    """ε̂ and the saturation term of a model from its state at the end of the run."""
    g, g_std = float(z[1]), float(np.sqrt(max(P[1, 1], 0.0)))
    if m in (ws.S_STUCK, ws.S_NONE):
        if not y.size:
            return Epsilon(1.0, 1.0, 1.0), None
        level, rms = float(np.mean(y)), float(np.sqrt(np.mean(y**2)))
        half = 1.96 * model.constant_noise
        return Epsilon(1.0, 1.0, 1.0), Sat(level, rms, level - half, level + half, "m/s")
    if m in (ws.S_GAIN, ws.A_GAIN):
        return Epsilon(1 - g, 1 - g - 1.96 * g_std, 1 - g + 1.96 * g_std), None
    if m in (ws.A_STUCK, ws.A_NONE):
        level = float(z[2]) / model.K if m == ws.A_STUCK else 0.0
        half = 1.96 * float(np.sqrt(max(P[2, 2], 0.0))) / model.K
        return Epsilon(1.0, 0.0, 1.0), Sat(level, abs(level), level - half, level + half, "of full opening")
    if m == ws.A_BIAS:
        eps = max(1 - g, 0.05)
        level, half = float(z[2]) / model.K, 1.96 * float(np.sqrt(max(P[2, 2], 0.0))) / model.K
        bounds = Epsilon(1 - g, 1 - g - 1.96 * g_std, 1 - g + 1.96 * g_std)
        return bounds, Sat(level / eps, abs(level) / eps, (level - half) / eps, (level + half) / eps, "of full opening")
    return None, None
