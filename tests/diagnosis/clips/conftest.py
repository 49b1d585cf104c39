"""The mission that clips and exports are made of."""

from __future__ import annotations

import pytest

from diagnosis.results.result import MissionResult
from replay.mission import Mission
from tests.clip_samples import judged


@pytest.fixture(scope="session")
def mission(tmp_path_factory: pytest.TempPathFactory) -> tuple[Mission, MissionResult]:
    """20 s at 100 Hz with the FR speed sensor stuck from 8 to 12 s, diagnosed."""
    return judged(tmp_path_factory.mktemp("log"))
