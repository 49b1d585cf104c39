from __future__ import annotations

from pathlib import Path

import pytest
from mcap.writer import Writer

from replay.log.source_options import SourceOptions
from replay.readers.machine_identity import stated_machine
from replay.readers.registry import read_log, summarise_log
from replay.readers.rosbag2.metadata import parse_metadata


@pytest.mark.parametrize(
    ("metadata", "identity"),
    [
        ({}, ""),
        ({"profile": "ros2", "library": "x"}, ""),
        ({"setup.machine_id": "H-07"}, "H-07"),
        ({"machine.id": " H-07 "}, "H-07"),
        ({"Robot.Serial-Number": "17", "x.Vehicle ID": "V"}, "V"),
        ({"robot.id": "R", "machine.ID": "M"}, "M"),
        ({"custom_data.machine_id": ""}, ""),
        ({"machine_id": "x" * 65}, ""),
        ({"machine_id": "a\nb"}, ""),
        ({"rosbag2.serialized_metadata": "a:\n  custom_data:\n    machine_id: 'H-09'\n  ros_distro: jazzy\n"}, "H-09"),
    ],
)
def test_known_keys(metadata: dict[str, str], identity: str) -> None:
    assert stated_machine([{}, metadata]) == identity


def test_the_first_log_that_states_one_counts() -> None:
    assert stated_machine([{"machine_id": "a"}, {"machine_id": "b"}]) == "a"


@pytest.mark.parametrize(
    ("text", "custom"),
    [
        ("info:\n  custom_data: ~\n  ros_distro: jazzy\n", {}),
        ("info:\n  custom_data: {}\n", {}),
        ("info:\n  custom_data: {machine_id: H-07, site: 'hall: 3'}\n", {"machine_id": "H-07", "site": "hall: 3"}),
        ("info:\n  custom_data:\n    machine_id: \"H-07\"\n    site: hall 3 # east\n  ros_distro: jazzy\n",
         {"machine_id": "H-07", "site": "hall 3"}),
        ("info:\n  custom_data:\n  ros_distro: jazzy\n", {}),
    ],
)  # fmt: skip
def test_custom_data_of_rosbag2(text: str, custom: dict[str, str]) -> None:
    found = parse_metadata(text)
    assert found.custom == custom
    assert found.facts["ros_distro"] == ("jazzy" if "ros_distro" in text else "")


def test_metadata_records_of_mcap(tmp_path: Path) -> None:
    path = tmp_path / "m.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("x", "jsonschema", b"{}")
        channel = writer.register_channel("/x", "json", schema)
        writer.add_message(channel, 1, b'{"a": 1}', 1)
        writer.add_metadata("machine", {"id": "H-07"})
        writer.finish()
    for summary in (summarise_log(path, SourceOptions()), read_log(path, SourceOptions()).summary):
        assert stated_machine([summary.metadata]) == "H-07"
