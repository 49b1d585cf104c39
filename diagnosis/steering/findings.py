"""One stretch of a steering axle's path turned into a finding: alternatives with their probabilities, ε̂, saturation term."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import PAIR
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.steering import model_bank as sr
from diagnosis.steering.filter import SteeringPath
from diagnosis.steering.path_refinement import SteeringData, end_state, evidence_of, runs_of
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]
Path = NDArray[np.uint8]

MODES = {
    sr.STUCK: FaultMode.STUCK,
    sr.NONE: FaultMode.NO_SIGNAL,
    sr.GAIN: FaultMode.INEFFICIENT,
    sr.NOISY: FaultMode.NOISY,
    sr.DRIFT: FaultMode.NOISY,
}
_TEMPER = 0.35
_MOST = 0.6
_BRIEF_S = 0.05


@dataclass(frozen=True)
class Judged:
    """A run of blocks in one row of one side, and the finding on it (None where nothing may be stated)."""

    side: Side
    start: int
    stop: int
    row: int
    finding: Finding | None


def model_number(sensor: int, actuator: int, *, twice: bool) -> int:
    """Model that combines two rows; -1 where there is none. Behind a dead sensor a valve is seen only if measured."""
    if sensor in (sr.STUCK, sr.NONE) and not twice:
        actuator = sr.OK
    found = np.flatnonzero((sensor == sr.SENSOR) & (actuator == sr.ACTUATOR))
    return int(found[0]) if found.size else -1


def judge_side(side: Side, data: SteeringData, path: SteeringPath, limits: Limits) -> list[Judged]:
    """Judge every faulty run of one side."""
    rows = path.sensor if side is Side.SENSOR else path.actuator
    rows = np.where(rows == sr.DRIFT, sr.NOISY, rows)
    out: list[Judged] = []
    for a, b, row in runs_of(rows):
        if row == sr.OK:
            continue
        one = _judge(side, a, b, row, data, path, limits)
        last = out[-1] if out else None
        if last is not None and last.stop == a and _same(last.finding, one.finding):
            longer = max(last, one, key=lambda j: j.stop - j.start)
            assert longer.finding is not None
            finding = replace(longer.finding, start=last.start * data.blocks.length, stop=b * data.blocks.length)
            out[-1] = Judged(side, last.start, b, longer.row, finding)
        else:
            out.append(one)
    return out


def _same(a: Finding | None, b: Finding | None) -> bool:
    return a is not None and b is not None and (a.side, a.mode) == (b.side, b.mode)


def _alternatives(
    side: Side, a: int, b: int, data: SteeringData, known: SteeringPath, min_sat: float
) -> dict[tuple[str, int], float]:
    """Log-evidence of every row that [a, b) may be in: on this side, on the other one instead, and of none.

    A valve stuck closed is one without control signal.
    """
    path = known.model
    sensor, actuator = sr.SENSOR[path[a:b]], sr.ACTUATOR[path[a:b]]
    other_free = bool(np.mean((actuator if side is Side.SENSOR else sensor) == sr.OK) > 0.5)
    out: dict[tuple[str, int], float] = {}
    trial = path.copy()
    for name, rows in ((Side.SENSOR, range(6)), (Side.ACTUATOR, range(1, 5))):
        if name is not side and not other_free:
            continue
        for row in rows:
            if row == sr.OK or name is side:
                pairs = [(row, ac) if side is Side.SENSOR else (s, row) for s, ac in zip(sensor, actuator, strict=True)]
            else:
                pairs = [(row, sr.OK) if name is Side.SENSOR else (sr.OK, row)] * (b - a)
            numbers = {pair: model_number(*pair, twice=data.model.twice) for pair in set(pairs)}
            if any(m < 0 or not data.allowed[m] for m in numbers.values()):
                continue
            trial[a:b] = [numbers[pair] for pair in pairs]
            key = ("none", sr.OK) if row == sr.OK else (name.value, row)
            told = evidence_of(data, known, trial, a, b)
            if key == ("actuator", sr.STUCK) and abs(_opening_at(data, known, trial, a, b)) < min_sat:
                key = ("actuator", sr.NONE)
            out[key] = max(told, out.get(key, -np.inf))
    if ("none", sr.OK) not in out:
        trial[a:b] = 0
        out["none", sr.OK] = evidence_of(data, known, trial, a, b)
    return out


def _opening_at(data: SteeringData, known: SteeringPath, path: Path, a: int, b: int) -> float:
    """Opening of a valve that is taken for stuck in [a, b) [fraction]."""
    return float(end_state(data, known, path, a, b)[3]) / data.model.plant.gain


def _judge(side: Side, a: int, b: int, row: int, data: SteeringData, path: SteeringPath, limits: Limits) -> Judged:
    evidence = _alternatives(side, a, b, data, path, limits.min_sat)
    top = max(evidence.values())
    weight = {key: np.exp(max(-700.0, _TEMPER * (value - top))) for key, value in evidence.items()}
    total = sum(weight.values())
    silent = row in (sr.STUCK, sr.NONE) and side is Side.SENSOR and _level(a, b, data)[0] == 0.0
    pooled: dict[tuple[str, str], float] = {}
    for (name, r), w in weight.items():
        mode = "healthy" if r == sr.OK else MODES[r].value
        if silent and (name, r) == ("sensor", sr.STUCK):
            mode = "no_signal"  # stuck at zero and no signal are one row of the table
        pooled[name, mode] = pooled.get((name, mode), 0.0) + float(w / total)
    ranked = sorted(pooled.items(), key=lambda item: -item[1])
    (name, mode), probability = ranked[0]
    gain = top - evidence["none", sr.OK]
    if mode == "healthy" or gain <= 0:
        return Judged(side, a, b, row, None)
    mine = Side(name)
    if probability < limits.min_probability:
        both = sum(p for (_, m), p in ranked if m == mode)
        if mode == "inefficient" and both >= limits.min_probability:
            mine, probability = Side.SENSOR_OR_ACTUATOR, both
    best = max((key for key in evidence if key[0] == name), key=lambda key: evidence[key])[1]
    epsilon, sat = _estimate(Side(name), best, a, b, data, path)
    if name == "actuator" and mode == "stuck" and sat is not None and abs(sat.mean) < limits.min_sat:
        mode, sat = "no_signal", None
    states_rest = mine is side or mine is Side.SENSOR_OR_ACTUATOR
    too_much = b - a > _MOST * path.model.size and name == "actuator"
    small = mode == "inefficient" and epsilon is not None and epsilon.value < limits.min_epsilon
    flicker = (b - a) * data.blocks.dt < _BRIEF_S and not (name == "sensor" and mode in ("stuck", "no_signal"))
    if probability < limits.min_probability or too_much or small or flicker or not states_rest:
        return Judged(side, a, b, row, None)
    second = next((item for item in ranked[1:] if item[0][1] != "healthy"), None)
    lines = [
        f"Over {(b - a) * data.blocks.dt:.2f} s the model “{name} {mode.replace('_', ' ')}” explains {data.names[0]} better than "
        f"a healthy axle by a log-evidence of {gain:.0f}; a fault is considered from {data.model.switch_cost:.0f}."
    ]
    if name == "sensor" and mode in ("stuck", "no_signal"):
        level, spread, count = _level(a, b, data)
        lines.append(
            f"{data.names[0]} stayed within {spread:.2g} rad of {level:.4g} rad over {count} samples."
            if count
            else f"{data.names[0]} delivered nothing while other channels of its source did."
        )
    if second is not None and second[1] >= 0.005:
        lines.append(f"Next best: {second[0][0]} {second[0][1].replace('_', ' ')} with {100 * second[1]:.1f} %.")
    if mine is Side.SENSOR_OR_ACTUATOR:
        lines.append("Without a second measurement a loss of gain of the sensor and of the valve look alike here.")
    return Judged(
        side,
        a,
        b,
        best,
        Finding(
            start=a * data.blocks.length,
            stop=b * data.blocks.length,
            side=mine,
            mode=FaultMode(mode),
            probability=min(1.0, probability),
            hypotheses=tuple(Hypothesis(s, m, q) for (s, m), q in ranked if q >= 5e-4),
            epsilon=epsilon,
            sat=sat,
            evidence=tuple(lines),
            tier="signal" if name == "sensor" and mode in ("stuck", "no_signal") else "model",
        ),
    )


def _level(a: int, b: int, data: SteeringData) -> tuple[float, float, int]:
    """Median of the blocks' means in a run, their spread without the ends [rad], and the number of samples."""
    use = np.flatnonzero(data.blocks.status[a:b] == PAIR) + a
    if not use.size:
        return 0.0, 0.0, 0
    values = data.blocks.mean[use[1:-1] if use.size > 2 else use]
    return float(np.median(values)), float(np.ptp(values)), int(data.blocks.count[use].sum())


def _bounds(value: float, std: float) -> Epsilon:
    return Epsilon(1 - value, 1 - value - 1.96 * std, 1 - value + 1.96 * std)


def _estimate(
    side: Side, row: int, a: int, b: int, data: SteeringData, path: SteeringPath
) -> tuple[Epsilon | None, Sat | None]:
    """ε̂ and the saturation term of a row from the states along the path."""
    gone = Epsilon(1.0, 1.0, 1.0)
    last, var = path.mean[b - 1], path.variance[b - 1]
    gain = data.model.plant.gain
    if side is Side.SENSOR:
        if row in (sr.STUCK, sr.NONE):
            level, spread, count = _level(a, b, data)
            half = 1.96 * float(np.sqrt(data.model.noise.step)) + spread
            return gone, Sat(level, abs(level), level - half, level + half, "rad") if count else None
        bounds = _bounds(float(last[4]), float(np.sqrt(var[4])))
        if row == sr.GAIN:
            return bounds, None
        use = data.blocks.status[a:b] == PAIR
        rest = (data.blocks.mean[a:b] - last[4] * path.mean[a:b, 0])[use] / max(bounds.value, 0.1)
        return bounds, _sat(rest, "rad")
    if row == sr.NONE:
        return gone, None
    if row == sr.STUCK:
        level, half = float(last[3]) / gain, 1.96 * float(np.sqrt(var[3])) / gain
        return gone, Sat(level, abs(level), level - half, level + half, "of full opening")
    bounds = _bounds(float(last[2]), float(np.sqrt(var[2])))
    if row == sr.GAIN:
        return bounds, None
    return bounds, _sat(path.mean[a:b, 3] / gain / max(bounds.value, 0.1), "of full opening")


def _sat(values: Array, unit: str) -> Sat | None:
    if not values.size:
        return None
    mean, rms = float(values.mean()), float(np.sqrt(np.mean(values**2)))
    half = 1.96 * float(values.std()) / np.sqrt(max(1.0, values.size / 50))
    return Sat(mean, rms, mean - half, mean + half, unit)
