"""Faults as words."""

from __future__ import annotations

import math

import pytest

from diagnosis.api.fault_words import parse_fault
from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec, Side


def test_a_stuck_part_holds_its_value_at_onset_unless_given() -> None:
    fault = parse_fault("FR sensor stuck 30 37")
    assert (fault.component, fault.side, fault.mode) == ("FR", Side.SENSOR, FaultMode.STUCK)
    assert (fault.start_s, fault.stop_s, fault.epsilon) == (30.0, 37.0, 1.0)
    assert math.isnan(fault.sat)
    assert parse_fault("FR sensor stuck 30 37 sat=-0.2").sat == -0.2


def test_every_value_can_be_given() -> None:
    assert parse_fault("eps=0.3 front actuator Noisy 1.5 2e1 sat=.1 std=0.2 tau=0.5") == FaultSpec(
        "front", Side.ACTUATOR, FaultMode.NOISY, 1.5, 20.0, 0.3, 0.1, 0.2, 0.5
    )


def test_typical_values_lie_in_the_row_of_the_table() -> None:
    assert parse_fault("RL actuator inefficient 1 2").epsilon == 0.5
    assert parse_fault("RL sensor no-signal 1 2") == FaultSpec("RL", Side.SENSOR, FaultMode.NO_SIGNAL, 1, 2)
    for side in ("sensor", "actuator"):
        fault = parse_fault(f"RL {side} noisy 1 2")
        assert 0 < fault.epsilon < 1
        assert fault.sat_std > 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "expected PART SIDE MODE"),
        ("FR sensor stuck 30", "expected PART SIDE MODE"),
        ("FR middle stuck 1 2", "side 'middle'"),
        ("FR sensor broken 1 2", "mode 'broken'"),
        ("FR sensor outside_table 1 2", "mode 'outside_table'"),
        ("FR sensor stuck one 2", "START 'one'"),
        ("FR sensor stuck 1 inf", "STOP 'inf'"),
        ("FR sensor stuck 1 2 power=3", "'power' is not known"),
        ("FR sensor stuck 1 2 sat=", "sat '' is not a number"),
        ("FR sensor stuck 1 2 eps=0.5", "stuck means eps = 1"),
        ("FR sensor stuck 1 2 sat=0", "other than 0"),
        ("FR sensor no_signal 1 2 sat=0.1", "means sat = 0"),
        ("FR sensor inefficient 1 2 eps=1", "between 0 and 1"),
        ("FR sensor noisy 1 2 sat=0 std=0", "noisy needs"),
    ],
)
def test_words_that_say_no_fault(words: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        parse_fault(words)
