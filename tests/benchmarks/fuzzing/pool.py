"""Workers that are killed where they hang and started again where they die; what they find is kept."""

from __future__ import annotations

import json
import multiprocessing
import os
import re
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from tests.benchmarks.fuzzing.case import Sample
from tests.benchmarks.fuzzing.formats import TARGETS
from tests.benchmarks.fuzzing.tally import Score
from tests.benchmarks.fuzzing.watch import Watch, end, taken_by
from tests.benchmarks.fuzzing.worker import Answer, input_of, lay_out, sound_samples, work

BATCH, KEPT, MOST_SPENT_S = 200, 3, 60.0
_CONTEXT = multiprocessing.get_context("fork")
_UNWATCHED = ("starting", "making", "compiling")


@dataclass
class Slot:
    """A worker and what it has to do."""

    number: int
    name: str = ""
    process: BaseProcess | None = None
    link: Connection | None = None
    todo: list[int] = field(default_factory=list)
    since: float = 0.0
    watch: Watch | None = None
    stage: str = ""


class Pool:
    """Runs inputs of several formats over the processors, the format with the least time so far first."""

    def __init__(self, names: list[str], seed: int, first: int, folder: Path, out: Path, jobs: int) -> None:
        self.names, self.seed, self.folder, self.out = names, seed, folder, out
        self.scores = {name: Score() for name in names}
        self._first = first
        self._next = dict.fromkeys(names, first)
        self._spent = dict.fromkeys(names, 0.0)
        self._slots = [Slot(k) for k in range(jobs)]
        self._samples: dict[str, list[Sample]] = {}
        self._ended = threading.Event()
        for name in names:  # here, so that workers are forked with what was loaded and compiled for them
            place = folder / f"corpus-{name}"
            place.mkdir()
            self._samples[name] = sound_samples(TARGETS[name](), place)

    def stop(self) -> None:
        """End a run soon; what was counted is kept, what a worker is reading is not. Fit for a handler of signals."""
        self._ended.set()

    @property
    def stopped(self) -> bool:
        """Whether somebody asked for an end."""
        return self._ended.is_set()

    def cpu_s(self) -> float:
        """Time of a processor of all that was done: making, reading and checking [s]."""
        return sum(os.times()[:4]) + sum(map(_cpu, self._slots))

    def run(self, seconds: float, most: int, tell: Callable[[], None] = lambda: None) -> None:
        """Run for a time, or until each format had its number of inputs, or until it is stopped.

        Parameters
        ----------
        seconds : float
            How long inputs are given out [s].
        most : int
            Inputs of each format.
        tell : Callable
            Called a few times a second.

        Raises
        ------
        RuntimeError
            Where a worker ends while it makes an input.
        """
        until = time.monotonic() + seconds
        try:
            while not self.stopped and (time.monotonic() < until or any(slot.todo for slot in self._slots)):
                for slot in self._slots:
                    if not slot.todo and time.monotonic() < until:
                        self._give(slot, most)
                links = [slot.link for slot in self._slots if slot.link is not None and slot.todo]
                if not links:
                    break
                for link in wait(links, timeout=0.2):
                    self._take(next(s for s in self._slots if s.link is link))
                for slot in self._slots:
                    self._watch(slot)
                tell()
        finally:
            for slot in self._slots:
                self._stop(slot)

    def _give(self, slot: Slot, most: int) -> None:
        names = [n for n in self.names if self._next[n] - self._first < most]
        if not names:
            return
        name = min(names, key=self._spent.__getitem__)
        if slot.process is None or slot.name != name:
            self._stop(slot)
            slot.name = name
            self._start(slot)
        first = self._next[name]
        self._next[name] = min(first + BATCH, self._first + most)
        slot.todo = list(range(first, self._next[name]))
        self._spent[name] += 1e-3
        self._send(slot)

    def _start(self, slot: Slot) -> None:
        slot.link, far = _CONTEXT.Pipe()
        place = self.folder / f"worker-{slot.number}"
        arguments = (far, slot.name, self._samples[slot.name], place, self.seed)
        slot.process = _CONTEXT.Process(target=work, args=arguments, daemon=True)
        slot.process.start()
        far.close()
        assert slot.process.pid is not None
        slot.watch = Watch(slot.process.pid)

    def _send(self, slot: Slot) -> None:
        assert slot.link is not None
        slot.link.send(slot.todo)
        slot.since, slot.stage = time.monotonic(), "starting"

    def _take(self, slot: Slot) -> None:
        assert slot.link is not None
        assert slot.watch is not None
        try:
            while slot.todo and slot.link.poll():
                got: Any = slot.link.recv()
                if slot.stage != "starting":
                    self._spent[slot.name] += min(
                        time.monotonic() - slot.since, MOST_SPENT_S
                    )  # the machine may have stood still
                slot.since = time.monotonic()
                slot.watch.begin()
                if isinstance(got, str):
                    slot.stage = got
                    continue
                slot.stage = "making"
                slot.todo.remove(got["number"])
                self._count(slot.name, got)
        except (EOFError, ConnectionResetError):
            self._lost(slot, "crash")

    def _watch(self, slot: Slot) -> None:
        if slot.process is None or not slot.todo or slot.stage in _UNWATCHED:
            return
        assert slot.process.pid is not None
        assert slot.link is not None
        assert slot.watch is not None
        if (kind := slot.watch.over()) and not slot.link.poll():  # else it has said something meanwhile
            os.kill(slot.process.pid, signal.SIGUSR1)
            time.sleep(0.2)
            end(slot.process.pid)
            self._lost(slot, kind)

    def _lost(self, slot: Slot, kind: str) -> None:
        """Record the input that a worker died of, and start another worker with the rest."""
        assert slot.process is not None
        assert slot.watch is not None
        slot.process.join(5)
        code, number = slot.process.exitcode, slot.todo.pop(0)
        trace = (self.folder / f"worker-{slot.number}.trace").read_text(errors="replace")
        if slot.stage in _UNWATCHED and kind == "crash":
            raise RuntimeError(f"{slot.name} {self.seed}:{number}: the worker ended (exit code {code}): {trace}")
        what = {
            "hang": f"no end after {slot.watch}",
            "waited": f"no end after {slot.watch}",
            "crash": f"the interpreter died (exit code {code})",
        }
        if slot.stage == "checking":
            kind, what["peer"] = "peer", "another library hangs, sleeps or dies"
        answer = Answer(
            number=number, sample="", what="", outcome=kind, cpu_s=slot.watch.busy_s,
            kind="" if kind == "peer" else kind, text=what[kind], trace=trace,
        )  # fmt: skip
        self._count(slot.name, answer)
        self._stop(slot)
        if slot.todo:
            self._start(slot)
            self._send(slot)

    def _count(self, name: str, answer: Answer) -> None:
        score = self.scores[name]
        score.inputs += 1
        score.cpu_s += answer["cpu_s"]
        score.slowest_s = max(score.slowest_s, answer["cpu_s"])
        score.outcomes[answer["outcome"]] += 1
        if not answer["kind"]:
            return
        mark = _mark(answer)
        score.findings[mark] += 1
        if score.findings[mark] > KEPT:
            return
        place = self.out / f"{name}-{self.seed}-{answer['number']}"
        if place.exists():
            shutil.rmtree(place)
        sample, case, _ = input_of(TARGETS[name](), self._samples[name], self.seed, answer["number"])
        lay_out(sample, case, place)
        answer.update(sample=sample.name, what=case.what)
        (place / "finding.json").write_text(json.dumps({"format": name, "seed": self.seed, **answer}, indent=1))
        if score.findings[mark] == 1:
            words = f"{name} {self.seed}:{answer['number']} ({sample.name}; {case.what}): {answer['kind']}: {answer['text'][:400]}"
            print(f"{words}\n  {place}", file=sys.stderr, flush=True)

    def _stop(self, slot: Slot) -> None:
        if slot.link is not None:
            slot.link.close()
        if slot.process is not None:
            if slot.process.pid is not None:
                end(slot.process.pid)
            slot.process.join()
        slot.process = slot.link = slot.watch = None


def _cpu(slot: Slot) -> float:
    return taken_by(slot.process.pid).cpu_s if slot.process is not None and slot.process.pid is not None else 0.0


def _mark(answer: Answer) -> str:
    """What findings of one cause share."""
    places = re.findall(r'File "[^"]*?([\w.]+)", line (\d+)', answer["trace"])
    last = answer["trace"].strip().rpartition("\n")[2].partition(":")[0][:60]
    words = "" if answer["kind"] == "foreign" else re.sub("[0-9]+", "#", answer["text"])[:40]
    return f"{answer['kind']} {places[-3:]} {last} {words}"
