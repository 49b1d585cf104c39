"""Share of the work, time left and rate, by the stages that were published."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.terminal.console import Terminal
from cli.terminal.progress import Plan, diagnosis_plan
from replay.progress import Progress, Stage

A, B, C = Progress(Stage.READING, "a"), Progress(Stage.READING, "b"), Progress(Stage.DECIDING)


class Clock:
    """Time that the test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_share_and_time_left_follow_the_pace() -> None:
    clock = Clock()
    plan = Plan([(A, 10.0), (B, 30.0), (C, 60.0)], 50.0, clock)
    assert plan.share() is None
    assert plan.left() is None
    plan.begin(A)
    clock.now += 20.0  # twice as long as thought
    plan.begin(B)
    assert plan.share() == pytest.approx(0.1)
    assert plan.left() == pytest.approx(180.0, rel=0.1)
    assert plan.rate() == pytest.approx(5.0 / 20.0)
    clock.now += 30.0
    assert plan.share() == pytest.approx(0.25, abs=0.02)
    clock.now += 1000.0  # a stage never ends by time alone
    assert 0.35 < (plan.share() or 0.0) < 0.4
    assert "MB/s" in plan.words()


def test_stages_that_do_not_come_leave_the_plan() -> None:
    clock = Clock()
    plan = Plan([(A, 10.0), (B, 30.0), (C, 10.0)], 0.0, clock)
    plan.begin(A)
    clock.now += 10.0
    plan.begin(C)
    assert plan.share() == pytest.approx(0.5)
    assert plan.left() == pytest.approx(10.0)
    assert plan.rate() is None
    plan.begin(Progress(Stage.HASHING, "a"))
    assert plan.text == "hashing a"
    assert plan.share() == pytest.approx(0.5)


def test_no_promise_before_anything_is_known() -> None:
    clock = Clock()
    plan = Plan([(A, 10.0)], 5.0, clock)
    plan.begin(A)
    clock.now += 1.0
    assert plan.words() == "0:01"
    clock.now += 4.0
    assert plan.words() == "0:05 · about 0:05 left · 0.5 MB/s"


def test_plan_holds_every_stage_that_is_published(mission_log: Path) -> None:
    from diagnosis import pipeline
    from replay.machine.config import haulotte

    machine = haulotte()
    plan = diagnosis_plan([mission_log], machine.wheels, machine.axles)
    published: list[Progress] = []
    pipeline.diagnose([mission_log], machine, progress=published.append)
    planned = [progress for progress, _ in plan.stages]
    assert [progress for progress in published if progress not in planned] == []
    assert sorted(published, key=planned.index) == published
    assert all(seconds > 0 for _, seconds in plan.stages)
    assert plan.megabytes > 0


def test_a_bar_on_a_terminal_alone(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    plan = Plan([(A, 1.0), (C, 1.0)])
    with Terminal().progress(Stage.STARTING, plan=plan) as subscriber:
        subscriber(A)
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm-256color")
    with Terminal().progress(Stage.STARTING, plan=plan) as subscriber:
        subscriber(A)
        subscriber(C)
    out, err = capsys.readouterr()
    assert out == ""
    assert "deciding" in err
    assert "50 %" in err
