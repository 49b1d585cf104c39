"""Sensors of the body in a simulated mission: the speed of every wheel by them against the simulated body's."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.pipeline import diagnose_signals
from diagnosis.wheels.blocks import WheelBlocks, blocks_of
from diagnosis.wheels.body import measured_body, rolling_speeds, with_body
from diagnosis.wheels.filter import forward
from diagnosis.wheels.joint_types import BODY
from diagnosis.wheels.models import JointModel, WheelFilterModel
from diagnosis.wheels.motion import in_motion
from replay.control.loop import stack
from replay.faults import FaultMode, FaultSpec, Side
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission


@lru_cache
def mission() -> SimulatedMission:
    """Three sensors fail at once."""
    faults = tuple(
        FaultSpec(w, Side.SENSOR, FaultMode.INEFFICIENT, 20.0, 40.0, epsilon=0.5) for w in ("FR", "FL", "RR")
    )
    return simulate_mission(
        SimulationOptions(
            seed=3,
            duration_s=60.0,
            rate_hz=100.0,
            coupling="ground",
            faults=faults,
            evidence="base",
            gnss=True,
            imu=True,
        )
    )


def signals(*, body: bool) -> Signals:
    m = mission()
    columns = [(name, m.stamps, values) for name, values in m.columns.items()]
    if body:
        columns += [(name, group.stamps, values) for group in m.slow for name, values in group.columns.items()]
    items = {n: Signal(n, t, v, SignalSource(column=n), "simulated", guessed=False) for n, t, v in columns}
    return Signals(items=items, missing={})


def test_wheels_roll_as_the_simulated_body_makes_them() -> None:
    machine, timeline = haulotte(), align(signals(body=True))
    speeds, commands = (stack(timeline, [f"wheel.{w}.{x}" for w in machine.wheels]) for x in ("v", "v_ref"))
    angle = stack(timeline, [f"steer.{a}.phi" for a in machine.axles])
    motion = ratio, turn = in_motion(angle, machine, timeline)  # at 100 Hz a block is a sample
    found = measured_body(timeline, machine, speeds, commands, angle, motion)
    assert found is not None
    rolls, std = rolling_speeds(found, ratio, turn)
    error = rolls - (mission().actual["body.v"][:, None] * ratio - turn)
    assert np.sqrt(np.mean(error**2)) < 0.04
    assert np.mean(np.abs(error) < 2 * std) > 0.85
    failing = slice(2200, 3900)
    by_wheels = np.median((speeds + turn) / ratio, axis=1) - mission().actual["body.v"]
    assert np.mean(np.abs(error[failing])) < 0.6 * np.mean(np.abs(by_wheels[failing]))


def test_log_without_sensors_of_the_body_or_geometry_gives_none() -> None:
    machine, timeline = haulotte(), align(signals(body=False))
    speeds, commands = (stack(timeline, [f"wheel.{w}.{x}" for w in machine.wheels]) for x in ("v", "v_ref"))
    angle = stack(timeline, [f"steer.{a}.phi" for a in machine.axles])
    motion = in_motion(angle, machine, timeline)
    assert measured_body(timeline, machine, speeds, commands, angle, motion) is None
    other, timeline = replace(machine, geometry=None), align(signals(body=True))
    assert measured_body(timeline, other, speeds, commands, angle, in_motion(angle, other, timeline)) is None


def test_report_says_once_which_sensors_of_the_body_were_used() -> None:
    rows = diagnose_signals(signals(body=True), haulotte()).report["quality"]
    assert sum("Speed of the body by satellite positions" in row["result"] for row in rows) == 1


def _blocks(n: int = 50) -> WheelBlocks:
    rng = np.random.default_rng(0)
    y = 0.3 + 0.002 * rng.standard_normal((n * 10, 4))
    flags = np.zeros(y.shape, dtype=np.bool_)
    one = np.ones(y.shape)
    return blocks_of(y, 0.13 * one, np.zeros(y.shape, np.int8), flags, one, 0 * one, [None] * 4, 0.001)


def test_recursion_takes_the_speed_by_sensors_where_it_is_sure() -> None:
    blocks = _blocks()
    unsure = np.where(np.arange(4) < 2, 0.001, 10.0) * np.ones(blocks.y.shape)
    sensed = replace(blocks, body_speed=np.full(blocks.y.shape, 0.2), body_std=unsure)
    wheel = WheelFilterModel(2.4, 0.25, 0.003, 0.0005, 0.0003, 0.014, 0.8, 0.15, grip_most=0.05)
    model = JointModel((wheel,) * 4, 1e9, 11.0)
    first, body = forward(blocks, model).inputs[0, :, BODY], forward(sensed, model).inputs[0, :, BODY]
    assert_allclose(body[2:], first[2:], atol=1e-4)
    assert_allclose(body[:2], 0.2, atol=1e-9)


def test_blocks_without_known_speed_stay_as_they_are() -> None:
    blocks = _blocks()
    assert with_body(blocks, None) is blocks
    assert_array_equal(blocks.part(3, 9).y, blocks.y[3:9])
    with_some = replace(blocks, body_speed=blocks.y, body_std=blocks.y)
    assert_array_equal(with_some.part(3, 9).body_speed, blocks.y[3:9])
