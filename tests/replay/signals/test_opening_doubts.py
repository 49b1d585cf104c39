"""Openings whose unit the mission contradicts, and those that it does not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.opening_doubts import OpeningDoubt, opening_doubt
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align

Array = NDArray[np.float64]

MACHINE = haulotte()
STAMPS = np.arange(3000, dtype=np.int64) * 20_000_000
RNG = np.random.default_rng(3)
OPENING = np.repeat(RNG.uniform(-1.0, 1.0, 60), 50)
OPENING[::7] = 0.0
WORTH = {"": 1.0, "1": 1.0, "%": 0.01, "% or V": 0.01, "% or mA": 0.01}


def doubt(
    command: Callable[[Array], Array],
    position: Callable[[Array], Array] | None = None,
    unit: str = "%",
    lost: dict[str, float] | None = None,
) -> OpeningDoubt | None:
    """Of a mission whose true openings are recorded so."""
    items: dict[str, Array] = {"cmd.v": 0.3 * OPENING}
    for w in MACHINE.wheels:
        items[f"wheel.{w}.v"] = 0.3 * OPENING + (OPENING != 0.0) * RNG.normal(0.0, 1e-3, OPENING.size)
        items[f"wheel.{w}.u"] = WORTH[unit] * command(OPENING)
        if position is not None:
            share = 1.0 - (lost or {}).get(w, 0.0)
            items[f"wheel.{w}.u_applied"] = WORTH[unit] * position(
                share * OPENING + RNG.normal(0.0, 2e-3, OPENING.size)
            )
    source = SignalSource(column="c", unit=unit or None)
    signals = {n: Signal(n, STAMPS, x, source, "run.csv", False, "") for n, x in items.items()}
    return opening_doubt(align(Signals(signals, {})), signals, MACHINE)


def percent(x: Array) -> Array:
    return 100.0 * x


def volts(x: Array) -> Array:
    return 10.0 * x


def test_openings_in_their_unit_are_no_question() -> None:
    assert doubt(percent) is None
    assert doubt(percent, percent) is None
    assert doubt(lambda x: 9.0 * x) is None  # a machine that went slowly


@pytest.mark.parametrize("lost", [{"FR": 0.9}, {"FR": 0.9, "FL": 0.3}, {"FR": 0.5, "FL": 0.4, "RR": 0.6, "RL": 0.45}])
def test_losses_of_valves_that_are_no_common_factor_are_faults(lost: dict[str, float]) -> None:
    assert doubt(percent, percent, lost=lost) is None


def test_small_losses_that_all_valves_share_are_looked_at_as_such() -> None:
    assert doubt(percent, percent, lost=dict.fromkeys(MACHINE.wheels, 0.15)) is None


@pytest.mark.parametrize(
    ("command", "position", "line"),
    [
        (volts, percent, '"wheel.FR.u" = { column = "c", unit = "1", gain = 0.1 }'),
        (percent, volts, '"wheel.FR.u_applied" = { column = "c", unit = "1", gain = 0.1 }'),
        (percent, lambda x: x, '"wheel.FR.u_applied" = { column = "c", unit = "1", gain = 1.0 }'),
        (percent, lambda x: 50.0 * x, '"wheel.FR.u_applied" = { column = "c", unit = "1", gain = 0.02 }'),
    ],
)
def test_a_factor_that_all_positions_share_is_a_unit(
    command: Callable[[Array], Array], position: Callable[[Array], Array], line: str
) -> None:
    found = doubt(command, position)
    assert found is not None
    assert line.replace(", gain = 1.0", "") in found.act.replace(", gain = 1.0", "")


def test_a_valve_that_fails_beside_a_wrong_unit_hides_it_not() -> None:
    found = doubt(percent, volts, lost={"FR": 0.6})
    assert found is not None
    assert "most valves" in found.text


def test_a_loss_of_all_valves_alike_is_not_told_from_a_unit() -> None:
    assert doubt(percent, percent, lost=dict.fromkeys(MACHINE.wheels, 0.4)) is not None


def test_percent_that_stop_at_ten_are_volts() -> None:
    found = doubt(lambda x: np.clip(20.0 * x, -10.0, 10.0))
    assert found is not None
    assert 'unit = "1", gain = 0.1' in found.act
    assert doubt(lambda x: np.clip(0.2 * x, -0.1, 0.1), unit="1") is None  # somebody says that it is so


@pytest.mark.parametrize(
    ("command", "scale"),
    [
        (lambda x: 5.0 + 5.0 * x, "gain = 0.2, offset = -1.0"),
        (lambda x: 12.0 + 8.0 * x, "gain = 0.125, offset = -1.5"),
        (lambda x: 50.0 + 50.0 * x, "give the unit"),
    ],
)
def test_valves_that_rest_open_have_another_zero(command: Callable[[Array], Array], scale: str) -> None:
    found = doubt(command)
    assert found is not None
    assert scale in found.act


@pytest.mark.parametrize("unit", ["% or V", "% or mA"])
def test_a_unit_that_the_machine_file_leaves_open_is_asked(unit: str) -> None:
    found = doubt(volts, volts, unit)
    assert found is not None
    assert unit in found.text
    assert 'unit = "1", gain = 0.' in found.act


@pytest.mark.parametrize(("scale", "volts"), [(1.5, True), (10.0, True), (15.0, False), (100.0, False)])
def test_openings_without_a_unit_that_go_beyond_full_opening_are_no_fractions(scale: float, volts: bool) -> None:
    found = doubt(lambda x: scale * x, unit="")
    assert found is not None
    assert "No unit is stated for wheel.FR.u, wheel.FL.u and 2 more" in found.text
    assert '"wheel.FR.u" = { column = "c", unit = "%" }' in found.act
    assert ("gain = 0.1 }" in found.act) == volts


def test_fractions_and_one_valve_beyond_them_are_no_question() -> None:
    assert doubt(lambda x: 1.05 * x, unit="") is None
    assert doubt(lambda x: x, lambda x: 1.05 * x, unit="") is None
    assert doubt(lambda x: 1.5 * x, unit="1") is None  # as the machine file says
