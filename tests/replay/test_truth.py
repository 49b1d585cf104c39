"""Truth files from outside end in a truth or in one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from diagnosis.api.truths import is_truth
from replay.errors import ConfigError
from replay.truth import MissionTruth, read_truth, write_truth

TRUTH = MissionTruth(wheels=("FR",), rate_hz=100.0, start_ns=5, duration_s=60.0, driving_speed=0.05)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "a.truth.json"


def test_what_is_written_is_read_back(path: Path) -> None:
    write_truth(TRUTH, path)
    assert read_truth(path) == TRUTH
    assert is_truth(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "is not JSON"),
        ('{"a":' * 100_000, "is not JSON"),
        ('"\\ud800"', "is not JSON"),
        ('{"schema": "' + "x" * 9_000 + '"}', "schema is 'xxx"),
        (
            '{"schema": "mfhca-truth/1", "wheels": [], "rate_hz": 1, "start_ns": 1e300, "duration_s": 1, "intervals": 3}',
            "truth file",
        ),
        ('{"schema": "mfhca-truth/1", "wheels": [], "rate_hz": [], "start_ns": 1}', "is not a complete truth file"),
    ],
    ids=["deep", "deeper", "surrogate", "schema", "intervals", "rate"],
)
def test_what_is_none_is_refused_in_one_sentence(path: Path, text: str, words: str) -> None:
    path.write_text(text)
    with pytest.raises(ConfigError, match=words) as found:
        read_truth(path)
    assert len(str(found.value)) < 600
    assert is_truth(path) is ("mfhca-truth/1" in text)
