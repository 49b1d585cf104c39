"""SECURITY.md states the limits that the code has."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

TEXT = (Path(__file__).resolve().parents[1] / "SECURITY.md").read_text(encoding="utf-8")
LIMITS = re.findall(r"^\| .* \| ([\d ]+)(?: (KiB|MiB|GiB|ms))? \| `([\w.]+)\.(\w+)` \|$", TEXT, re.MULTILINE)
UNITS = {"": 1, "ms": 1, "KiB": 1 << 10, "MiB": 1 << 20, "GiB": 1 << 30}


def test_every_row_is_understood() -> None:
    table = TEXT[TEXT.index("| limit | value | constant |") :]
    rows = table[: table.index("\n\n")].splitlines()[2:]
    assert len(rows) == len(LIMITS) > 20


@pytest.mark.parametrize(("number", "unit", "module", "name"), LIMITS)
def test_the_limit_is_the_constants(number: str, unit: str, module: str, name: str) -> None:
    assert getattr(import_module(module), name) == int(number.replace(" ", "")) * UNITS[unit]
