"""How far an audit is: a bar on a terminal; where stderr is none a line now and then, and with ``--verbose`` what happened to missions."""

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

_LINE_S = 10.0  # between two lines, with --verbose
_FIRST_S, _LONGER, _LAST_S = (
    20.0,
    1.5,
    600.0,
)  # otherwise: the first after, each so much later than the one before, and at most


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
        yield (lambda event, facts: None) if terminal.quiet else _lines(terminal, counted)
        return
    columns = (TextColumn("auditing"), BarColumn(24), MofNCompleteColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console_of(sys.stderr), transient=True) as bar:
        line = bar.add_task("", total=None)

        def show(event: str, facts: EventFacts) -> None:
            counted.take(event, facts)
            bar.update(line, total=counted.total, completed=sum(counted.states.values()), description=counted.text())

        yield show


def _lines(terminal: Terminal, counted: Counted) -> Emit:
    last, every = time.monotonic(), _LINE_S if terminal.verbose else _FIRST_S

    def show(event: str, facts: EventFacts) -> None:
        nonlocal last, every
        counted.take(event, facts)
        if terminal.verbose:
            _note(terminal, event, facts)
        now = time.monotonic()
        told = terminal.verbose or event == "mission"
        if (now - last > every and told) or (terminal.verbose and event in ("planned", "page")):
            last, every = now, _LINE_S if terminal.verbose else min(every * _LONGER, _LAST_S)
            parts = (f"{sum(counted.states.values())} of {counted.total}", clean(counted.text()))
            terminal.plain(" · ".join(part for part in parts if part))

    return show


def _note(terminal: Terminal, event: str, facts: EventFacts) -> None:
    """Say what an event says of single missions."""
    if event == "ingested":
        for problem in facts["problems"]:
            terminal.note(problem)
    if event == "waiting":
        terminal.note(f"{facts['name']}: another audit is working on it in this output folder")
    if event == "retry":
        terminal.note(f"{facts['name']}: {facts['reason']}; trying again")
    if event == "mission" and facts["reason"]:
        terminal.note(f"{facts['name']}: {MissionState(facts['state']).words}: {facts['reason']}")


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(max(seconds, 0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
