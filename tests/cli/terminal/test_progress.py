"""Share of the work, time left and rate, by the stages that were told."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.terminal.console import Terminal
from cli.terminal.progress import Stages, diagnosis_stages


class Clock:
    """Time that the test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_share_and_time_left_follow_the_pace() -> None:
    clock = Clock()
    stages = Stages([("a", 10.0), ("b", 30.0), ("c", 60.0)], 50.0, clock)
    assert stages.share() is None
    assert stages.left() is None
    stages.begin("a")
    clock.now += 20.0  # twice as long as thought
    stages.begin("b")
    assert stages.share() == pytest.approx(0.1)
    assert stages.left() == pytest.approx(180.0, rel=0.1)
    assert stages.rate() == pytest.approx(5.0 / 20.0)
    clock.now += 30.0
    assert stages.share() == pytest.approx(0.25, abs=0.02)
    clock.now += 1000.0  # a stage never ends by time alone
    assert 0.35 < (stages.share() or 0.0) < 0.4
    assert "MB/s" in stages.words()


def test_stages_that_do_not_come_leave_the_plan() -> None:
    clock = Clock()
    stages = Stages([("a", 10.0), ("b", 30.0), ("c", 10.0)], 0.0, clock)
    stages.begin("a")
    clock.now += 10.0
    stages.begin("c")
    assert stages.share() == pytest.approx(0.5)
    assert stages.left() == pytest.approx(10.0)
    assert stages.rate() is None
    stages.begin("something else")
    assert stages.text == "something else"
    assert stages.share() == pytest.approx(0.5)


def test_no_promise_before_anything_is_known() -> None:
    clock = Clock()
    stages = Stages([("a", 10.0)], 5.0, clock)
    stages.begin("a")
    clock.now += 1.0
    assert stages.words() == "0:01"
    clock.now += 4.0
    assert stages.words() == "0:05 · about 0:05 left · 0.5 MB/s"


def test_plan_holds_every_stage_that_is_told(mission_log: Path) -> None:
    from diagnosis import pipeline
    from replay.machine.config import haulotte

    machine = haulotte()
    stages = diagnosis_stages([mission_log], machine.wheels, machine.axles)
    told: list[str] = []
    pipeline.diagnose([mission_log], machine, progress=told.append)
    planned = [text for text, _ in stages.plan]
    assert [text for text in told if text not in planned] == []
    assert sorted(told, key=planned.index) == told
    assert stages.megabytes > 0


def test_a_bar_on_a_terminal_alone(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    stages = Stages([("reading", 1.0), ("judging", 1.0)])
    with Terminal().progress("starting", stages) as tell:
        tell("reading")
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm-256color")
    with Terminal().progress("starting", stages) as tell:
        tell("reading")
        tell("judging")
    out, err = capsys.readouterr()
    assert out == ""
    assert "judging" in err
    assert "50 %" in err
