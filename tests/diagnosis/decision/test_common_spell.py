"""All wheels that lose for a spell, beside the rest of the mission at the same speeds and openings."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.clearing.cells import Array, Cells
from diagnosis.decision import common_spell as module
from diagnosis.decision.common_response import Common
from diagnosis.decision.common_spell import beside_the_rest, common_spell

N, LONG, BESIDE, HOP_S = 200, 12, 5, 0.5
RNG = np.random.default_rng(7)
AHEAD = (np.arange(N) < 90) | (np.arange(N) >= 130)
SPEED = np.repeat(RNG.choice([0.3, 0.5, 0.7, 1.0], N // 8), 8)
DEAD = 0.1  # of a valve whose opening beyond it is a speed


def driven(off: Array, *, held: bool = True) -> Common:
    """What a machine does that loses `off` [ln], whose loop holds the speeds or does not."""
    speed = SPEED if held else SPEED * np.exp(off)
    opening = DEAD + 0.6 * speed / np.exp(off)
    response = np.log(speed / opening) + RNG.normal(0.0, 0.01, N)
    return Common(response, (1.4 * speed, opening), (AHEAD, ~AHEAD), HOP_S)


def spell(monkeypatch: pytest.MonkeyPatch, common: Common) -> tuple[float, float, float] | None:
    monkeypatch.setattr(module, "common_of", lambda _: common)
    return common_spell(cast(Cells, SimpleNamespace()))


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize(("first", "last"), [(30, 46), (150, 190)])
def test_what_all_wheels_lose_for_a_spell_is_found(
    monkeypatch: pytest.MonkeyPatch, first: int, last: int, *, held: bool
) -> None:
    found = spell(monkeypatch, driven(np.log(0.6) * ((np.arange(N) >= first) & (np.arange(N) < last)), held=held))
    assert found is not None
    assert -0.55 < found[0] < -0.3
    assert first * HOP_S - 1 <= found[1] <= found[2] <= last * HOP_S + 1


def test_a_spell_that_is_the_only_driving_back_is_held_to_driving_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    found = spell(monkeypatch, driven(np.log(0.6) * ~AHEAD))
    assert found is not None
    assert found[0] < -0.3


def test_what_valves_make_of_speeds_is_no_spell(monkeypatch: pytest.MonkeyPatch) -> None:
    found = spell(monkeypatch, driven(np.zeros(N)))
    assert found is not None
    assert abs(found[0]) < 0.04


def test_speeds_that_the_rest_does_not_drive_tell_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    off = np.log(0.6) * (SPEED == 1.0)
    common = driven(off)
    fast = np.flatnonzero(SPEED == 1.0)
    inside = fast[fast < fast[0] + 20]
    response = common.response.copy()
    response[np.setdiff1d(fast, inside)] = np.nan  # driven in one spell alone
    found = spell(monkeypatch, common._replace(response=response))
    assert found is None or abs(found[0]) < 0.1


def test_of_little_driving_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    common = driven(np.zeros(N))
    few = np.where(np.arange(N) < 20, common.response, np.nan)
    assert spell(monkeypatch, common._replace(response=few)) is None
    assert spell(monkeypatch, common._replace(response=np.full(N, np.nan))) is None


def test_spells_are_off_what_least_squares_over_the_rest_gives() -> None:
    common = driven(np.log(0.7) * (np.arange(N) >= 160))
    x, use = common.levels[0] / common.levels[0].max(), np.arange(N) % 7 > 0
    found = beside_the_rest(common.response, x, use, AHEAD, LONG, BESIDE)
    terms = np.column_stack([AHEAD, ~AHEAD, np.log(x), 1.0 / x])
    for k in np.flatnonzero(np.isfinite(found))[::17]:
        rest = use.copy()
        rest[max(0, k - BESIDE) : k + LONG + BESIDE] = False
        inside = np.flatnonzero(use[k : k + LONG]) + k
        if min(np.count_nonzero(rest & AHEAD), np.count_nonzero(rest & ~AHEAD)) < 2 * LONG:
            continue
        curve = np.linalg.lstsq(terms[rest], common.response[rest], rcond=None)[0]
        left = common.response - terms @ curve
        mean = float(np.mean(left[inside]))
        expected = mean if abs(mean) > 3.0 * np.sqrt(np.mean(left[rest] ** 2)) else 0.0
        assert found[k] == pytest.approx(expected, abs=0.02)


def test_of_a_machine_with_two_gears_no_spell_stands_out(monkeypatch: pytest.MonkeyPatch) -> None:
    gear = np.log(0.6) * (np.arange(N) // 25 % 2)
    found = spell(monkeypatch, driven(gear))
    assert found is None or found[0] == 0.0
