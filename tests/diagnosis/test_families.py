"""Which evidence is asked first: of motors that follow commanded speeds, their answers; of valves, the wheel model."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.evidence import MissionView
from diagnosis.families import whole
from diagnosis.results.vocabulary import Tier


@pytest.mark.parametrize(
    ("changes", "first"),
    [
        ({}, Tier.RESPONSE),
        ({"drive": "valve"}, Tier.MODEL),
        ({"axles": ("front",)}, Tier.MODEL),
        ({"wheels": ("M",)}, Tier.MODEL),
        ({"asked": np.nan}, Tier.MODEL),
    ],
)
def test_what_is_asked_first(changes: dict[str, Any], first: Tier) -> None:
    has = {"drive": "motor", "axles": (), "wheels": ("L", "R"), "asked": 0.5} | changes
    machine = SimpleNamespace(drive=has["drive"], axles=has["axles"], wheels=has["wheels"])
    mission = cast(MissionView, SimpleNamespace(machine=machine, command=lambda wheel: np.full(3, has["asked"])))
    families = whole(mission)
    assert families[0].tier is first
    assert {type(f) for f in families} == {
        type(f)
        for f in whole(
            cast(MissionView, SimpleNamespace(machine=SimpleNamespace(drive="auto", axles=(), wheels=()), command=None))
        )
    }


def test_models_that_may_have_nothing_to_judge_are_not_loaded_with_the_tables() -> None:
    models = "{'diagnosis.wheels.assess', 'diagnosis.wheels.wheel_fit', 'diagnosis.drives.assess'}"
    code = f"import diagnosis.families, sys; sys.exit(' '.join({models} & set(sys.modules)) or 0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
