"""The container is built from files that its build can see."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_what_the_container_copies_is_let_into_its_build() -> None:
    let_in = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    copied: set[str] = set()
    for line in (ROOT / "Dockerfile").read_text().splitlines():
        if line.startswith("COPY ") and "--from=" not in line:
            copied.update(line.split()[1:-1])
    assert copied == let_in
    assert all((ROOT / name).exists() for name in copied)
    assert "hatch_build.py" in copied
