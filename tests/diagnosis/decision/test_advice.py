"""How a technician checks a part."""

from __future__ import annotations

import pytest

from diagnosis.decision.advice import check_of, check_of_all
from diagnosis.results.machine_words import HYDRAULIC, MachineWords
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Kind
from replay.faults import FaultMode, Side

_ROWS = [mode for mode in FaultMode if mode is not FaultMode.OUTSIDE_TABLE]
_MACHINES = [
    HYDRAULIC,
    MachineWords("motor"),
    MachineWords("drive"),
    MachineWords("motor", "joint", "rad/s"),
    MachineWords("drive", "joint", "deg/s"),
]


@pytest.mark.parametrize("words", _MACHINES)
@pytest.mark.parametrize("kind", Kind)
@pytest.mark.parametrize("side", Side)
@pytest.mark.parametrize("mode", FaultMode)
def test_every_part_and_row_has_a_check_in_the_words_of_its_machine(
    words: MachineWords, kind: Kind, side: Side, mode: FaultMode
) -> None:
    text = check_of(kind, "FR", side, mode, words)
    assert text.endswith(".")
    assert not set("{}") & set(text)
    if words.drive != "valve":
        assert not any(word in text for word in ("valve", "spool", "oil", "pilot"))
    if words.part == "joint" and kind is Kind.WHEEL:
        assert "wheel" not in text


@pytest.mark.parametrize("mode", _ROWS)
@pytest.mark.parametrize("side", [Side.SENSOR, Side.ACTUATOR])
def test_a_check_names_a_swap_test(side: Side, mode: FaultMode) -> None:
    for words in (HYDRAULIC, MachineWords("motor")):
        assert "Swap test" in check_of(Kind.WHEEL, "FR", side, mode, words)


def test_a_check_names_connector_supply_expected_value_and_tool() -> None:
    text = check_of(Kind.WHEEL, "FR", Side.SENSOR, FaultMode.NO_SIGNAL, HYDRAULIC)
    assert all(word in text for word in ("connector", "supply", "multimeter", "expected the rated voltage within 10 %"))


def test_the_machine_files_own_words_come_first_the_most_specific_one() -> None:
    own = {
        "wheel.sensor": "any",
        "wheel.sensor.stuck": "stuck",
        "FR.sensor": "of FR",
        "FR.sensor.noisy": "noisy of FR",
        "steer.actuator": "axle",
    }

    def said(kind: Kind, component: str, side: Side, mode: FaultMode) -> str:
        return check_of(kind, component, side, mode, HYDRAULIC, own)

    assert said(Kind.WHEEL, "FL", Side.SENSOR, FaultMode.NOISY) == "any"
    assert said(Kind.WHEEL, "FL", Side.SENSOR, FaultMode.STUCK) == "stuck"
    assert said(Kind.WHEEL, "FR", Side.SENSOR, FaultMode.STUCK) == "of FR"
    assert said(Kind.WHEEL, "FR", Side.SENSOR, FaultMode.NOISY) == "noisy of FR"
    assert said(Kind.STEER, "front", Side.ACTUATOR, FaultMode.STUCK) == "axle"
    assert said(Kind.WHEEL, "FR", Side.ACTUATOR, FaultMode.STUCK) == check_of(
        Kind.WHEEL, "FR", Side.ACTUATOR, FaultMode.STUCK, HYDRAULIC
    )


@pytest.mark.parametrize(("p", "both"), [(0.35, True), (0.1, False)])
def test_what_may_be_the_other_part_is_checked_second(p: float, both: bool) -> None:
    hypotheses = (
        Hypothesis("actuator", "inefficient", 0.6),
        Hypothesis("sensor", "inefficient", p),
        Hypothesis("none", "healthy", 0.4 - p),
    )
    part = (Kind.STEER, "rear", Side.ACTUATOR, FaultMode.INEFFICIENT)
    text, valve = check_of_all(*part, hypotheses, HYDRAULIC), check_of(*part, HYDRAULIC)
    assert text.startswith(valve)
    sensor = check_of(Kind.STEER, "rear", Side.SENSOR, FaultMode.INEFFICIENT, HYDRAULIC)
    assert (text == f"{valve} If that is in order: the rear steering sensor may be it as well (35 %). {sensor}") is both
