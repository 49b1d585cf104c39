"""Two wheels that steer by their speeds alone: nothing tells the body's speed but both of them, and every log is judged."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from diagnosis.assess import assess_components
from diagnosis.results.assessment import CODE, Assessment
from diagnosis.results.vocabulary import Tier
from replay.control.loop import replay_loop
from replay.faults import FaultMode, Side, State
from replay.log.source_options import SignalSource
from replay.machine.config import Control, Machine
from replay.machine.geometry import Geometry, WheelGeometry
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align

RATE, SECONDS, HALF_TRACK = 100, 90.0, 0.25
GAIN, LAG, LOAD, NOISE, STEP = 1.2, 0.2, 0.02, 0.004, 0.001
FAULT_S = (40.0, 65.0)
PLACES = Geometry({"A": WheelGeometry(0, -HALF_TRACK, 0, "fixed"), "B": WheelGeometry(0, HALF_TRACK, 0, "fixed")}, 0.2)
Array = np.ndarray
Key = tuple[str, str]


def commanded(rng: np.random.Generator) -> Array:
    """Speeds of both wheels [m/s]: standstill, then another speed and yaw rate every few seconds."""
    n = round(SECONDS * RATE)
    body = np.repeat(rng.uniform(-0.3, 0.8, n // 400 + 1), 400)[:n]
    yaw = np.repeat(rng.uniform(-0.5, 0.5, n // 300 + 1), 300)[:n]
    wanted = np.stack([body + HALF_TRACK * yaw, body - HALF_TRACK * yaw], axis=1)
    wanted[: 3 * RATE] = 0.0
    smooth = np.ones(RATE // 2) / (RATE // 2)
    return np.stack([np.convolve(x, smooth)[:n] for x in wanted.T], axis=1)


@cache
def driven(seed: int, dead: float = 0.0, fault: tuple[Side, FaultMode] | None = None) -> dict[str, Array]:
    """Columns of a mission; a fault is one of wheel A. The law is proportional and integral with feed-forward."""
    rng, dt = np.random.default_rng(seed), 1.0 / RATE
    ref = commanded(rng)
    gain = GAIN * (1 + 0.05 * rng.normal(size=2))
    measured, opening = np.zeros(ref.shape), np.zeros(ref.shape)
    speed, load, rest = np.zeros(2), np.zeros(2), np.zeros(2)
    for k in range(len(ref)):
        faulty = fault is not None and FAULT_S[0] <= k * dt < FAULT_S[1]
        seen = np.round((speed + NOISE * rng.normal(size=2)) / STEP) * STEP
        if faulty and fault and fault[0] is Side.SENSOR:
            seen[0] = {FaultMode.STUCK: 0.4, FaultMode.NO_SIGNAL: 0.0}.get(fault[1], 0.5 * seen[0])
        error = ref[k] - seen
        rest = np.clip(rest + 0.8 * error * dt, -0.3, 0.3)
        u = np.clip(ref[k] / GAIN + 0.4 * error + rest + dead * np.sign(ref[k]), -1, 1)
        measured[k], opening[k] = seen, u
        valve = np.sign(u) * np.maximum(np.abs(u) - dead, 0.0)
        if faulty and fault and fault[0] is Side.ACTUATOR:
            valve[0] = {FaultMode.STUCK: 0.3, FaultMode.NO_SIGNAL: 0.0}.get(fault[1], 0.4 * valve[0])
        load += -load * dt / 3 + LOAD * np.sqrt(2 * dt / 3) * rng.normal(size=2)
        speed = speed + dt / LAG * (gain * valve + load - speed)
    kinds = {"v": measured, "v_ref": ref, "u": opening}
    return {f"wheel.{w}.{kind}": x[:, i] for kind, x in kinds.items() for i, w in enumerate("AB")}


def judged(columns: dict[str, Array], *, placed: bool) -> dict[Key, Assessment]:
    machine = Machine("M", "", ("A", "B"), PLACES if placed else None, max_speed=GAIN, control=Control(law="none"))
    stamps = 1_700_000_000_000_000_000 + np.arange(round(SECONDS * RATE)) * (1_000_000_000 // RATE)
    line = align(
        Signals(
            {k: Signal(k, stamps, x, SignalSource(column=k), "a.csv", guessed=False) for k, x in columns.items()}, {}
        )
    )
    return dict(
        assess_components(line, replay_loop(line, machine), machine, machine.wheels, lambda text: None).assessments
    )


PLACED = pytest.mark.parametrize("placed", [True, False])


@pytest.mark.turns("placed")
@PLACED
@pytest.mark.parametrize(("seed", "dead"), [(1, 0.0), (2, 0.05)])
def test_healthy_wheels_have_no_fault(seed: int, dead: float, *, placed: bool) -> None:
    got = judged(driven(seed, dead), placed=placed)
    assert set(got) == {(w, side) for w in "AB" for side in ("sensor", "actuator")}
    for key, part in got.items():
        assert part.tier is Tier.MODEL
        assert part.findings == (), key
        faults = [CODE[s] for s in (State.STUCK, State.NO_SIGNAL, State.INEFFICIENT, State.NOISY)]
        assert not np.isin(part.states, faults).any()


@pytest.mark.turns("placed")
@PLACED
@pytest.mark.parametrize("side", [Side.SENSOR, Side.ACTUATOR])
@pytest.mark.parametrize("mode", [FaultMode.STUCK, FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT])
def test_a_fault_stays_with_its_wheel_and_time(side: Side, mode: FaultMode, *, placed: bool) -> None:
    got = judged(driven(3, fault=(side, mode)), placed=placed)
    assert not got["B", "sensor"].findings
    assert not got["B", "actuator"].findings
    found = [f for s in ("sensor", "actuator") for f in got["A", s].findings]
    for f in found:
        assert FAULT_S[0] - 0.5 <= f.start / RATE
        assert f.stop / RATE <= FAULT_S[1] + 3.0
    if side is Side.SENSOR and mode is not FaultMode.INEFFICIENT:
        assert [(f.side, f.mode) for f in found] == [(side, mode)]


@pytest.mark.turns("placed")
@PLACED
@pytest.mark.parametrize("side", [Side.SENSOR, Side.ACTUATOR])
def test_a_loss_may_be_of_either_side(side: Side, *, placed: bool) -> None:
    """Two wheels that differ do not tell whose speed is wrong, so that no loss is stated of one side."""
    got = judged(driven(3, fault=(side, FaultMode.INEFFICIENT)), placed=placed)
    for s in ("sensor", "actuator"):
        assert {f.side for f in got["A", s].findings if f.mode is FaultMode.INEFFICIENT} <= {Side.SENSOR_OR_ACTUATOR}
