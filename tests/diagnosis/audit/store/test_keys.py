from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.audit.discovery.identity import fallback_id, given_id, stated_id
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.store.keys import Key, config_hash, file_roles, log_hash, unhashed_log
from replay.log.source_options import SourceOptions
from replay.machine.config import haulotte

MISSION = MissionSource("m", ("logs/H-07/m.mcap",), 3, ("7",), sizes=(3,))


def test_log_hash_depends_on_content_and_order_alone() -> None:
    assert log_hash(["a", "b"]) == log_hash(["a", "b"]) != log_hash(["b", "a"])
    assert log_hash(["a", "b"]) != log_hash(["ab"])
    assert log_hash(["a"], ["plc.csv"]) != log_hash(["a"], ["other.csv"]) != log_hash(["a"])


def test_names_count_where_the_machine_file_tells_files_apart_by_name() -> None:
    plain = haulotte()
    assert file_roles(["a.csv"], plain) == ("",)
    told = replace(plain, sources={"*.csv": SourceOptions(), "plc*": SourceOptions()})
    assert file_roles(["a.csv", "a - copy.csv", "plc.csv"], told) == ("*.csv", "*.csv", "*.csv\nplc*")
    assert file_roles(["a.csv"], replace(plain, sources={"logs/*.csv": SourceOptions()})) == ("a.csv",)


def test_config_hash_depends_on_machine_options_and_identity() -> None:
    given = config_hash(b"[machine]", {"a": 1, "b": 2}, "x")
    assert given == config_hash(b"[machine]", {"b": 2, "a": 1}, "x")
    others = [config_hash(b"", {"a": 1, "b": 2}, "x"), config_hash(b"[machine]", {"a": 1}, "x")]
    others.append(config_hash(b"[machine]", {"a": 1, "b": 2}, "y"))
    assert len({given, *others}) == 4


def test_stem_names_content_configuration_and_version() -> None:
    assert Key("a" * 64, "b" * 64, "0.1.0").stem == "aaaaaaaa-bbbbbbbb-0.1.0"


def test_unreadable_files_have_a_key_that_changes_with_them() -> None:
    assert unhashed_log(MISSION) == unhashed_log(replace(MISSION, name="other"))
    assert unhashed_log(MISSION) != unhashed_log(replace(MISSION, stamps=("8",)))


@pytest.mark.parametrize(
    ("option", "told", "machine_id", "given", "stated"),
    [
        ("cli", "toml", "file", "cli", "given:cli"),
        (None, "toml", "file", "toml", "given:toml"),
        ("", "", "file", None, ""),  # the log may still say otherwise, and is part of the key
        (None, "", "", None, "folder:H-07"),
    ],
)
def test_identity(option: str | None, told: str, machine_id: str, given: str | None, stated: str) -> None:
    mission, machine = replace(MISSION, machine_id=told), replace(haulotte(), id=machine_id)
    assert given_id(option, mission) == given
    assert stated_id(option, mission, machine) == stated


def test_fallback_is_the_folder() -> None:
    assert fallback_id(MISSION) == "H-07"
    assert fallback_id(replace(MISSION, files=("s3://fleet/H-09/m.mcap",))) == "H-09"
