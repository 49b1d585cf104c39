"""Valves beside their commands, and speeds beside their second measurements: what one alone, or all of them for ten seconds, are off by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.results.clearing import Check
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import checks as checks_by_part
from tests.diagnosis.clearing.missions import simulated

RATE_HZ = 100.0


def with_columns(mission: SimulatedMission, **columns: np.ndarray) -> SimulatedMission:
    """The same with other columns, whose names have a double underscore for a dot."""
    return replace(mission, columns={**mission.columns, **{k.replace("__", "."): x for k, x in columns.items()}})


def test_all_valves_that_lose_a_quarter_for_twelve_seconds_do_not_pass() -> None:
    mission = simulated()
    lost = {}
    for wheel in ("FR", "FL", "RR", "RL"):
        x = mission.columns[f"wheel.{wheel}.u_applied"].copy()
        x[int(20 * RATE_HZ) : int(32 * RATE_HZ)] *= 0.75
        lost[f"wheel__{wheel}__u_applied"] = x
    checks = checks_by_part(with_columns(mission, **lost), base=False)
    for wheel in ("FR", "FL", "RR", "RL"):
        check = checks[wheel, "actuator", Check.SECOND_MEASUREMENT]
        assert not check.passed
        assert check.start_s is not None
        assert check.stop_s is not None
        assert check.start_s <= 22.0
        assert check.stop_s >= 30.0


def test_a_position_that_jitters_all_through_does_not_pass() -> None:
    mission, rng = simulated(), np.random.default_rng(2)
    for name, component in (("steer.rear.u_applied", "rear"), ("wheel.FL.u_applied", "FL")):
        x = mission.columns[name]
        noisy = replace(mission, columns={**mission.columns, name: x + 0.15 * rng.normal(size=x.size)})
        check = checks_by_part(noisy, base=False)[component, "actuator", Check.JITTER]
        assert check.worst is not None
        assert 0.12 < check.worst < 0.22
        assert not check.passed
        assert "jitters by" in check.text
    healthy = checks_by_part(mission, base=False)
    assert all(c.passed for (_, _, what), c in healthy.items() if what is Check.JITTER)


def test_a_command_that_jitters_is_no_jitter_of_its_valve() -> None:
    mission, rng = simulated(), np.random.default_rng(3)
    jitter = 0.15 * rng.normal(size=mission.columns["wheel.FL.u"].size)
    both = {f"wheel__FL__{leaf}": mission.columns[f"wheel.FL.{leaf}"] + jitter for leaf in ("u", "u_applied")}
    assert checks_by_part(with_columns(mission, **both), base=False)["FL", "actuator", Check.JITTER].passed


def test_a_speed_alone_beside_its_second_measurement_is_held_to_what_the_others_are_off_by() -> None:
    mission = simulated()
    v = mission.columns["wheel.RR.v"].copy()
    v[2000:3200] = 0.88 * v[2000:3200]
    check = checks_by_part(with_columns(mission, wheel__RR__v=v), base=False)["RR", "sensor", Check.SECOND_MEASUREMENT]
    assert not check.passed
    assert check.limit < 0.12


def opened_by_little(loses: float) -> SimulatedMission:
    """A mission whose rear axle is steered by a hundredth of full opening alone and whose valve loses a share of that."""
    mission, size = simulated(), 0.015
    u = mission.columns["steer.rear.u"]
    command = size * np.sin(2.0 * np.pi * 0.15 * np.arange(u.size) / RATE_HZ)
    opening = (1.0 - loses) * command
    return with_columns(mission, steer__rear__u=command, steer__rear__u_applied=opening)


def test_a_valve_that_is_opened_by_little_alone_is_judged_by_all_of_the_mission() -> None:
    for loses, passes in ((0.0, True), (0.1, True), (0.35, False), (1.0, False)):
        check = checks_by_part(opened_by_little(loses), base=False)["rear", "actuator", Check.SECOND_MEASUREMENT]
        assert check.worst is not None
        assert abs(check.worst - loses) < 0.05
        assert check.passed is passes
        assert check.start_s is None


def test_a_valve_that_is_not_opened_at_all_stays_open() -> None:
    mission = simulated()
    none = np.zeros(mission.columns["steer.rear.u"].size)
    mission = with_columns(mission, steer__rear__u=none, steer__rear__u_applied=none)
    assert checks_by_part(mission, base=False)["rear", "actuator", Check.SECOND_MEASUREMENT].worst is None
