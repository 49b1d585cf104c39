"""Definitions of message types: what a hostile one may cost."""

from __future__ import annotations

import time

import pytest

from replay.readers.messages.definitions import MAX_LINES, DefinitionError, checksum, resolve

LINE = "=" * 80


def fields(text: str) -> list[str]:
    return [name for name, _ in resolve("a/msg/B", "ros2msg", text, False).fields["a/msg/B"]]


@pytest.mark.parametrize("filler", ["\n", " \n", "#\n", "\t# x\r\n", "\n#\n \n"])
def test_empty_lines_and_comments_cost_nothing(filler: str) -> None:
    start = time.process_time()
    text = f"{filler * 50_000}float64 x # y\n{filler * 50_000}{LINE}\n{filler}MSG: a/C\n{filler}float64 z\n{filler}"
    assert fields(text) == ["x"]
    assert time.process_time() - start < 2.0


def test_definitions_of_too_many_lines_are_refused_before_they_are_parsed() -> None:
    assert len(fields("".join(f"float64 f{k}\n" for k in range(500)))) == 500
    start = time.process_time()
    with pytest.raises(DefinitionError, match=f"at most {MAX_LINES} are read"):
        fields("float64 x\n" * 60_000)
    assert time.process_time() - start < 2.0


def test_checksums_of_ros1_definitions_are_those_of_their_publishers() -> None:
    assert checksum("# a comment\n\nfloat64 data\n", "std_msgs/msg/Float64") == "fdb28210bfa9d7c91146260178d9a584"
    assert checksum("float64 data data\n???", "std_msgs/msg/Float64") == ""
    assert checksum("\n".join(f"float64 x{k}" for k in range(MAX_LINES + 1)), "a/msg/B") == ""  # not parsed at all
