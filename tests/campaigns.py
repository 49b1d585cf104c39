"""Parameters over which a test repeats its proof: the first ones in every run, the rest with `pytest --long` alone."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from _pytest.mark.structures import ParameterSet


def campaign(values: Iterable[object], short: int = 1) -> list[ParameterSet]:
    """Values of a parameter, all after the first `short` marked as long."""
    return [pytest.param(value, marks=[pytest.mark.long] if k >= short else []) for k, value in enumerate(values)]
