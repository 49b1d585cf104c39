"""The table of canonical signals says everything of a signal once."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest

from replay.errors import ConfigError
from replay.machine.config import haulotte
from replay.machine.quantities import SI_UNITS, UNITS
from replay.machine.signal_table import CANONICAL, Scope, find_signal, known_names, names_of, signal_of


def test_names_in_reading_order() -> None:
    assert names_of(("L", "R"), ("front",)) == (
        *("cmd.v", "cmd.omega", "cmd.lateral"),
        *(
            f"wheel.L.{x}"
            for x in (
                "v_ref",
                "v",
                "v_true",
                "v_position",
                "u",
                "u_applied",
                "effort",
                "psi",
                "pressure_a",
                "pressure_b",
            )
        ),
        *(
            f"wheel.R.{x}"
            for x in (
                "v_ref",
                "v",
                "v_true",
                "v_position",
                "u",
                "u_applied",
                "effort",
                "psi",
                "pressure_a",
                "pressure_b",
            )
        ),
        *(f"steer.front.{x}" for x in ("phi_ref", "phi", "phi_true", "u", "u_applied")),
        *(
            "imu.yaw_rate",
            "imu.acceleration",
            "gnss.lat",
            "gnss.lon",
            "gnss.speed",
            "odom.x",
            "odom.y",
            "odom.yaw",
            "odom.v",
        ),
    )


def test_every_name_of_a_machine_leads_to_one_entry_and_none_is_left() -> None:
    found = [signal_of(name) for name in haulotte().canonical_signals()]
    assert set(found) == set(CANONICAL)
    assert len({entry.kind for entry in CANONICAL}) == len(CANONICAL)
    assert all(entry.words for entry in CANONICAL)


@pytest.mark.parametrize(
    ("name", "unit", "shown"),
    [
        ("cmd.v", "m/s", "m/s"),
        ("wheel.FR.v_true", "m/s", "m/s"),
        ("wheel.FR.u", "1", "of full opening"),
        ("steer.rear.u_applied", "1", "of full opening"),
        ("steer.rear.phi", "rad", "rad"),
        ("wheel.FR.pressure_b", "Pa", "Pa"),
        ("gnss.lat", "deg", "deg"),
        ("gnss.speed", "m/s", "m/s"),
        ("odom.y", "m", "m"),
        ("odom.yaw", "rad", "rad"),
        ("imu.yaw_rate", "rad/s", "rad/s"),
        ("imu.acceleration", "m/s^2", "m/s^2"),
    ],
)
def test_units(name: str, unit: str, shown: str) -> None:
    assert (signal_of(name).unit, signal_of(name).shown_unit) == (unit, shown)


def test_every_quantity_has_one_unit_of_factor_one() -> None:
    assert {UNITS[unit] for quantity, unit in SI_UNITS.items() if quantity != "position_deg"} == {
        (quantity, 1.0) for quantity, _ in UNITS.values()
    }


@pytest.mark.parametrize(
    "name", ["", "v", "wheel.v", "wheel..v", "wheel.FR.speed", "steer.front.psi", "cmd.a.v", "imu.x.yaw_rate", "odom."]
)
def test_a_name_that_is_not_in_the_table_is_none(name: str) -> None:
    assert find_signal(name) is None
    with pytest.raises(ConfigError, match="not a known signal"):
        signal_of(name)


def test_the_refusal_names_every_group() -> None:
    assert known_names()[0] == "cmd.v|omega|lateral"
    assert known_names()[2] == "steer.<A>.phi_ref|phi|phi_true|u|u_applied"
    with pytest.raises(ConfigError, match=r"wheel\.<W>\.v_ref\|v\|.* or odom\.x\|y\|yaw\|v$"):
        signal_of("odom.z")


def test_ranks_and_orders_are_clear() -> None:
    ranks = sorted(entry.clock_rank for entry in CANONICAL if entry.clock_rank is not None)
    assert all(a < b for a, b in pairwise(ranks))
    for scope in Scope:
        orders = sorted(entry.named.order for entry in CANONICAL if entry.scope == scope and entry.named)
        assert all(a < b for a, b in pairwise(orders)), scope


def test_patterns_are_regular_expressions_that_fit_something() -> None:
    for entry in CANONICAL:
        assert entry.named is None or re.compile(entry.named.pattern).search("") is None, entry.kind
