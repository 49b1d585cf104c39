"""The sample missions are diagnosed as their golden files say, in every format alike, and contradict themselves nowhere."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import orjson
import pytest

from tests.campaigns import campaign_of_rows
from tests.contradictions import contradictions

FOLDER = Path(__file__).resolve().parents[1] / "sample_logs"
STEMS = ("three_faults", "paper", "healthy_ice", "spool", "base")
STEP = 0.02  # of the samples' 50 Hz [s]


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make", FOLDER / "make.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def golden(stem: str) -> Any:
    return json.loads((FOLDER / "golden" / f"{stem}.json").read_text(encoding="utf-8"))


def check(found: dict[str, Any], expected: dict[str, Any]) -> None:
    """Equal parts, modes and verdict; times within two samples, ε within 0.02."""
    assert found["verdict"] == expected["verdict"]
    order = ("component", "side", "start_s")
    rows = [sorted(r["intervals"], key=lambda row: [row[k] for k in order]) for r in (found, expected)]
    words = ("component", "side", "mode", "severity")
    assert [[r[k] for k in words] for r in rows[0]] == [[r[k] for k in words] for r in rows[1]]
    for a, b in zip(*rows, strict=True):
        assert a["start_s"] == pytest.approx(b["start_s"], abs=2 * STEP + 1e-6), (a, b)
        assert a["stop_s"] == pytest.approx(b["stop_s"], abs=2 * STEP + 1e-6), (a, b)
        assert a["epsilon"] == (None if b["epsilon"] is None else pytest.approx(b["epsilon"], abs=0.02)), (a, b)


def test_every_mission_has_a_golden_file(maker: ModuleType) -> None:
    assert tuple(maker.golden_names()) == STEMS
    assert sorted(p.stem for p in (FOLDER / "golden").iterdir()) == sorted(STEMS)


@pytest.mark.parametrize("stem", STEMS)
def test_samples_are_diagnosed_as_before(maker: ModuleType, stem: str) -> None:
    expected = golden(stem)
    result = maker.diagnosed(FOLDER / expected["log"])
    check(maker.golden_of(FOLDER / expected["log"], result), expected)
    assert contradictions(orjson.loads(orjson.dumps(result.report)), result.columns) == []


@pytest.mark.parametrize(
    ("name", "machine"),
    campaign_of_rows(
        [("paper_twincat.csv", "haulotte-twincat.toml"), ("paper.bag", None), ("paper_rosbag2", "haulotte.toml")]
    ),  # that the formats hold the same signals is in every run: tests/replay/export/test_samples.py
)
def test_the_papers_mission_is_diagnosed_alike_in_every_format(
    maker: ModuleType, name: str, machine: str | None
) -> None:
    log = FOLDER / name
    check(maker.golden_of(log, maker.diagnosed(log, FOLDER / machine if machine else None)), golden("paper"))


def test_a_changed_result_is_noticed() -> None:
    expected = golden("paper")
    for change in ({"mode": "noisy"}, {"epsilon": 0.97}, {"start_s": 30.1}, {"severity": "low"}):
        changed = json.loads(json.dumps(expected))
        stuck = next(r for r in changed["intervals"] if (r["component"], r["mode"]) == ("FR", "stuck"))
        stuck |= change
        with pytest.raises(AssertionError):
            check(changed, expected)
