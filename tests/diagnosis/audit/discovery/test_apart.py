"""Indexes read in a process of their own: what takes it down costs the logs in question alone."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from diagnosis.audit.discovery import apart, listing
from diagnosis.audit.discovery.apart import Helper
from diagnosis.audit.discovery.discover import discover
from replay.errors import LogError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes cannot be waited for on Windows")
BASE = Path(__file__).resolve().parents[4] / "sample_logs/base.mcap"


@pytest.fixture
def helper() -> Iterator[Helper]:
    made = Helper(60.0)
    yield made
    made.close()


def test_spans_come_back_and_a_lost_process_is_started_again(helper: Helper, tmp_path: Path) -> None:
    first = helper.span(str(BASE))
    assert (first.format, first.clean, first.stop_ns > first.start_ns) == ("mcap", True, True)
    with pytest.raises(LogError, match="does not exist"):
        helper.span(str(tmp_path / "none.mcap"))
    assert helper._process is not None
    helper._process.kill()
    helper._process.wait()
    assert helper.span(str(BASE)) == first


@pytest.mark.parametrize(("call", "said"), [("import os; os.abort()", "ended with code -6"),
                                            ("import time; time.sleep(9)", "took longer than 0.5 s")])  # fmt: skip
def test_what_breaks_the_process_is_said_and_splits_the_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, said: str
) -> None:
    monkeypatch.setattr(apart, "_CALL", call)
    with pytest.raises(LogError, match=said):
        Helper(0.5).span(str(BASE))
    monkeypatch.setattr(listing, "HELPER", Helper(0.5))
    for i in range(2):
        (tmp_path / f"run_{i}.mcap").write_bytes(b"x")
    assert [m.name for m in discover([str(tmp_path)]).missions] == ["run_0", "run_1"]
