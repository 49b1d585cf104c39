"""How far an audit is: a bar on a terminal, a line now and then with ``--verbose`` where stderr is none."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from cli.terminal.console import Terminal
from cli.terminal.streams import clean, console_of
from diagnosis.audit.events import Emit, EventFacts
from diagnosis.audit.store.outcome import MissionState

_LINE_S = 10.0


class Counted:
    """Counts of an audit under way."""

    def __init__(self) -> None:
        self.total = self.done = self.rest = 0
        self.states: Counter[MissionState] = Counter()
        self.start = time.monotonic()

    def take(self, event: str, facts: EventFacts) -> None:
        """Count an event."""
        if event == "start":
            self.total = facts["missions"]
        elif event == "planned":
            self.rest, self.start = facts["rest"], time.monotonic()
        elif event in ("mission", "skipped"):
            self.states[MissionState(facts["state"])] += 1
            self.done += event == "mission"

    def text(self) -> str:
        """Rate, time to go, and counts per state."""
        parts = []
        spent = time.monotonic() - self.start
        if self.done and spent > 1:
            rate = self.done / spent
            parts.append(f"{rate * 60:.0f}/min" if rate < 10 else f"{rate:.0f}/s")
            parts.append(f"{_clock((self.rest - self.done) / rate)} left")
        parts += [f"{s.words or 'ok'}: {n}" for s, n in sorted(self.states.items(), key=lambda x: -x[1])]
        return " · ".join(parts)


@contextmanager
def shown_progress(terminal: Terminal) -> Iterator[Emit]:
    """Give a function that shows events."""
    counted = Counted()
    if terminal.quiet or not sys.stderr.isatty():
        yield _lines(terminal, counted) if terminal.verbose and not terminal.quiet else lambda event, facts: None
        return
    columns = (TextColumn("auditing"), BarColumn(24), MofNCompleteColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console_of(sys.stderr), transient=True) as bar:
        line = bar.add_task("", total=None)

        def show(event: str, facts: EventFacts) -> None:
            counted.take(event, facts)
            bar.update(line, total=counted.total, completed=sum(counted.states.values()), description=counted.text())

        yield show


def _lines(terminal: Terminal, counted: Counted) -> Emit:
    last = time.monotonic()

    def show(event: str, facts: EventFacts) -> None:
        nonlocal last
        counted.take(event, facts)
        if event == "ingested":
            for problem in facts["problems"]:
                terminal.note(problem)
        if event == "waiting":
            terminal.note(f"{facts['name']}: another audit is working on it in this output folder")
        if event == "retry":
            terminal.note(f"{facts['name']}: {facts['reason']}; trying again")
        if event == "mission" and facts["reason"]:
            terminal.note(f"{facts['name']}: {MissionState(facts['state']).words}: {facts['reason']}")
        now = time.monotonic()
        if now - last > _LINE_S or event in ("planned", "page"):
            last = now
            parts = (f"{sum(counted.states.values())} of {counted.total}", clean(counted.text()))
            terminal.plain(" · ".join(part for part in parts if part))

    return show


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(max(seconds, 0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
