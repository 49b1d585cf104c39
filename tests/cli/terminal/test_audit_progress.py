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


def test_what_happens_to_a_mission_is_told_with_verbose_alone(capsys: pytest.CaptureFixture[str]) -> None:
    for verbose in (False, True):
        with shown_progress(Terminal(verbose=verbose)) as show:
            show("start", {"missions": 1})
            show("planned", {"rest": 1})
            show("mission", {"name": "m", "state": "crashed", "reason": "its process ended"})
        out, shown = capsys.readouterr()
        assert out == ""
        assert shown == ("0 of 1\nnote: m: crashed: its process ended\n" if verbose else "")


def test_a_night_without_a_terminal_is_told_in_a_few_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = [0.0]
    monkeypatch.setattr(audit_progress.time, "monotonic", lambda: now[0])
    with shown_progress(Terminal()) as show:
        show("start", {"missions": 5_000})
        show("planned", {"rest": 5_000})
        for _ in range(5_000):
            now[0] += 7.0
            show("mission", {"name": "m", "state": "ok", "reason": ""})
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "3 of 5000 · 9/min · 9:42:59 left · ok: 3"
    assert 20 < len(lines) < 80
    with shown_progress(Terminal(quiet=True)) as show:
        now[0] += 1_000.0
        show("mission", {"name": "m", "state": "ok", "reason": ""})
    assert capsys.readouterr().err == ""
