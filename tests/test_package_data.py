"""What the wheel carries: every file that the code reads beside itself, not its modules alone."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("replay", "diagnosis", "cli", "mfhca")


def test_the_trees_are_a_resource_of_their_package() -> None:
    assert files("diagnosis.wheels").joinpath("forests.npz").is_file()


def test_the_wheel_has_all_data_files() -> None:
    wheel = pytest.importorskip(
        "hatchling.builders.wheel", reason="hatchling builds the wheel; without it nothing is to check"
    )
    built = {Path(f.distribution_path).as_posix() for f in wheel.WheelBuilder(str(ROOT)).recurse_included_files()}
    data = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".py"
    }
    assert "diagnosis/wheels/forests.npz" in data
    assert data <= built
