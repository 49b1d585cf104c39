"""One worker: makes damaged inputs by their numbers, reads them, and says what became of each."""

from __future__ import annotations

import faulthandler
import os
import random
import resource
import shutil
import signal
import threading
import time
import traceback
import warnings
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypedDict

from tests.benchmarks.fuzzing.case import Case, Finding, Sample, Target
from tests.benchmarks.fuzzing.compiler import CompilerTime
from tests.benchmarks.fuzzing.formats import TARGETS

SPARE_BYTES, TIMES_FILE = 256 << 20, 4
ADDRESS_BYTES = 8 << 30
_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


class Answer(TypedDict):
    """What became of one input.

    `cpu_s` is the time of our reading alone, without the compiler's; `kind` and `text` are empty where nothing is wrong.
    """

    number: int
    sample: str
    what: str
    outcome: str
    cpu_s: float
    kind: str
    text: str
    trace: str


def source_of(seed: int, name: str, number: int) -> random.Random:
    """Randomness of one input, the same on every machine."""
    return random.Random(f"{seed}/{name}/{number}")  # a text: its hash does not change from run to run


def input_of(target: Target, samples: list[Sample], seed: int, number: int) -> tuple[Sample, Case, random.Random]:
    """Make an input again from its seed and number."""
    source = source_of(seed, target.name, number)
    sample = source.choice(samples)
    return sample, target.damaged(sample, source), source


def lay_out(sample: Sample, case: Case, folder: Path) -> Path:
    """Write an input into an empty folder; the path to open."""
    for name, content in {**sample.files, sample.target: case.content}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return folder / sample.log


def sound_samples(target: Target, folder: Path) -> list[Sample]:
    """Samples of a format in an empty folder, each read once: what is compiled at first use is compiled here."""
    (corpus := folder / "corpus").mkdir()
    samples = []
    for k, sample in enumerate(target.corpus(corpus)):
        reading = target.read(lay_out(sample, Case(sample.raw, "sound"), folder / f"sound-{k}"), random.Random(k))
        if reading.outcome != sample.facts.get("sound", "whole"):
            raise RuntimeError(f"{target.name}, sound sample {sample.name}: {reading}")
        samples.append(replace(sample, facts={**sample.facts, "said": reading.said}))
    return samples


def tried(
    target: Target,
    sample: Sample,
    case: Case,
    source: random.Random,
    path: Path,
    tell: Any = None,
    compiler: CompilerTime | None = None,
) -> Answer:
    """Read an input and check what came out."""
    answer = Answer(number=0, sample=sample.name, what=case.what, outcome="", cpu_s=0.0, kind="", text="", trace="")

    def clock() -> float:
        return time.process_time() - (compiler.cpu_s if compiler is not None else 0.0)

    before, start = _reset_peak(), clock()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            reading = target.read(path, source)
        answer["cpu_s"], used = clock() - start, _peak() - before
        most = SPARE_BYTES + TIMES_FILE * sum(map(len, (case.content, *sample.files.values())))
        if used > most:
            raise Finding("memory", f"{used >> 20} MB for {len(case.content)} bytes")
        answer["outcome"] = reading.outcome
        reading = replace(
            reading, said=tuple(text for text in reading.said if text not in sample.facts.get("said", ()))
        )
        if tell is not None:
            tell("checking")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            target.check(sample, case, path, reading)
    except Finding as error:
        cause = error.__cause__.__cause__ if error.__cause__ is not None and error.kind == "foreign" else None
        answer.update(kind=error.kind, text=error.text, trace=_trace(cause or error))
    except MemoryError as error:
        answer.update(kind="memory", text="MemoryError", trace=_trace(error))
    except BaseException as error:  # whatever it is: none of the project's
        if isinstance(error, KeyboardInterrupt):
            raise
        answer.update(kind="foreign", text=f"{type(error).__name__}: {error}"[:500], trace=_trace(error))
    answer["cpu_s"] = answer["cpu_s"] or clock() - start
    answer["outcome"] = answer["kind"] or answer["outcome"]
    return answer


def work(link: Connection, name: str, samples: list[Sample], folder: Path, seed: int) -> None:
    """Answer batches of numbers until the other end closes the link.

    Parameters
    ----------
    link : Connection
        Gets lists of numbers; gives ``reading`` before each, ``compiling`` while the compiler works, ``checking`` before other
        libraries read, and an `Answer` for each number.
    name, samples, folder : str, list[Sample], Path
        Of the format, its samples, and a folder for inputs, beside which the traces of a dying interpreter go.
    seed : int
        Of the run.
    """
    for outside in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # whoever gave the work ends it
        signal.signal(outside, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_BYTES, ADDRESS_BYTES))
    target, talking = TARGETS[name](), threading.Lock()

    def tell(word: str) -> None:
        with talking:
            link.send(word)

    with (folder.parent / f"{folder.name}.trace").open("w") as trace:
        faulthandler.enable(trace)
        faulthandler.register(signal.SIGUSR1, trace, all_threads=False)
        sound = Case(samples[0].raw, "sound")
        tried(target, samples[0], sound, source_of(seed, name, -1), lay_out(samples[0], sound, _emptied(folder)))
        compiler = CompilerTime(tell)
        while True:
            while not link.poll(5):
                if os.getppid() == 1:  # whoever gave the work is gone
                    return
            try:
                numbers = link.recv()
            except EOFError:
                return
            for number in numbers:
                sample, case, source = input_of(target, samples, seed, number)
                path = lay_out(sample, case, _emptied(folder))
                tell("reading")
                answer = tried(target, sample, case, source, path, tell, compiler)
                answer["number"] = number
                link.send(answer)


def _emptied(folder: Path) -> Path:
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    return folder


def _trace(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))[-6000:]


def _reset_peak() -> int:
    """Set the process's peak of resident memory to what is resident now [bytes]; elsewhere than on Linux nothing is known of it."""
    if not _STATUS.exists():
        return 0
    _CLEAR.write_text("5")
    return _status("VmRSS")


def _peak() -> int:
    return _status("VmHWM") if _STATUS.exists() else 0


def _status(key: str) -> int:
    for line in _STATUS.read_text().splitlines():
        if line.startswith(key):
            return int(line.split()[1]) << 10
    return 0
