from __future__ import annotations

import pytest

from cli.terminal import audit_progress
from cli.terminal.audit_progress import Counted, shown_progress
from cli.terminal.console import Terminal


def test_states_are_counted_and_the_time_left_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(audit_progress.time, "monotonic", lambda: now[0])
    counted = Counted()
    counted.take("start", {"missions": 5})
    counted.take("skipped", {"state": "ok"})
    counted.take("planned", {"rest": 4})
    for state in ("ok", "out_of_memory"):
        now[0] += 30.0
        counted.take("mission", {"state": state})
    assert counted.text() == "2/min · 1:00 left · ok: 2 · out of memory: 1"


def test_lines_are_for_verbose_runs_alone(capsys: pytest.CaptureFixture[str]) -> None:
    for verbose in (False, True):
        with shown_progress(Terminal(verbose=verbose)) as show:
            show("start", {"missions": 1})
            show("planned", {"rest": 1})
            show("mission", {"name": "m", "state": "crashed", "reason": "its process ended"})
        out, shown = capsys.readouterr()
        assert out == ""
        assert shown == ("0 of 1\nnote: m: crashed: its process ended\n" if verbose else "")
