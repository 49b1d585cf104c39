"""Channels that are called like wheels' speeds, and that nothing is taken from."""

from __future__ import annotations

import numpy as np
import pytest

from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource
from replay.signals.like_wheels import like_wheels

STAMPS = np.arange(10, dtype=np.int64) * 10_000_000


@pytest.mark.parametrize(
    ("taken", "others", "left"),
    [
        (("left_1_speed", "right_1_speed"), ("left_2_speed", "right_2_speed"), ("left_2_speed", "right_2_speed")),
        (("front_left_wheel_speed", "front_right_wheel_speed"), ("rear_wheel_speed",), ("rear_wheel_speed",)),
        (("Rad_L1_speed", "Rad_L2_speed"), ("Rad_R1_speed",), ("Rad_R1_speed",)),
        (("MAIN.fbWheel[1].fVelocity", "MAIN.fbWheel[2].fVelocity"), ("MAIN.fbWheel[3].fVelocity",), ("MAIN.fbWheel[3].fVelocity",)),
        (("FL_speed", "FR_speed"), ("ML_speed", "MR_speed"), ("ML_speed", "MR_speed")),
        (("FL_speed", "FR_speed"), ("A2L_speed", "A2R_speed"), ("A2L_speed", "A2R_speed")),
        (("HubSpeedAct",), ("HubSpeedAct2",), ()),  # a second sensor of one hub
        (("v_fl", "v_fr"), ("v_fl_2", "v_fr_2"), ()),
        (("v_fl_1", "v_fr_1"), ("v_fl_2", "v_fr_2"), ()),
        (("left_wheel_speed", "right_wheel_speed"), ("left_wheel_temp", "motor_speed", "left_arm_speed"), ()),
        (("/joint_states.velocity[left_wheel]",), ("/joint_states.velocity[left_steer]", "/joint_states.position[left_wheel]"), ()),
    ],
)  # fmt: skip
def test_what_differs_by_a_place_or_a_number_alone_is_another_wheel(
    taken: tuple[str, ...], others: tuple[str, ...], left: tuple[str, ...]
) -> None:
    channels = {n: Channel(n, "", n, STAMPS, np.arange(10.0)) for n in (*taken, *others)}
    used = {f"wheel.W{i}.v": SignalSource(column=n) for i, n in enumerate(taken)}
    assert like_wheels(channels, used) == left


def test_what_another_signal_is_taken_from_is_no_wheel() -> None:
    channels = {n: Channel(n, "", n, STAMPS, np.arange(10.0)) for n in ("v_1", "v_2")}
    used = {"wheel.W1.v": SignalSource(column="v_1"), "odom.v": SignalSource(column="v_2")}
    assert like_wheels(channels, used) == ()
