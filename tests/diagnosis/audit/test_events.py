from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from diagnosis.audit.events import EventLog
from diagnosis.results.json_text import dump_json
from replay.errors import OutputError


def test_events_are_lines_that_are_added(tmp_path: Path) -> None:
    for name in ("a", "b\nc", "\udcff"):
        log = EventLog(tmp_path / "events.jsonl")
        log.write("mission", {"name": name})
        log.close()
    lines = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [line["name"] for line in lines] == ["a", "b\nc", "\\udcff"]
    assert all(line["event"] == "mission" and line["time"].endswith("+00:00") for line in lines)


def test_a_reader_that_has_gone_is_no_error() -> None:
    reading, writing = os.pipe()
    kept = os.dup(1)
    os.dup2(writing, 1)
    try:
        log = EventLog(None)
    finally:
        os.dup2(kept, 1)
        for end in (kept, writing, reading):
            os.close(end)
    log.write("start", {})
    log.write("end", {})
    log.close()


def test_a_file_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="events cannot be written"):
        EventLog(tmp_path / "nowhere" / "events.jsonl")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full disk to offer")
def test_a_full_disk_is_one_sentence() -> None:
    log = EventLog(Path("/dev/full"))
    with pytest.raises(OutputError, match="No space left on device"):
        log.write("start", {})
    log.close()


def test_documents_with_names_that_are_not_utf8_are_written_with_escapes() -> None:
    assert (
        dump_json({"a\udcff": ["b\udcfe", ("é", 1.5, None)]}) == '{"a\\\\udcff":["b\\\\udcfe",["é",1.5,null]]}'.encode()
    )
