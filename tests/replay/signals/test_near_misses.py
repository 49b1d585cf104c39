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


def test_a_velocity_that_may_be_the_command_is_named_with_the_line_to_write() -> None:
    log = summary(("/odom_twist", "geometry_msgs/msg/Twist"), ("/base/velocity", "geometry_msgs/msg/TwistStamped"))
    found = near_misses(dict.fromkeys(("cmd.v", "cmd.omega"), NO_CHANNEL), [log], NO_CHANNEL)
    line = '"cmd.v" = { topic = "/base/velocity", field = "twist.linear.x", unit = "m/s" }'
    assert found["cmd.v"].startswith("/base/velocity may be the command")
    assert found["cmd.v"].endswith(line)
    assert "twist.angular.z" in found["cmd.omega"]


def test_other_reasons_and_fixed_transforms_stay() -> None:
    assert near_misses({"odom.x": "holds no number"}, [summary(("/tf", "tf2_msgs/msg/TFMessage"))], NO_CHANNEL) == {
        "odom.x": "holds no number"
    }
    assert near_misses({"odom.x": NO_CHANNEL}, [summary(("/tf_static", "tf2_msgs/msg/TFMessage"))], NO_CHANNEL) == {
        "odom.x": NO_CHANNEL
    }
