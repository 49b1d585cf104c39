"""A short form of `tests/benchmarks/fuzz.py`, from a fixed seed; and that the fuzzer notices what it is for."""

from __future__ import annotations

import ctypes
import random
from pathlib import Path

import numpy as np
import pytest

from replay.border import UnforeseenContent

pytest.importorskip("google.protobuf", reason="samples of protobuf need it")
pytest.importorskip("nptdms", reason="npTDMS is an extra")

from tests.benchmarks.fuzzing import pool
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.formats import TARGETS
from tests.benchmarks.fuzzing.pool import Pool
from tests.benchmarks.fuzzing.worker import input_of, lay_out, sound_samples, tried

SEED, COUNT = 7, {"mcap": 30, "rosbag2": 20, "store": 15, "results": 20, "first-look": 15}


@pytest.mark.parametrize("name", TARGETS)
def test_damaged_inputs_end_in_one_stated_way(tmp_path: Path, name: str) -> None:
    target = TARGETS[name]()
    (corpus := tmp_path / "corpus").mkdir()
    samples = sound_samples(target, corpus)
    for number in range(COUNT.get(name, 40)):
        sample, case, source = input_of(target, samples, SEED, number)
        answer = tried(target, sample, case, source, lay_out(sample, case, tmp_path / str(number)))
        assert not answer["kind"], (number, answer)


class Faulty:
    """A reader with every fault that the fuzzer knows."""

    name = "faulty"
    ways = ("whole", "foreign", "border", "hang", "crash", "memory", "silent", "whole")

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
        if way == "crash":
            ctypes.string_at(0)
        if way == "memory":
            np.ones(300 << 17)
        return Reading("whole", way)

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        if reading.content == "silent":
            raise Finding("silent", "less than was written")


def test_the_fuzzer_notices_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(TARGETS, "faulty", Faulty)
    monkeypatch.setattr(pool, "HANG_CPU_S", 1.5)
    (work := tmp_path / "work").mkdir()
    (out := tmp_path / "out").mkdir()
    runs = Pool(["faulty"], SEED, 0, work, out, 1)
    runs.run(60.0, 20)
    score = runs.scores["faulty"]
    assert score.inputs == 20
    assert set(score.outcomes) == {"whole", "foreign", "hang", "crash", "memory", "silent"}
    kept = sorted(p.name for p in out.iterdir())
    assert kept
    assert all((out / name / "a").is_file() and (out / name / "finding.json").is_file() for name in kept)
    assert "faulty 7:" in capsys.readouterr().err
