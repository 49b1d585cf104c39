"""Damaged logs end in a log, in a log with damage, or in a `LogError`; never in anything else."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from replay.errors import LogError
from replay.export.mission import FORMATS, write_mission
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.machine.config import haulotte
from replay.readers.registry import read_log, summarise_log
from replay.signals.mapping import map_signals
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

ROUNDS = 40


@pytest.fixture(scope="module")
def mission() -> SimulatedMission:
    return simulate_mission(SimulationOptions(duration_s=1.5, rate_hz=200))


def mutations(raw: bytes, seed: int) -> Iterator[bytes]:
    """Cuts, single flipped bits and overwritten stretches at random places."""
    rng = np.random.default_rng(seed)
    for i in range(ROUNDS):
        place = int(rng.integers(0, len(raw)))
        if i % 3 == 0:
            yield raw[:place]
            continue
        changed = bytearray(raw)
        if i % 3 == 1:
            changed[place] ^= 1 << int(rng.integers(0, 8))
        else:
            stretch = rng.integers(0, 256, int(rng.integers(1, 64)), dtype=np.uint8).tobytes()
            changed[place : place + len(stretch)] = stretch
        yield bytes(changed)


def attempt(path: Path) -> RawLog | None:
    try:
        summarise_log(path, SourceOptions())
        log = read_log(path, SourceOptions())
    except LogError as error:
        message = str(error)
    else:
        map_signals([log], haulotte())
        return log
    assert str(path) in message
    return None


@pytest.mark.parametrize("name", FORMATS)
def test_random_damage(tmp_path: Path, mission: SimulatedMission, name: str) -> None:
    path = tmp_path / "log"
    write_mission(mission, path, name)
    target = next(path.glob("*.db3")) if path.is_dir() else path
    raw = target.read_bytes()
    whole = read_log(path, SourceOptions())
    assert whole.summary.damage == ()
    for content in mutations(raw, 7):
        target.write_bytes(content)
        log = attempt(path)
        if name == "mcap" and log is not None and not log.summary.damage:
            assert log.channels.keys() == whole.channels.keys()
            for key, channel in whole.channels.items():
                np.testing.assert_array_equal(log.channels[key].values, channel.values)
                np.testing.assert_array_equal(log.channels[key].stamps, channel.stamps)


@pytest.mark.parametrize("name", FORMATS)
def test_cut_off_logs_are_never_whole_without_saying_so(tmp_path: Path, mission: SimulatedMission, name: str) -> None:
    path = tmp_path / "log"
    write_mission(mission, path, name)
    target = next(path.glob("*.db3")) if path.is_dir() else path
    raw = target.read_bytes()
    for share in (0.35, 0.65, 0.95):
        target.write_bytes(raw[: int(len(raw) * share)])
        log = attempt(path)
        assert log is None or log.summary.damage
