"""The developers' guide names files that exist, and its map names every folder."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
GUIDE = (ROOT / "docs" / "developing.md").read_text(encoding="utf-8")
_PATH = re.compile(r"`((?:replay|diagnosis|cli|tests|sample_logs|docs|\.ci)/[\w./-]+)`")


def _section(title: str) -> str:
    """Text of a section up to the next one of its level."""
    level, _, _ = title.partition(" ")
    start = GUIDE.index(f"\n{title}\n")
    stop = re.compile(rf"\n#{{1,{len(level)}}} ").search(GUIDE, start + 2)
    return GUIDE[start : stop.start() if stop else None]


@pytest.mark.parametrize("path", sorted(set(_PATH.findall(GUIDE))))
def test_what_the_guide_names_is_there(path: str) -> None:
    assert (ROOT / path).exists()


@pytest.mark.parametrize(
    ("walk", "most"),
    [
        ("Add a log format", 4),
        ("Add a fault row", 4),
        ("Add a family of evidence", 3),
        ("Change one plot of the report", 2),
        ("Change what a mission is in an audit", 1),
    ],
)
def test_walks_are_short(walk: str, most: int) -> None:
    steps = re.findall(r"^\d+\. ", _section(f"### {walk}"), re.MULTILINE)
    assert 0 < len(steps) <= most
    assert _PATH.search(_section(f"### {walk}"))


def test_the_map_names_every_folder() -> None:
    folders = {
        path.name for package in ("replay", "diagnosis", "cli") for path in (ROOT / package).rglob("*") if path.is_dir()
    } - {"__pycache__"}
    house = _section("## The house")
    assert {name for name in folders if f"{name}/" not in house} == set()


def test_benchmarks_are_named_or_explained() -> None:
    """Every script that the guide's figures rest on is in the folder."""
    figures = _section("## How figures are measured")
    scripts = set(re.findall(r"`(?:tests/benchmarks/)?(\w+\.py)`", figures))
    assert scripts
    assert {name for name in scripts if not (ROOT / "tests" / "benchmarks" / name).is_file()} == set()
