"""A car of which only a VESC tells the speed of its motor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.log.raw_log import Channel, LogSummary, RawLog
from replay.machine.toml_file import load_machine
from replay.setup.draft import draft_machine
from replay.setup.machine_text import machine_text
from replay.setup.preset import Preset

ERPM, BASE = 4600.0, 0.33  # rotations a minute at 1 m/s; m
CORE, DRIVE = "/sensors/core", "/drive"


def car(names: tuple[str, ...] = (CORE,)) -> RawLog:
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 60.0, 0.02)
    v, phi = (np.repeat(rng.choice(x, 30), 100) for x in ([0.0, 1.0, 1.5, -0.8], [0.0, 0.25, -0.25]))
    stamps = (1_700_000_000_000_000_000 + t * 1e9).astype(np.int64)
    state, told = "vesc_msgs/VescStateStamped", "ackermann_msgs/AckermannDriveStamped"

    def one(topic: str, field: str, x: NDArray[np.float64], kind: str) -> Channel:
        return Channel(f"{topic}.{field}", topic, field, stamps, x, None, kind)

    turn = v * np.tan(phi) / BASE + rng.normal(0.0, 0.005, t.size)
    channels = [
        one(DRIVE, "drive.speed", v, told),
        one(DRIVE, "drive.steering_angle", phi, told),
        one("/imu/data", "angular_velocity.z", turn, "sensor_msgs/Imu"),
    ]
    for name in names:
        channels += [
            one(name, "state.speed", ERPM * v + rng.normal(0.0, 50.0, t.size), state),
            one(name, "state.current_motor", 5.0 * v, state),
            one(name, "state.duty_cycle", v / 6.0, state),
        ]
    summary = LogSummary("run.mcap", "mcap", 0, int(stamps[-1]), ())
    return RawLog("run.mcap", "mcap", "header", {c.name: c for c in channels}, summary)


def test_its_machine_has_one_motor_and_a_steered_axle_and_no_wheel_that_is_not_logged(tmp_path: Path) -> None:
    draft = draft_machine([car()], Preset.ACKERMANN)
    machine = draft.machine
    assert (machine.wheels, machine.axles) == (("M",), ("front",))
    assert machine.geometry is not None
    assert machine.geometry.wheels["M"].x == pytest.approx(BASE, rel=0.05)
    assert machine.signals["wheel.M.v"].gain == pytest.approx(1.0 / ERPM, rel=0.02)
    assert machine.signals["wheel.M.effort"].unit == "A"
    assert "steer.front.phi_ref" in machine.signals
    assert any("electrical rotations a minute" in str(q) for q in draft.questions)
    assert not any("left and right wheels" in str(q) for q in draft.questions)
    file = tmp_path / "machine.toml"
    file.write_text(machine_text(draft, "run"), encoding="utf-8")
    assert load_machine(file).signals == machine.signals


def test_of_two_motors_the_presets_wheels_are_asked_for() -> None:
    assert len(draft_machine([car((CORE, "/sensors/rear"))], Preset.ACKERMANN).machine.wheels) == 4
