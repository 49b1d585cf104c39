"""Varied missions: apart by kind, the same for the same seed, and machines that drive."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from replay.errors import ConfigError
from replay.simulation.run import simulate_mission
from replay.simulation.variation import RANGES, varied_options
from tests.campaigns import campaign

SEEDS = {"tuning": range(60), "reporting": range(2000, 2060)}


@pytest.mark.parametrize(("kind", "seed"), [("tuning", 1000), ("tuning", -1), ("reporting", 0), ("reporting", 1999)])
def test_a_seed_of_the_other_pool_is_refused(kind: Any, seed: int) -> None:
    with pytest.raises(ConfigError, match=r"is not a \w+ seed"):
        varied_options(seed, kind=kind)


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(ConfigError, match="kind"):
        varied_options(5, kind="other")  # type: ignore[arg-type]


def test_reporting_ranges_hold_the_tuning_ranges_and_reach_beyond() -> None:
    tuning, reporting = RANGES["tuning"], RANGES["reporting"]
    assert tuning.plant.keys() == reporting.plant.keys()
    pairs = [(tuning.plant[name], reporting.plant[name]) for name in tuning.plant]
    spans = [f.name for f in fields(tuning) if f.name not in ("plant", "rates")]
    pairs += [(getattr(tuning, name), getattr(reporting, name)) for name in spans]
    assert all(b[0] <= a[0] and b[1] > a[1] for a, b in pairs)
    assert set(tuning.rates) < set(reporting.rates)


@pytest.mark.parametrize("kind", ["tuning", "reporting"])
def test_draws_fill_their_ranges(kind: Any) -> None:
    made = [varied_options(seed, kind=kind) for seed in SEEDS[kind]]
    assert made[3] == varied_options(SEEDS[kind][3], kind=kind)
    low, high = RANGES[kind].plant["K"]
    drawn = np.array([o.plant.K for o in made])
    assert low <= drawn.min() < 1.3 * low < 0.8 * high < drawn.max() <= high
    assert {o.law for o in made} == {"opposed", "signed", "event_reset", "p", "printed"}
    assert {o.coupling for o in made} == {"free", "ground"}
    assert {o.scenario for o in made} == {"paper", "random"}
    assert {o.silent for o in made} == {"zero", "nan", "drop"}
    assert len({o.rate_hz for o in made}) > 4
    assert 0 < sum(o.jitter > 0 for o in made) < len(made)
    assert 0 < sum(o.drop_share > 0 for o in made) < len(made)


@pytest.mark.parametrize("seed", campaign([2003, 2011, 2027]))
def test_healthy_varied_machines_follow_their_commands(seed: int) -> None:
    options = varied_options(seed, kind="reporting", scenario="healthy", duration_s=60.0)
    mission = simulate_mission(options)
    assert mission.truth.intervals == ()
    for wheel in mission.truth.wheels:
        v, v_ref = mission.actual[f"wheel.{wheel}.v"], mission.actual[f"wheel.{wheel}.v_ref"]
        forward = v_ref > 0.15
        assert np.all(np.isfinite(v))
        assert np.mean(v[forward] > 0.02) > 0.8
