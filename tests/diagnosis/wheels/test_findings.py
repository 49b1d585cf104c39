"""From segments to findings: what stays open, edges in the raw signal, valves behind a silent sensor."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.wheels.findings import Weighed, WheelFindings, WheelPath, findings_of
from diagnosis.wheels.models import HEALTHY, MODELS, WheelFilterModel
from diagnosis.wheels.runs import Runs
from diagnosis.wheels.tracks import MODES, Segment
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

MODEL = WheelFilterModel(
    K=2.4, tau=0.25, noise=0.001, constant_noise=0.001, rounding=0.001, load=0.014, span=0.8, valve_span=0.15
)
BLOCKS, WIDTH, DT = 300, 10, 0.001
Array = np.ndarray


def pooled(side: Side, mode: FaultMode, p: float) -> dict:
    rows = {(s, m): 0.0 for s in (Side.SENSOR, Side.ACTUATOR) for m in MODES}
    return {None: 1 - p, **rows, (side, mode): p}


def weighed(start: int, stop: int, side: Side, mode: FaultMode, p: float = 0.95, gain: float = 0.5) -> Weighed:
    evidence = np.full(MODELS, -1e4)
    evidence[HEALTHY] = 0.0
    segment = Segment(start, stop, side, mode, pooled(side, mode, p))
    evidence[segment.model] = 500.0
    mean = np.zeros((MODELS, 4))
    mean[:, 1] = gain
    return Weighed(segment, evidence, mean, np.tile(1e-4 * np.eye(4), (MODELS, 1, 1)))


def found(
    *segments: Weighed, y: Array | None = None, healthy: dict[Side, Array] | None = None, stands: bool = False
) -> WheelFindings:
    t = np.arange(BLOCKS * WIDTH) * DT
    speed = 0.3 + 0.05 * np.sin(3 * t) + 0.001 * np.random.default_rng(1).normal(size=t.size) if y is None else y
    sure = {side: np.full(BLOCKS, 0.99) for side in (Side.SENSOR, Side.ACTUATOR)}
    whole = Runs(*(np.array([x]) for x in (0, BLOCKS, HEALTHY, 0)))
    path = WheelPath(
        y=speed,
        reference=np.full(speed.size, np.nan),
        stands=np.full(speed.size, stands),
        names=("v", "u"),
        model=MODEL,
        dt=DT,
        width=WIDTH,
        runs=whole,
        segments=segments,
        expected=np.full(BLOCKS, 0.3),
        spread=np.full(BLOCKS, 1e-4),
        healthy=sure | (healthy or {}),
        raised=np.zeros(BLOCKS, np.bool_),
        others=3,
    )
    return findings_of(path, Limits())


def test_a_side_that_may_be_faulty_stays_open() -> None:
    p = np.full(BLOCKS, 0.99)
    p[100:150], p[150:200] = 0.7, 0.3
    out = found(healthy={Side.ACTUATOR: p})
    assert not out.findings
    at = np.zeros(BLOCKS * WIDTH, np.bool_)
    at[100 * WIDTH : 200 * WIDTH] = True
    np.testing.assert_array_equal(out.opened[Side.ACTUATOR], at)
    at[: 150 * WIDTH] = False
    np.testing.assert_array_equal(out.unexplained[Side.ACTUATOR], at)
    assert not out.opened[Side.SENSOR].any()


def test_a_dead_sensor_is_not_told_where_no_wheel_turns() -> None:
    dead = weighed(100, 200, Side.SENSOR, FaultMode.NO_SIGNAL)
    still = np.zeros(BLOCKS * WIDTH)
    assert found(dead, y=still).findings
    assert not found(dead, y=still, stands=True).findings


def test_a_probable_row_is_stated() -> None:
    out = found(weighed(100, 200, Side.ACTUATOR, FaultMode.INEFFICIENT))
    (finding,) = out.findings
    assert (finding.start, finding.stop) == (100 * WIDTH, 200 * WIDTH)
    assert (finding.side, finding.mode) == (Side.ACTUATOR, FaultMode.INEFFICIENT)
    assert finding.probability == pytest.approx(0.95)
    assert not found(weighed(100, 200, Side.ACTUATOR, FaultMode.INEFFICIENT, p=0.55)).findings


def test_a_jump_in_the_raw_signal_is_the_edge() -> None:
    y = np.full(BLOCKS * WIDTH, 0.3) + 0.001 * np.random.default_rng(2).normal(size=BLOCKS * WIDTH)
    y[1137:1893] = 0.1
    (finding,) = found(weighed(120, 180, Side.SENSOR, FaultMode.STUCK), y=y).findings
    assert (finding.start, finding.stop) == (1137, 1893)


def test_a_valve_behind_a_silent_sensor_is_not_judged() -> None:
    y = 0.3 + 0.001 * np.random.default_rng(4).normal(size=BLOCKS * WIDTH)
    y[1000:2000] = 0.0
    silent = weighed(100, 200, Side.SENSOR, FaultMode.NO_SIGNAL)
    hidden = found(silent, weighed(110, 190, Side.ACTUATOR, FaultMode.STUCK), y=y).findings
    assert [f.side for f in hidden] == [Side.SENSOR]
    both = found(silent, weighed(150, 290, Side.ACTUATOR, FaultMode.STUCK), y=y).findings
    assert [f.side for f in both] == [Side.SENSOR, Side.ACTUATOR]


def test_a_sensor_that_shows_hardly_anything_leaves_its_valve_open() -> None:
    out = found(weighed(100, 200, Side.SENSOR, FaultMode.INEFFICIENT, gain=0.1))
    (finding,) = out.findings
    assert out.opened[Side.ACTUATOR][finding.start : finding.stop].all()
    assert not found(weighed(100, 200, Side.SENSOR, FaultMode.INEFFICIENT)).opened[Side.ACTUATOR].any()


@pytest.mark.parametrize(("step", "p", "stated"), [(False, 0.75, False), (True, 0.75, True), (False, 0.85, True)])
def test_a_loss_that_is_hardly_probable_needs_its_step(step: bool, p: float, stated: bool) -> None:
    """At 0.3 m/s half of the speed cannot go without one."""
    y = 0.3 + 0.001 * np.random.default_rng(5).normal(size=BLOCKS * WIDTH)
    if step:
        y[1000:2000] *= 0.5
    out = found(weighed(100, 200, Side.SENSOR, FaultMode.INEFFICIENT, p=p), y=y)
    assert bool(out.findings) is stated


@pytest.mark.parametrize(("step", "most"), [(False, 0.85), (True, 0.97)])
def test_a_loss_without_a_step_is_no_claim(step: bool, most: float) -> None:
    """What bends instead of jumping may be another cause."""
    y = 0.3 + 0.001 * np.random.default_rng(5).normal(size=BLOCKS * WIDTH)
    if step:
        y[1000:2000] *= 0.5
    (finding,) = found(weighed(100, 200, Side.SENSOR, FaultMode.INEFFICIENT, p=0.97), y=y).findings
    assert finding.probability == pytest.approx(most)
    assert any("makes a step" in sentence for sentence in finding.evidence) is not step
