"""One short mission with known faults, diagnosed once."""

from __future__ import annotations

from pathlib import Path

import pytest

import mfhca


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> mfhca.MadeLog:
    return mfhca.simulate(
        tmp_path_factory.mktemp("known") / "known.mcap",
        scenario="healthy",
        faults=["FR sensor stuck 6 10", "RL sensor noisy 12 15 eps=0.4"],
        duration_s=18,
        rate_hz=250,
    )


@pytest.fixture(scope="session")
def result(made: mfhca.MadeLog) -> mfhca.Diagnosis:
    return mfhca.diagnose(made.log)


@pytest.fixture(scope="session")
def saved(result: mfhca.Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return result.save(tmp_path_factory.mktemp("saved") / "report").parent
