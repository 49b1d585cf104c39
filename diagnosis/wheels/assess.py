"""Model evidence: wheels judged by valve openings and speeds alone, or with one of them measured twice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.debounce import FLICKER_S, steadied
from diagnosis.channels.noise import moving_sum, quick_noise, rounding_step, slow_mismatch, usual_distance, white_noise
from diagnosis.estimation.fault_models import PAIR
from diagnosis.estimation.viterbi import first_lasting
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.wheels import filter as wf
from diagnosis.wheels import models as wt
from diagnosis.wheels import step_kernel as ws
from diagnosis.wheels.blocks import WheelBlocks, blocks_of, per_sample
from diagnosis.wheels.findings import Run, judge, onset_sentence, refined
from diagnosis.wheels.runs import runs_of
from diagnosis.wheels.settle import settled
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits, Noise, WheelPlant

Array = NDArray[np.float64]

_MEAN_HEALTHY_S = 60.0
_LEAST_LOAD, _MOST_LOAD = 0.0175, 0.1  # of the span
_TYRES = (0.06, 0.125, 0.25)  # largest load of a tyre, of the span
_TRIAL_S = 60.0
_HOLD_S = 0.1
_DOUBTED = 0.02  # probability of a fault from which on slip and a sensor's loss are not told apart
_REASONS = {
    State.NOT_EXCITED: "the wheel is neither commanded nor moving",
    State.MASKED: "the speed sensor that would show it delivers nothing usable",
    State.NO_DATA: "no samples",
    State.SLIP: "the wheel breaks the parity of the body while it obeys its valve: it slips, or its sensor is off",
}
_NO_COMMAND = "no valve command to compare with"
_UNCERTAIN = "the wheel model is too uncertain in this mission"
_UNTOLD = "what deviates here is not explained well enough by any one fault"


@dataclass(frozen=True)
class WheelsData:
    """All wheels of a machine; arrays are (n, wheels).

    Attributes
    ----------
    y, u : Array
        Measured speed [m/s] and valve opening [fraction], the second measurement where there is one.
    status : NDArray[np.int8]
        As in `diagnosis.estimation.fault_models`.
    quiet, slip : NDArray[np.bool_]
        Where a wheel is neither commanded nor moving, and where it breaks the parity of the body.
    ratio, turn : Array
        As in `WheelBlocks`; NaN without geometry.
    measured : Sequence[bool]
        Whether a wheel's opening is the measured one, so that its valve is judged elsewhere.
    plants : Sequence[WheelPlant | None]
        Wheel models; None where a wheel cannot be judged.
    noise : Sequence[Noise]
        Known noise of the speeds.
    names : Sequence[tuple[str, str]]
        Names of speed and opening.
    span, flow : float
        Largest plausible speed and what the pump feeds, as a sum of speeds [m/s].
    coupling : str
        ``auto``, ``free`` or ``ground``.
    dt : float
        Step [s].
    """

    y: Array
    u: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    slip: NDArray[np.bool_]
    ratio: Array
    turn: Array
    measured: Sequence[bool]
    plants: Sequence[WheelPlant | None]
    noise: Sequence[Noise]
    names: Sequence[tuple[str, str]]
    span: float
    flow: float
    coupling: str
    dt: float


def filter_model(data: WheelsData, i: int, residual: Array) -> wt.WheelFilterModel:
    """Constants of one wheel's filter: noise and load are found from the mission where the machine file has none."""
    plant = data.plants[i]
    assert plant is not None
    pair, y = data.status[:, i] == PAIR, data.y[:, i]
    fresh = y[pair]
    period = data.dt * (usual_distance(pair) if fresh.size > 1 else 1.0)
    known = data.noise[i]
    lsb = known.lsb if known.lsb is not None else rounding_step(fresh)
    white = known.std or float(np.nan_to_num(white_noise(fresh, period)))
    rounding = lsb / np.sqrt(12)
    noise = max(float(np.hypot(white, rounding)) if known.std else white, rounding, 1e-4 * data.span)
    if period > 0.005:  # too slow to tell noise from motion by steps alone
        width = max(3, round(0.5 / data.dt))
        changing = moving_sum(np.diff(y, prepend=y[:1]) != 0, width) > 0.1 * width
        quick = quick_noise(np.where(pair & ~data.quiet[:, i] & changing, residual, np.nan), data.dt)
        noise = max(noise, float(np.nan_to_num(quick)))
    load = plant.load
    if load is None:
        load = float(np.nan_to_num(slow_mismatch(residual, pair & ~data.quiet[:, i], data.dt)))
    return wt.WheelFilterModel(
        K=plant.K,
        tau=plant.tau,
        noise=noise,
        # noise within one rounding step leaves readings constant for a while: that proves nothing then
        constant_noise=max(rounding / 3, noise / 50) if noise > lsb else noise,
        rounding=max(rounding, 1e-5 * data.span),
        load=max(min(load, _MOST_LOAD * data.span), _LEAST_LOAD * data.span, 0.5 * noise),
        span=data.span,
        valve_span=0.15 if data.span < 1.5 * plant.K else 0.5 * data.span / plant.K,
        offset=plant.offset,
        measured=data.measured[i],
    )


def assess_wheels(
    data: WheelsData, residuals: Sequence[Array], limits: Limits, *, gains: bool
) -> dict[int, tuple[Assessment, Assessment]]:
    """Judge sensor and actuator of every wheel that has a model.

    Parameters
    ----------
    data : WheelsData
        Channels.
    residuals : Sequence[Array], each of shape (n,)
        y − K·lowpass(u) [m/s].
    limits : Limits
        What counts.
    gains : bool
        Whether the models are good enough to judge gains and valves by.

    Returns
    -------
    dict[int, tuple[Assessment, Assessment]]
        Sensor and actuator by wheel.
    """
    dead = np.array([0.0 if p is None else p.dead for p in data.plants])
    blocks = blocks_of(data.y, data.u, data.status, data.quiet, data.ratio, data.turn, dead, data.dt)
    model = wt.JointModel(
        wheels=tuple(None if p is None else filter_model(data, i, residuals[i]) for i, p in enumerate(data.plants)),
        flow=data.flow,
        switch_cost=float(np.log(_MEAN_HEALTHY_S / blocks.dt * 12)),
    )
    model = _coupled(blocks, model, data)
    done = settled(blocks, model, wf.forward(blocks, model))
    return {
        i: _one_wheel(i, data, blocks, model, done, limits, gains) for i, w in enumerate(model.wheels) if w is not None
    }


def _coupled(blocks: WheelBlocks, model: wt.JointModel, data: WheelsData) -> wt.JointModel:
    """Tyres on the ground or wheels in the air: whichever explains a minute of driving best."""
    if data.coupling == "free" or not np.isfinite(blocks.ratio).any():
        return model
    trials = [model.on_ground(share * data.span) for share in _TYRES]
    if data.coupling != "ground":
        trials.insert(0, model)
    driven = np.flatnonzero(~blocks.quiet.all(axis=1))
    if not driven.size:
        return trials[0]
    length = round(_TRIAL_S / blocks.dt)
    middle = int(np.clip(driven[driven.size // 2] - length // 2, 0, max(0, blocks.y.shape[0] - length)))
    part = blocks.part(middle, middle + length)
    return max(trials, key=lambda trial: wf.forward(part, trial).evidence)


def _one_wheel(
    i: int,
    data: WheelsData,
    blocks: WheelBlocks,
    model: wt.JointModel,
    done: wt.JointPass,
    limits: Limits,
    gains: bool,
) -> tuple[Assessment, Assessment]:
    """Runs, findings, states and columns of one wheel."""
    own = model.wheels[i]
    assert own is not None
    y, size, width = data.y[:, i], data.y.shape[0], blocks.width
    path, entered = wf.most_probable(done, i)
    runs = runs_of(path, entered, blocks.quiet[:, i], blocks.status[:, i], blocks.dt)
    found = wf.evidence_of_runs(blocks, model, done, i, runs)
    raised = done.best[:, i] != ws.HEALTHY
    findings: list[Finding] = []
    opened = {side: np.zeros(size, dtype=np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)}
    unexplained = {side: np.zeros(size, dtype=np.bool_) for side in opened}
    for r, m in enumerate(runs.model):
        if m == ws.HEALTHY:
            continue
        first, last = int(runs.start[r]), int(runs.stop[r])
        start = refined(first * width, y, 2 * width, int(m), own.noise)
        after = int(runs.model[r + 1]) if r + 1 < runs.model.size else ws.HEALTHY
        stop = min(size, last * width)
        if after == ws.HEALTHY and stop < size:
            stop = (
                refined(stop, y, 2 * width, int(m), own.noise)
                if m not in (ws.S_STUCK, ws.S_NONE)
                else _release(stop, y, 2 * width)
            )
        if stop <= start:
            continue
        if m in (ws.S_STUCK, ws.S_NONE) and own.constant_noise >= own.noise:
            held = y[start:stop][np.isfinite(y[start:stop])]
            if held.size and float(np.ptp(held)) > 0:
                continue  # it moves, by a rounding step at least
            off = np.abs(found.expected[first:last] - (float(held[0]) if held.size else 0.0))
            if held.size and float(off.max(initial=0.0)) < 3 * own.load:
                opened[Side.SENSOR][start:stop] = True  # a steady speed reads the same while rounding hides the noise
                continue
        run = Run(start, stop, int(m), found.evidence[r], found.mean[r], found.cov[r])
        verdict = judge(run, y[start:stop], own, limits, data.names[i], data.dt, gains=gains)
        for side in verdict.open_sides:
            opened[side][start:stop] = True
            if not verdict.usual:
                unexplained[side][start:stop] = True
        if verdict.finding is None:
            continue
        causal = first_lasting(raised, first, last, 2, max(1, round(_HOLD_S / blocks.dt)))
        seen = None if causal is None else max(start, min(causal * width, stop - 1))
        shape = onset_sentence(start, y, own, data.dt, data.names[i][0], verdict.finding.side)
        finding = replace(verdict.finding, detected=seen, evidence=(*verdict.finding.evidence, shape))
        findings.append(finding)
    return _assessments(i, data, own, done, found, findings, opened, unexplained, gains, width)


def _release(stop: int, y: Array, reach: int) -> int:
    """First sample at which a constant sensor moves again."""
    low, high = max(1, stop - reach), min(y.size, stop + reach + 1)
    moved = np.flatnonzero(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]) != 0)
    return low + int(moved[0]) if moved.size else stop


def _assessments(
    i: int,
    data: WheelsData,
    own: wt.WheelFilterModel,
    done: wt.JointPass,
    found: wf.RunEvidence,
    findings: list[Finding],
    opened: dict[Side, NDArray[np.bool_]],
    unexplained: dict[Side, NDArray[np.bool_]],
    gains: bool,
    width: int,
) -> tuple[Assessment, Assessment]:
    y, slip, size = data.y[:, i], data.slip[:, i], data.y.shape[0]
    gap, least = (round(s / data.dt) for s in (FLICKER_S, FLICKER_S / 2))
    quiet = steadied(np.ascontiguousarray(data.quiet[:, i]), gap, 1)
    sensor = [f for f in findings if f.side in (Side.SENSOR, Side.SENSOR_OR_ACTUATOR)]
    actuator = [f for f in findings if f.side in (Side.ACTUATOR, Side.SENSOR_OR_ACTUATOR)]
    base = np.where(quiet, CODE[State.NOT_EXCITED], CODE[State.HEALTHY]).astype(np.int8)
    base[~np.isfinite(y) & (data.status[:, i] != 2)] = CODE[State.NO_DATA]
    states_s, states_a = base.copy(), base.copy()
    states_a[~np.isfinite(data.u[:, i])] = CODE[State.NO_DATA]
    healthy = CODE[State.HEALTHY]
    unseen = opened[Side.SENSOR] | (not gains) | ~np.isfinite(data.u[:, i])
    states_s[unseen & (states_s == healthy)] = CODE[State.NOT_ASSESSED]
    if own.grip_most > 0:  # wheels in the air obey their own valves, not the body
        doubted = np.asarray(per_sample(done.fault[:, i] > _DOUBTED, width, size))
        states_s[steadied(slip & doubted, gap, least) & (states_s == healthy)] = CODE[State.SLIP]
    states_a[(opened[Side.ACTUATOR] | (not gains)) & (states_a == healthy)] = CODE[State.NOT_ASSESSED]
    for f in sensor:
        states_s[f.start : f.stop] = CODE[State(f.mode.value)]
        if f.side is Side.SENSOR and f.mode in (FaultMode.STUCK, FaultMode.NO_SIGNAL):
            states_a[f.start : f.stop] = CODE[State.MASKED]
    for f in actuator:
        states_a[f.start : f.stop] = CODE[State(f.mode.value)]
    covered = np.zeros(size, dtype=np.bool_)
    for f in findings:
        covered[f.start : f.stop] = True

    def held(values: Array) -> Array:
        return np.asarray(per_sample(values, width, size))

    def series() -> Iterator[tuple[str, Array]]:
        residual = held(found.expected)
        np.subtract(y, residual, out=residual)
        residual[data.status[:, i] != PAIR] = np.nan
        yield "residual", residual
        del residual
        yield "threshold", held(3 * np.sqrt(found.spread + own.noise**2))
        yield "expected", held(found.expected)
        yield "probability", held(done.fault[:, i])

    step = steps_of(findings, size, data.dt)
    shared = Pictured.of(step, series())
    air = own.grip_most <= 0
    note = (
        f"{data.names[i][0]} by the wheel model with {data.names[i][1]}: noise {own.noise:.2g} m/s, load and model error "
        f"{own.load:.2g} m/s, K {own.K:.3g} m/s per full opening, τ {own.tau:.2g} s, "
        + ("no coupling by the ground." if air else f"tyres that hold up to {own.grip_most:.2g} m/s of load.")
    )
    out = []
    for side, states, faults in ((Side.SENSOR, states_s, sensor), (Side.ACTUATOR, states_a, actuator)):
        loose = unexplained[side] & ~covered & ~quiet
        open_ = states == CODE[State.NOT_ASSESSED]
        silent = open_ & ~np.isfinite(data.u[:, i])
        commanded = _UNTOLD if gains else _UNCERTAIN
        reason = _NO_COMMAND if 2 * np.count_nonzero(silent) > np.count_nonzero(open_) else commanded
        reasons = _REASONS | {State.NOT_ASSESSED: reason}
        both = shared | Pictured.of(step, [("delta", _delta(faults, side, size))])
        seconds = float(np.count_nonzero(loose)) * data.dt
        out.append(Assessment(states, reasons, tuple(faults), both.columns, "model", (note,), seconds, both.closeups))
    return out[0], out[1]


def _delta(faults: list[Finding], side: Side, size: int) -> Array:
    """Estimated gain of every sample: 1 outside of faults."""
    delta = np.ones(size)
    for f in faults:
        if f.epsilon is not None and f.side is side:
            delta[f.start : f.stop] = 1 - f.epsilon.value
    return delta
