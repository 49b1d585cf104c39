"""A short form of `tests/benchmarks/fuzz.py`, from a fixed seed; and that the fuzzer notices what it is for."""

from __future__ import annotations

import ctypes
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest

from replay.border import UnforeseenContent

pytest.importorskip("google.protobuf", reason="samples of protobuf need it")
pytest.importorskip("nptdms", reason="npTDMS is an extra")

from tests.benchmarks.fuzzing import watch
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.formats import TARGETS
from tests.benchmarks.fuzzing.pool import Pool
from tests.benchmarks.fuzzing.tally import Progress, inputs, table
from tests.benchmarks.fuzzing.watch import Taken, Watch, below, end, taken_by
from tests.benchmarks.fuzzing.worker import input_of, lay_out, sound_samples, tried

SEED, COUNT = 7, {"mcap": 30, "rosbag2": 20, "store": 15, "results": 20, "first-look": 15}
_SHARE = 2  # a half of them without `--long`


@pytest.mark.parametrize("name", TARGETS)
def test_damaged_inputs_end_in_one_stated_way(tmp_path: Path, name: str, pytestconfig: pytest.Config) -> None:
    target = TARGETS[name]()
    (corpus := tmp_path / "corpus").mkdir()
    samples = sound_samples(target, corpus)
    for number in range(COUNT.get(name, 40) // (1 if pytestconfig.getoption("--long") else _SHARE)):
        sample, case, source = input_of(target, samples, SEED, number)
        answer = tried(target, sample, case, source, lay_out(sample, case, tmp_path / str(number)))
        assert not answer["kind"], (number, answer)


class Faulty:
    """A reader with every fault that the fuzzer knows."""

    name = "faulty"
    ways = ("whole", "foreign", "border", "hang", "child", "asleep", "crash", "memory", "silent", "whole")

    def corpus(self, folder: Path) -> list[Sample]:
        return [Sample("one", {"a": b"1"}, "a", "a")]

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        return Case(self.ways[source.randrange(len(self.ways))].encode(), "")

    def read(self, path: Path, source: random.Random) -> Reading:
        way = path.read_text()
        if way == "foreign":
            raise IndexError("at 7")
        if way == "border":
            try:
                raise KeyError("x")
            except KeyError as error:
                try:
                    raise UnforeseenContent("said") from error
                except UnforeseenContent as said:
                    raise Finding("foreign", "said") from said
        while way == "hang":
            pass
        if way == "child":
            subprocess.run([sys.executable, "-c", "while True: pass"], check=True)
        if way == "asleep":
            time.sleep(3600)
        if way == "crash":
            ctypes.string_at(0)
        if way == "memory":
            np.ones(300 << 17)
        return Reading("whole", way)

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        if reading.content == "silent":
            raise Finding("silent", "less than was written")


def interpreters() -> set[int]:
    """Interpreters below this process; a browser of other tests comes and goes."""
    found = set()
    for pid in below(os.getpid()):
        with suppress(OSError):
            found |= {pid} if b"python" in Path(f"/proc/{pid}/cmdline").read_bytes() else set()
    return found


def test_the_fuzzer_notices_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(TARGETS, "faulty", Faulty)
    monkeypatch.setattr(watch, "HANG_CPU_S", 1.5)
    monkeypatch.setattr(watch, "WAITED_S", 2.0)
    (work := tmp_path / "work").mkdir()
    (out := tmp_path / "out").mkdir()
    others = interpreters()  # of tests that ran before in this process
    runs = Pool(["faulty"], SEED, 0, work, out, 1)
    runs.run(3600.0, 20)
    score = runs.scores["faulty"]
    assert score.inputs == 20
    assert set(score.outcomes) == {"whole", "foreign", "hang", "waited", "crash", "memory", "silent"}
    made = [input_of(Faulty(), Faulty().corpus(tmp_path), SEED, k)[1].content.decode() for k in range(20)]
    assert {"hang", "child", "asleep"} < set(made)
    assert score.outcomes["hang"] == made.count("hang") + made.count("child")
    assert score.outcomes["waited"] == made.count("asleep")
    assert interpreters() <= others
    kept = sorted(p.name for p in out.iterdir())
    assert kept
    assert all((out / name / "a").is_file() and (out / name / "finding.json").is_file() for name in kept)
    assert "faulty 7:" in capsys.readouterr().err


def test_waiting_for_a_processor_is_neither_a_hang_nor_sleep(monkeypatch: pytest.MonkeyPatch) -> None:
    at, taken = 0.0, Taken()
    monkeypatch.setattr(time, "monotonic", lambda: at)
    monkeypatch.setattr(watch, "taken_by", lambda pid: taken)
    one = Watch(1)

    def looked(seconds: float, cpu_s: float, *, sleeping: bool) -> str:
        nonlocal at, taken
        at, taken = at + seconds, Taken(cpu_s, sleeping)
        return one.over()

    assert not looked(50.0, 5.0, sleeping=True)  # counted from here
    for _ in range(4000):  # it could run and may not
        assert not looked(0.5, 5.1, sleeping=False)
    for k in range(4000):  # it runs now and then, and sleeps whenever it is looked at
        assert not looked(0.5, 5.1 + 0.001 * k, sleeping=True)
    assert not looked(1e6, 9.2, sleeping=True)  # whoever looks was stopped
    assert one.slept_s < 3.0
    assert not looked(0.1, 99.0, sleeping=False)  # too soon to look again
    assert looked(0.5, 5.1 + watch.HANG_CPU_S, sleeping=True) == "hang"
    one.begin()
    found = [looked(1.0, 99.0, sleeping=True) for _ in range(int(watch.WAITED_S) + 2)]
    assert found == [""] * (len(found) - 1) + ["waited"]


def test_a_worker_that_has_answered_meanwhile_does_not_hang(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Whole(Faulty):
        ways = ("whole",)

    monkeypatch.setitem(TARGETS, "faulty", Whole)
    for name in ("work", "out"):
        (tmp_path / name).mkdir()
    runs = Pool(["faulty"], SEED, 0, tmp_path / "work", tmp_path / "out", 1)

    def late(one: Watch) -> str:
        link = runs._slots[0].link
        return "hang" if link is not None and link.poll(600.0) else ""

    monkeypatch.setattr(Watch, "over", late)
    runs.run(3600.0, 20)
    assert runs.scores["faulty"].outcomes == {"whole": 20}


@contextmanager
def process(words: str) -> Iterator[int]:
    with subprocess.Popen([sys.executable, "-c", f"print(1, flush=True)\n{words}"], stdout=subprocess.PIPE) as running:
        assert running.stdout is not None
        running.stdout.readline()
        yield running.pid
        end(running.pid)


def until(true: Callable[[], bool]) -> None:
    while not true():
        time.sleep(0.01)


def test_what_processes_take_and_whether_they_sleep() -> None:
    with process("import time; time.sleep(3600)") as pid:
        until(lambda: taken_by(pid).sleeping)
        assert taken_by(pid).cpu_s < 10.0
        os.kill(pid, signal.SIGSTOP)
        until(lambda: not taken_by(pid).sleeping)
    with process("while True: pass") as pid:
        until(lambda: taken_by(pid).cpu_s > 0.3)
        assert not taken_by(pid).sleeping
    busy = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'while True: pass'])"
    with process(busy) as pid:  # sleeps itself
        until(lambda: taken_by(pid).cpu_s > 0.3)
        until(lambda: bool(below(pid)) and not taken_by(pid).sleeping)
    assert taken_by(pid).cpu_s == 0.0


def test_counts_are_kept_on_the_way_and_when_a_run_is_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(TARGETS, "faulty", Faulty)
    monkeypatch.setattr(Faulty, "ways", ("whole", "foreign"))
    (work := tmp_path / "work").mkdir()
    (out := tmp_path / "out").mkdir()
    runs, seen = Pool(["faulty"], SEED, 0, work, out, 1), list[int]()
    said = Progress(1e-6, tmp_path / "counts.json", {"seed": SEED})

    def tell() -> None:
        said.tell(runs.scores, runs.cpu_s)
        kept = json.loads((tmp_path / "counts.json").read_text())
        assert (kept["state"], kept["inputs"]) == ("running", inputs(runs.scores))
        seen.append(kept["inputs"])
        if kept["inputs"] > 300:
            runs.stop()

    runs.run(3600.0, 10**9, tell)
    said.tell(runs.scores, runs.cpu_s, "stopped")
    kept = json.loads((tmp_path / "counts.json").read_text())
    assert kept["state"] == "stopped"
    assert kept["inputs"] == sum(kept["formats"]["faulty"]["outcomes"].values()) >= seen[-1] > 300
    assert kept["whole_cpu_s"] > 0.0
    assert f"{'all':12}{kept['inputs']:9}" in table(runs.scores)
    assert f"{kept['inputs']} inputs" in capsys.readouterr().err


def test_a_signal_ends_the_fuzzer_with_its_table(tmp_path: Path) -> None:
    words = [
        "--minutes",
        "60",
        "--format",
        "toml",
        "--seed",
        "1",
        "--jobs",
        "1",
        "--every",
        "0.1",
        "--out",
        str(tmp_path),
    ]
    file = Path(__file__).parent / "benchmarks" / "fuzz.py"
    with subprocess.Popen(
        [sys.executable, str(file), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        for line in running.stderr:
            if " inputs (" in line and ", 0 inputs" not in line:
                break
        os.killpg(running.pid, signal.SIGTERM)  # as a terminal or a service manager ends it: its workers too
        text = running.stdout.read()
        assert ", stopped" in running.stderr.read()
    assert running.returncode == 0, text
    assert "crash" not in text
    assert any(line.startswith("all") and int(line.split()[1]) > 0 for line in text.splitlines())
