"""A log without a sample is told so in one sentence, with what to do, whoever reads it first."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.writer import Writer
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.rosbag2 import Writer as FolderWriter

from replay.errors import LogError
from replay.machine.config import haulotte
from replay.mission import load_mission
from replay.setup.draft import draft_machine
from replay.setup.read import read_everything
from tests.ros_robots import START_NS, STEP_NS, STORE

_JOINTS = b"float64[] velocity"


def _mcap(folder: Path, topic: str) -> Path:
    path = folder / "drive.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        if topic:
            writer.register_channel(topic, "cdr", writer.register_schema("x/msg/Joints", "ros2msg", _JOINTS))
        writer.finish()
    return path


def _bag(folder: Path) -> Path:
    with BagWriter(folder / "drive.bag"):
        pass
    return folder / "drive.bag"


def _folder(folder: Path) -> Path:
    with FolderWriter(folder / "drive", version=9):
        pass
    return folder / "drive"


def test_a_log_without_messages_is_told_in_one_sentence(tmp_path: Path) -> None:
    for path in (_mcap(tmp_path, ""), _bag(tmp_path), _folder(tmp_path)):
        for read in (lambda p: load_mission([p], haulotte()), lambda p: read_everything([p], every=False)):
            with pytest.raises(LogError, match=f"{path.name} holds no message and no topic: .* record again") as found:
                read(path)
            assert len(str(found.value).removeprefix(str(path))) < 220


def test_its_topics_are_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"holds no message on its topics \(/joint_states\)"):
        load_mission([_mcap(tmp_path, "/joint_states")], haulotte())


def test_channels_without_a_number_are_named(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("t,wheel.FR.v,cmd.v\n" + "".join(f"{k * 0.1:.1f},,\n" for k in range(50)), encoding="utf-8")
    with pytest.raises(LogError, match=r"cmd\.v, wheel\.FR\.v are in the log, but without one number"):
        load_mission([path], haulotte())
    path.write_text("t,wheel.FR.v,cmd.v\n" + "".join(f"{k * 0.1:.1f},,1\n" for k in range(50)), encoding="utf-8")
    with pytest.raises(LogError, match=r"no speed of a wheel has two samples: wheel\.FR\.v is in the log"):
        load_mission([path], haulotte())


def test_a_topic_on_which_nothing_was_published_is_named_beside_others(tmp_path: Path) -> None:
    vector, twist = (STORE.types[f"geometry_msgs/msg/{name}"] for name in ("Vector3", "Twist"))
    with FolderWriter(tmp_path / "drive", version=9) as writer:
        writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=STORE)
        there = writer.add_connection("/cmd_vel", "geometry_msgs/msg/Twist", typestore=STORE)
        still = vector(0.0, 0.0, 0.0)
        for k in range(50):
            data = STORE.serialize_cdr(twist(vector(0.5, 0.0, 0.0), still), "geometry_msgs/msg/Twist")
            writer.write(there, START_NS + k * STEP_NS, data)
    for read in (
        lambda: load_mission([tmp_path / "drive"], haulotte()),
        lambda: draft_machine(read_everything([tmp_path / "drive"], every=False)),
    ):
        with pytest.raises(LogError, match="on /joint_states nothing was published"):
            read()
