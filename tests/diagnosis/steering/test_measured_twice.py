"""A valve whose measured opening moves with its command neither sticks nor is dead, whatever a model of its axle makes of the angle."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.estimation.lag import low_passed
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.measured_twice import of_one_cause
from diagnosis.steering.side_findings import SideFindings
from replay.faults import FaultMode, Side

DT, SIZE, SPAN = 0.01, 3000, (1000, 1400)
COMMAND = 0.5 * np.sin(np.arange(SIZE) * DT * 3.0)
NOISE = 0.002 * np.random.default_rng(5).standard_normal(SIZE)


def axle(values: dict[str, np.ndarray], dt: float) -> AxleInputs:
    """An axle whose valve's command and opening are known, step by step, and nothing else."""
    fresh = {"steer.front.u_applied": np.ones(values["u"].size, np.bool_)}
    inputs = SimpleNamespace(
        angle_redundant=False,
        valve_redundant=True,
        values=values.__getitem__,
        channel=lambda leaf: f"steer.front.{leaf}",
        timeline=SimpleNamespace(dt=dt, fresh=fresh),
        blocks=None,
        command=values["u"],
    )
    return cast(AxleInputs, inputs)


def told(
    opening: np.ndarray,
    mode: FaultMode = FaultMode.STUCK,
    command: np.ndarray = COMMAND,
    healthy: np.ndarray | None = None,
) -> SideFindings:
    """What is left of a finding on the valve that says that it sticks, of an opening measured meanwhile; else `healthy`, or as told."""
    before = command if healthy is None else healthy
    values = {
        "u": command,
        "u_applied": np.where((np.arange(SIZE) >= SPAN[0]) & (np.arange(SIZE) < SPAN[1]), opening, before) + NOISE,
    }
    inputs = axle(values, DT)
    row = (Hypothesis(Side.ACTUATOR.value, mode.value, 1.0),)
    finding = Finding(*SPAN, Side.ACTUATOR, mode, 1.0, row, Epsilon(1.0, 1.0, 1.0), None, (), Tier.MODEL)
    return of_one_cause(Side.ACTUATOR, SideFindings((finding,), ()), inputs, 0.05)


@pytest.mark.parametrize(
    ("gain", "zero", "mode"),
    [(0.4, 0.0, FaultMode.INEFFICIENT), (1.0, 0.12, FaultMode.OUTSIDE_TABLE), (1.4, 0.0, FaultMode.OUTSIDE_TABLE)],
)
def test_a_valve_that_moves_as_told_is_what_its_opening_shows(gain: float, zero: float, mode: FaultMode) -> None:
    (finding,) = told(gain * COMMAND + zero).findings
    assert finding.mode is mode
    assert finding.probability < 1.0
    if gain == 1.0:
        assert finding.epsilon is None  # a constant is no share
    else:
        assert finding.epsilon is not None
        assert finding.epsilon.low <= 1.0 - gain <= finding.epsilon.high


def test_what_a_valve_is_late_by_is_no_part_of_what_it_is_off_by() -> None:
    """Its command is so lively, and the valve so slow, that they hardly look alike."""
    lively = 0.05 * np.sign(np.sin(np.arange(SIZE) * DT * 40.0)) + np.where(np.arange(SIZE) < SPAN[0], COMMAND, 0.03)
    late = low_passed(lively, 0.05, DT)
    (finding,) = told(0.1 + late, command=lively, healthy=late).findings
    assert finding.mode is FaultMode.OUTSIDE_TABLE
    assert "+10.0" in finding.evidence[0]


def test_a_valve_that_does_as_told_is_left_open() -> None:
    found = told(COMMAND)
    assert found.findings == ()
    assert found.unexplained == (SPAN,)


@pytest.mark.parametrize(("share", "zero"), [(0.95, 0.0), (0.95, 0.025), (0.9, 0.0)])
@pytest.mark.parametrize("rests", [True, False])
def test_a_warm_valve_that_opens_a_little_less_is_left_open(share: float, zero: float, *, rests: bool) -> None:
    command = np.full(SIZE, 0.85) if rests else COMMAND
    assert told(share * command + zero, command=command, healthy=share * command + zero).findings == ()


@pytest.mark.parametrize(("at", "mode"), [(0.06, FaultMode.STUCK), (0.0, FaultMode.NO_SIGNAL)])
def test_a_valve_that_stays_where_it_is_stays_stuck(at: float, mode: FaultMode) -> None:
    (finding,) = told(np.full(SIZE, at), mode).findings
    assert finding.mode is mode
    assert finding.probability == 1.0


@pytest.mark.parametrize(
    ("at", "said", "mode"),
    [
        (0.006, FaultMode.STUCK, FaultMode.NO_SIGNAL),
        (0.1, FaultMode.NO_SIGNAL, FaultMode.STUCK),
        (0.03, FaultMode.STUCK, FaultMode.STUCK),
    ],
)
def test_a_valve_that_stands_still_is_called_by_where_it_does(at: float, said: FaultMode, mode: FaultMode) -> None:
    (finding,) = told(np.full(SIZE, at), said).findings
    assert finding.mode is mode
    assert (finding.probability, {h.mode for h in finding.hypotheses}) == (1.0, {mode.value})


def test_beside_a_command_that_rests_a_share_may_be_a_constant_that_is_missing() -> None:
    after = told(np.full(SIZE, 0.1), FaultMode.INEFFICIENT, np.full(SIZE, 0.2))
    assert {h.mode: h.p for h in after.findings[0].hypotheses} == pytest.approx(
        {"inefficient": 0.85, "outside_table": 0.15}
    )


def test_what_is_less_probable_already_is_not_more_so_for_a_command_that_rests() -> None:
    rows = (("stuck", 0.5), ("noisy", 0.4), ("outside_table", 0.1))
    hypotheses = tuple(Hypothesis(Side.ACTUATOR.value, mode, p) for mode, p in rows)
    before = Finding(*SPAN, Side.ACTUATOR, FaultMode.STUCK, 0.5, hypotheses, None, None, (), Tier.MODEL)
    inputs = axle({"u": np.full(SIZE, 0.2), "u_applied": np.full(SIZE, 0.1)}, DT)
    inputs.valve_redundant = False  # type: ignore[misc]
    (after,) = of_one_cause(Side.ACTUATOR, SideFindings((before,), ()), inputs, 0.05).findings
    assert (after.probability, after.hypotheses) == (0.5, hypotheses)
    assert "off by a constant would look the same" in after.evidence[-1]


def test_a_valve_that_does_not_answer_for_a_moment_beside_a_command_that_rests_is_hardly_at_fault() -> None:
    stop = SPAN[0] + round(1.0 / DT)
    rows = (Hypothesis(Side.ACTUATOR.value, "stuck", 0.98),)
    before = Finding(SPAN[0], stop, Side.ACTUATOR, FaultMode.STUCK, 0.98, rows, None, None, (), Tier.MODEL)
    inputs = axle({"u": np.full(SIZE, 0.2), "u_applied": np.full(SIZE, 0.1)}, DT)
    inputs.valve_redundant = False  # type: ignore[misc]
    (after,) = of_one_cause(Side.ACTUATOR, SideFindings((before,), ()), inputs, 0.05).findings
    assert after.probability == pytest.approx(0.45)


def test_a_sensor_that_stands_still_says_what_the_second_one_shows_meanwhile() -> None:
    angle = 0.3 * np.sin(np.arange(SIZE) * DT * 3.0)
    stuck = np.where((np.arange(SIZE) >= SPAN[0]) & (np.arange(SIZE) < SPAN[1]), 0.1, angle)
    values = {"phi": stuck, "phi_true": angle}
    inputs = SimpleNamespace(
        angle_redundant=True,
        values=values.__getitem__,
        channel=lambda leaf: f"steer.front.{leaf}",
        timeline=SimpleNamespace(dt=DT, fresh={"steer.front.phi": np.ones(SIZE, np.bool_)}),
    )
    row = (Hypothesis(Side.SENSOR.value, FaultMode.STUCK.value, 1.0),)
    finding = Finding(
        *SPAN, Side.SENSOR, FaultMode.STUCK, 1.0, row, Epsilon(1.0, 1.0, 1.0), None, ("first",), Tier.SIGNAL
    )
    (got,) = of_one_cause(Side.SENSOR, SideFindings((finding,), ()), cast(AxleInputs, inputs), 0.02).findings
    assert got.evidence[-1] == (
        "Meanwhile steer.front.phi_true, a second measurement of the angle, moved over 34°, and steer.front.phi over 0°."
    )


def _beginning(level: float) -> np.ndarray:
    """A command that comes to a level in the first fifth of the finding and stays there."""
    return level * np.clip((np.arange(SIZE) - SPAN[0]) / 80.0, 0.0, 1.0)


@pytest.mark.parametrize("at", [0.0, 0.2])
def test_an_opening_that_stands_while_its_command_still_moves_is_no_constant_that_is_off(at: float) -> None:
    mode = FaultMode.STUCK if at else FaultMode.NO_SIGNAL
    (finding,) = told(np.full(SIZE, at), mode, _beginning(0.6)).findings
    assert (finding.mode, finding.probability) == (mode, 1.0)


def test_beside_a_command_that_rests_all_along_a_dead_valve_may_be_off_by_a_constant() -> None:
    (finding,) = told(np.zeros(SIZE), FaultMode.NO_SIGNAL, np.full(SIZE, 0.3)).findings
    assert finding.probability == pytest.approx(0.6)
    assert {h.mode for h in finding.hypotheses} == {"no_signal", "outside_table"}


@pytest.mark.parametrize("lag", [0.4, 0.9])
@pytest.mark.parametrize("mode", [FaultMode.STUCK, FaultMode.NOISY, FaultMode.INEFFICIENT])
def test_an_opening_that_follows_with_a_lag_is_late_whatever_a_model_calls_it(lag: float, mode: FaultMode) -> None:
    step = np.where(np.arange(SIZE) < (SPAN[0] + SPAN[1]) // 2, 0.0, 0.5)
    (finding,) = told(low_passed(step, lag, DT), mode, step, healthy=low_passed(step, lag, DT)).findings
    assert (finding.side, finding.mode) == (Side.ACTUATOR, FaultMode.OUTSIDE_TABLE)
    assert "late, and answers" in finding.evidence[0]
