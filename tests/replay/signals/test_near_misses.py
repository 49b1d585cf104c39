from __future__ import annotations

from replay.log.raw_log import LogSummary, TopicInfo
from replay.signals.mapping import NO_CHANNEL
from replay.signals.near_misses import near_misses


def summary(*topics: tuple[str, str]) -> LogSummary:
    return LogSummary("run.mcap", "mcap", 0, 0, tuple(TopicInfo(name, kind, 1, "cdr") for name, kind in topics))


def test_transforms_and_joysticks_are_named_with_what_to_record() -> None:
    log = summary(("/tf", "tf2_msgs/msg/TFMessage"), ("/joy", "sensor_msgs/Joy"))
    missing = dict.fromkeys(("odom.x", "odom.v", "cmd.v", "gnss.lat"), NO_CHANNEL)
    found = near_misses(missing, [log], NO_CHANNEL)
    assert found["odom.x"].startswith("/tf (which may hold the pose) is not read; record the odometry itself")
    assert found["odom.v"].startswith("/tf")
    assert found["cmd.v"].startswith("/joy (a joystick) is not read; record the command")
    assert found["gnss.lat"] == NO_CHANNEL


def test_other_reasons_and_fixed_transforms_stay() -> None:
    assert near_misses({"odom.x": "holds no number"}, [summary(("/tf", "tf2_msgs/msg/TFMessage"))], NO_CHANNEL) == {
        "odom.x": "holds no number"
    }
    assert near_misses({"odom.x": NO_CHANNEL}, [summary(("/tf_static", "tf2_msgs/msg/TFMessage"))], NO_CHANNEL) == {
        "odom.x": NO_CHANNEL
    }
