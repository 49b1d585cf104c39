"""Model evidence: a wheel judged by its valve command and speed alone, or with one of them measured twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis import wheel_filter as wf
from diagnosis import wheel_scan as ws
from diagnosis.assessment import CODE, Assessment, Finding
from diagnosis.noise import COARSE_STEP_S, moving_sum, quick_noise, rounding_step, slow_mismatch, white_noise
from diagnosis.wheel_findings import WheelData, judge
from replay.faults import FaultMode, Side, State
from replay.machine import Limits, WheelPlant

Array = NDArray[np.float64]

_MEAN_HEALTHY_S = 60.0
_MOST = 0.6
_LEAST_DISTURBANCE_S = 3.0


def filter_model(data: WheelData, plant: WheelPlant, residual: Array) -> wf.WheelFilterModel:
    """Constants of the filter: noise and load are found from the mission."""
    pair = data.status == 1
    fresh = data.y[pair]
    period = data.dt * (float(np.median(np.diff(np.flatnonzero(pair)[:20_000]))) if fresh.size > 1 else 1.0)
    lsb = data.noise.lsb if data.noise.lsb is not None else rounding_step(fresh)
    white = data.noise.std or float(np.nan_to_num(white_noise(fresh, period)))
    width = max(3, round(0.5 / data.dt))
    changing = moving_sum(np.diff(data.y, prepend=data.y[:1]) != 0, width) > 0.1 * width
    quick = quick_noise(np.where(pair & ~data.quiet & changing, residual, np.nan), data.dt)
    noise = max(white, float(np.nan_to_num(quick)), lsb / np.sqrt(12), 1e-4 * data.span)
    load = slow_mismatch(residual - data.common, pair & ~data.quiet, data.dt)
    return wf.WheelFilterModel(
        K=plant.K,
        tau=plant.tau,
        noise=noise,
        constant_noise=max(lsb / np.sqrt(12), noise / 50),
        load=max(float(np.nan_to_num(load)), noise, 0.02 * data.span),
        load_s=3.0,
        span=data.span,
        valve_span=0.15 if data.span < 1.5 * plant.K else 0.5 * data.span / plant.K,
        switch_cost=float(np.log(_MEAN_HEALTHY_S / period * 8)),
        dt=data.dt,
    )


def assess_wheel(
    data: WheelData, plant: WheelPlant, residual: Array, slip: NDArray[np.bool_], limits: Limits, *, gains: bool
) -> tuple[Assessment, Assessment]:
    """Judge sensor and actuator of a wheel by its model.

    Parameters
    ----------
    data : WheelData
        Channels.
    plant : WheelPlant
        Wheel model.
    residual : Array, shape (n,)
        y − K·lowpass(u) [m/s].
    slip : NDArray[np.bool_], shape (n,)
        Where the wheel breaks the parity of the body.
    limits : Limits
        What counts.
    gains : bool
        Whether the model is good enough to judge gains and the valve by.

    Returns
    -------
    tuple[Assessment, Assessment]
        Sensor and actuator.
    """
    model = filter_model(data, plant, residual)
    path = wf.most_probable(data.y, data.u, data.common, data.slack, data.status, data.quiet, model)
    findings: list[Finding] = []
    doubtful = np.zeros(data.y.size, dtype=np.bool_)
    for start, stop, kind in _runs(path, data, model):
        finding = judge(start, stop, kind, data, model, limits, gains)
        if finding is None:
            continue
        if _holds(finding, data, limits):
            findings.append(finding)
        else:
            doubtful[start:stop] = True
    sensor = [f for f in findings if f.side in (Side.SENSOR, Side.SENSOR_OR_ACTUATOR)]
    actuator = [f for f in findings if f.side in (Side.ACTUATOR, Side.SENSOR_OR_ACTUATOR)]
    base = np.where(data.quiet, CODE[State.NOT_EXCITED], CODE[State.HEALTHY]).astype(np.int8)
    base[~np.isfinite(data.y) & (data.status != 2)] = CODE[State.NO_DATA]
    states_s, states_a = base.copy(), base.copy()
    states_a[~np.isfinite(data.u)] = CODE[State.NO_DATA]
    states_s[(doubtful | (not gains)) & (states_s == CODE[State.HEALTHY])] = CODE[State.NOT_ASSESSED]
    states_s[slip & (states_s == CODE[State.HEALTHY])] = CODE[State.SLIP]
    blind = doubtful | (not gains) | (data.slack > 0)
    states_a[blind & (states_a == CODE[State.HEALTHY])] = CODE[State.NOT_ASSESSED]
    for f in sensor:
        states_s[f.start : f.stop] = CODE[State(f.mode.value)]
        if f.side is Side.SENSOR and f.mode in (FaultMode.STUCK, FaultMode.NO_SIGNAL):
            states_a[f.start : f.stop] = CODE[State.MASKED]
    for f in actuator:
        states_a[f.start : f.stop] = CODE[State(f.mode.value)]
    reasons = {
        State.NOT_EXCITED: "the wheel is neither commanded nor moving",
        State.MASKED: "the speed sensor that would show it delivers nothing usable",
        State.NOT_ASSESSED: "the wheel model does not hold here (too uncertain, or the pump at its limit), or no single fault explains it",
        State.NO_DATA: "no samples",
        State.SLIP: "the wheel breaks the parity of the body while it obeys its valve: it slips, or its sensor is off",
    }
    unexplained = float(np.count_nonzero(doubtful & ~data.quiet)) * data.dt
    v, var, g, g_var, b, b_var = path.track
    series = {
        "residual": np.where(data.status == 1, data.y - v, np.nan),
        "threshold": 3 * np.sqrt(var + model.noise**2),
        "expected": v,
    }
    on_sensor = (path.model >= ws.S_STUCK) & (path.model <= ws.S_WHITE_25)
    on_actuator = path.model >= ws.A_GAIN
    per_side = [
        {
            **series,
            "delta": np.where(mine, g, 1.0),
            "delta_std": np.sqrt(np.where(mine, g_var, 0.0)),
            "delta_bar": np.where(mine, b, 0.0),
            "delta_bar_std": np.sqrt(np.where(mine, b_var, 0.0)),
        }
        for mine in (on_sensor, on_actuator)
    ]
    per_side[1]["delta_bar"] = per_side[1]["delta_bar"] / model.K
    per_side[1]["delta_bar_std"] = per_side[1]["delta_bar_std"] / model.K
    note = (
        f"{data.names[0]} by the wheel model with {data.names[1]}: noise {model.noise:.2g} m/s, load and model error "
        f"{model.load:.2g} m/s, K {model.K:.3g} m/s per full opening, τ {model.tau:.2g} s."
    )
    return (
        Assessment(states_s, reasons, tuple(sensor), per_side[0], "model", (note,), unexplained),
        Assessment(states_a, reasons, tuple(actuator), per_side[1], "model", (note,), unexplained),
    )


def _holds(finding: Finding, data: WheelData, limits: Limits) -> bool:
    """Whether a finding may be stated: probable enough, and a valve's not resting on a model in doubt."""
    if finding.tier == "signal":
        return True
    if finding.probability < limits.min_probability:
        return False
    if finding.stop - finding.start > _MOST * np.count_nonzero(data.status == 1):
        return False  # noise and model come from the same mission: what fills it cannot be told from their error
    if finding.side is Side.SENSOR:
        return True
    if finding.mode is FaultMode.NOISY and finding.epsilon is not None and finding.epsilon.low < 0:
        return False  # the data do not even say that something is lost
    seconds = (finding.stop - finding.start) * data.dt
    if finding.mode is FaultMode.NOISY and seconds < _LEAST_DISTURBANCE_S:
        return False
    if data.dt >= COARSE_STEP_S and finding.mode is not FaultMode.INEFFICIENT:
        return False  # in a slow log a valve that does not answer and one whose sensor lost gain look alike
    in_doubt = float(np.mean(data.slack[finding.start : finding.stop] > 0))
    possible = finding.epsilon is None or 0 < finding.epsilon.value < 1.1
    return in_doubt < 0.3 and possible


def _runs(path: wf.WheelPath, data: WheelData, model: wf.WheelFilterModel) -> list[tuple[int, int, int]]:
    """Faulty runs (start, stop, model); short ones join a longer faulty neighbour, quiet ends are cut."""
    rows = ws.ROW[path.model]
    anew = path.entered & np.isin(rows, (1, 3, 5, 6))
    cut = np.flatnonzero(np.r_[True, (rows[1:] != rows[:-1]) | anew[1:]])
    runs = [[int(a), int(b), int(path.model[b - 1])] for a, b in zip(cut, np.r_[cut[1:], rows.size], strict=True)]
    short = max(3, round(0.05 / data.dt))
    runs = _episodes(runs, round(0.1 / data.dt))
    k = 0
    while k < len(runs):
        a, b, m = runs[k]
        if m != ws.HEALTHY and b - a < short:
            near = [j for j in (k + 1, k - 1) if 0 <= j < len(runs) and runs[j][2] != ws.HEALTHY]
            near = [j for j in near if runs[j][1] - runs[j][0] >= short]
            if near:
                j = near[0]
                runs[min(j, k) : max(j, k) + 1] = [[min(a, runs[j][0]), max(b, runs[j][1]), runs[j][2]]]
                k = max(0, min(j, k) - 1)
                continue
        k += 1
    out = []
    for a, b, m in runs:
        if m == ws.HEALTHY:
            continue
        keep = np.flatnonzero(~data.quiet[a:b] | (data.status[a:b] == 2))
        if m in (ws.S_STUCK, ws.S_DRIFT, ws.S_WHITE_3, ws.S_WHITE_8, ws.S_WHITE_25, ws.A_STUCK):
            out.append((a, b, m))
        elif keep.size:
            out.append((a + int(keep[0]), a + int(keep[-1]) + 1, m))
    return out


def _episodes(runs: list[list[int]], gap: int) -> list[list[int]]:
    """Join valve faults that follow each other within `gap` samples; which row they are is judged as a whole."""
    out: list[list[int]] = []
    for a, b, m in runs:
        if m >= ws.A_GAIN:
            if out and out[-1][2] >= ws.A_GAIN:
                longer = out[-1][2] if out[-1][1] - out[-1][0] >= b - a else m
                out[-1] = [out[-1][0], b, longer]
                continue
            if len(out) > 1 and out[-1][2] == ws.HEALTHY and out[-1][1] - out[-1][0] < gap and out[-2][2] >= ws.A_GAIN:
                out.pop()
                longer = out[-1][2] if out[-1][1] - out[-1][0] >= b - a else m
                out[-1] = [out[-1][0], b, longer]
                continue
        out.append([a, b, m])
    return out
