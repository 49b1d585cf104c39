"""A store with damaged bytes: read, or refused in one sentence, never anything else."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.fleet.read import content_mark, read_missions, read_run
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.outcome import MissionState, Outcome
from diagnosis.audit.store.store import FILE_NAME, Store
from replay.errors import OutputError


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("store") / FILE_NAME
    with Store(path, objects=False) as store:
        store.begin_run()
        for i in range(30):
            mission = MissionSource(f"m{i}", (str(path.parent / f"m{i}.mcap"),), 10, ("1",))
            store.record(
                mission, Key(f"{i:064x}", "c" * 64, "1"), Outcome(MissionState.CRASHED, f"m{i}.mcap: {i}"), None
            )
    return path.read_bytes()


def test_every_damaged_byte_ends_in_rows_or_in_one_sentence(tmp_path: Path, sound: bytes) -> None:
    rng, ends, path = np.random.default_rng(2), Counter[str](), tmp_path / FILE_NAME
    for _ in range(150):
        raw = bytearray(sound)
        for at in rng.integers(0, len(raw), int(rng.integers(1, 20))).tolist():
            raw[at] = int(rng.integers(256))
        for old in tmp_path.iterdir():
            old.unlink()
        path.write_bytes(raw)
        try:
            read_missions(path)
            read_run(path)
            content_mark(path)
            with Store(path, objects=False) as store:
                for mission in store.missions():
                    if mission.result is not None:
                        store.reason_for(mission.result.id, mission.result.reason, mission.files)
                store.counts()
                store.object_names()
                store.begin_run()
            ends["read"] += 1
        except OutputError as error:
            assert str(path) in str(error)  # noqa: PT017 - either end is right
            ends["refused"] += 1
    assert min(ends["read"], ends["refused"]) > 10, ends
