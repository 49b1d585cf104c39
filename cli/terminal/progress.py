"""How far one long piece of work is: a bar over its stages with time spent, time left and rate."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from cli.terminal.streams import clean, console_of
from replay.progress import Progress, Stage, Subscriber

if TYPE_CHECKING:
    from typing import IO

_LEAST_MB = 1.0  # what a run costs at least
_SHOWN_AFTER_S = 1.5  # from then on enough is known to say how long it takes
_TRUST_S = 1.0  # for which the expected costs are believed more than what the first stages took
_FULLEST = 0.95  # of a stage that takes longer than thought


@dataclass
class Plan:
    """Share of the work that is done, from the stages begun so far; stages that do not come leave the plan.

    Attributes
    ----------
    stages : Sequence[tuple[Progress, float]]
        Beginning and expected time [s] of each stage, in order.
    megabytes : float
        Size of what is worked on, for the rate; 0: unknown.
    clock : Callable[[], float]
        Time [s].
    """

    stages: Sequence[tuple[Progress, float]]
    megabytes: float = 0.0
    clock: Callable[[], float] = time.monotonic
    text: str = ""
    _at: int = -1
    _worked: float = 0.0
    _took: float = 0.0
    _start: float = field(init=False)
    _stage_start: float = field(init=False)

    def __post_init__(self) -> None:
        self._start = self._stage_start = self.clock()

    def begin(self, progress: Progress) -> None:
        """Note that a stage begins; one that is not in the plan is shown and belongs to the stage before."""
        self.text = str(progress)
        k = next((i for i in range(self._at + 1, len(self.stages)) if self.stages[i][0] == progress), None)
        if k is None:
            return
        now = self.clock()
        if self._at >= 0:
            self._worked += self.stages[self._at][1]
            self._took += now - self._stage_start
        self._at, self._stage_start = k, now

    @property
    def spent(self) -> float:
        """Time since the beginning [s]."""
        return self.clock() - self._start

    def share(self) -> float | None:
        """Share of the work done, None before the first stage. From 0 to 1 [1]."""
        if self._at < 0:
            return None
        done = self._worked + self._here()
        return done / (done + self._rest()) if done + self._rest() > 0 else 1.0

    def left(self) -> float | None:
        """Time left [s], None while too little is known of it."""
        return None if self._at < 0 or self.spent < _SHOWN_AFTER_S else self._rest() * self._pace()

    def rate(self) -> float | None:
        """Megabytes of log per second, None where that is not known. In MB/s."""
        share = self.share()
        return (
            self.megabytes * share / self.spent if share and self.megabytes and self.spent >= _SHOWN_AFTER_S else None
        )

    def _here(self) -> float:
        """Expected seconds of this stage that are done."""
        return min(_FULLEST * self.stages[self._at][1], (self.clock() - self._stage_start) / self._pace())

    def _rest(self) -> float:
        """Expected seconds of this stage and of those behind it that are left."""
        return sum(seconds for _, seconds in self.stages[self._at :]) - self._here()

    def _pace(self) -> float:
        """Seconds that pass for one expected second, by the stages that are over."""
        return (self._took + _TRUST_S) / (self._worked + _TRUST_S)

    def words(self) -> str:
        """Time spent, time left and rate."""
        left, rate = self.left(), self.rate()
        parts = [_clock(self.spent)]
        parts += [f"about {_clock(left)} left"] if left is not None else []
        parts += [f"{rate:.1f} MB/s"] if rate is not None else []
        return " · ".join(parts)


def diagnosis_plan(paths: Sequence[Path], wheels: Sequence[str], axles: Sequence[str]) -> Plan:
    """Stages of `mfhca diagnose` for the files of a mission."""
    sizes = [max(_LEAST_MB, _megabytes(path)) for path in paths]
    total = sum(sizes)
    files = [
        (Progress(stage, path.name), stage.cost * size)
        for path, size in zip(paths, sizes, strict=True)
        for stage in (Stage.OPENING, Stage.READING, Stage.HASHING)
    ]
    rest = [Progress(s) for s in (Stage.MAPPING_SIGNALS, Stage.ALIGNING_SIGNALS, Stage.REPLAYING_LOOP)]
    if axles:
        rest += [Progress(Stage.IDENTIFYING_STEERING), *(Progress(Stage.JUDGING_STEERING, a) for a in axles)]
    rest += [Progress(Stage.IDENTIFYING_WHEELS), Progress(Stage.JUDGING_WHEELS)]
    rest += [Progress(Stage.JUDGING_WHEEL, w) for w in wheels]
    rest += [Progress(Stage.DECIDING), Progress(Stage.WRITING_REPORT)]
    return Plan([*files, *((p, p.stage.cost * total) for p in rest)], total)


def _megabytes(path: Path) -> float:
    try:
        files = [path] if path.is_file() else [f for f in path.iterdir() if f.is_file()]
        return sum(f.stat().st_size for f in files) * 1e-6
    except OSError:
        return 0.0


def _clock(seconds: float) -> str:
    minutes, s = divmod(round(seconds), 60)
    hours, m = divmod(minutes, 60)
    return f"{hours}:{m:02d}:{s:02d}" if hours else f"{m}:{s:02d}"


@contextmanager
def shown_plan(plan: Plan, stream: IO[str]) -> Iterator[Subscriber]:
    """Show the stages of a plan on a terminal until the block ends; give the subscriber that follows them."""
    from rich.live import Live
    from rich.progress_bar import ProgressBar
    from rich.spinner import Spinner
    from rich.table import Table
    from rich.text import Text

    spinner = Spinner("dots")

    def line() -> Table:
        share = plan.share()
        row = Table.grid(padding=(0, 1, 0, 0))
        text = Text(clean(plan.text), no_wrap=True, overflow="ellipsis")
        bar = ProgressBar(1.0, share or 0.0, width=24) if plan.stages else Text("")
        percent = Text(f"{100 * share:3.0f} %" if share is not None else "")
        row.add_row(spinner, text, bar, percent, Text(plan.words(), style="dim", no_wrap=True))
        return row

    with Live(get_renderable=line, console=console_of(stream), refresh_per_second=8, transient=True):
        yield plan.begin
