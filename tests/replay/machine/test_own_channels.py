"""One channel that a machine file gives two measured signals is refused."""

from __future__ import annotations

import pytest

from replay.errors import ConfigError
from replay.log.source_options import SignalSource
from replay.machine.own_channels import check_own_channels


@pytest.mark.parametrize(
    "names",
    [
        ("wheel.FR.v", "wheel.FL.v"),
        ("wheel.FR.v", "wheel.FR.v_true"),
        ("steer.front.phi", "steer.rear.phi"),
        ("wheel.FR.u", "wheel.FR.u_applied"),
    ],
)
def test_one_channel_for_two_measurements_is_refused(names: tuple[str, str]) -> None:
    with pytest.raises(ConfigError, match=r"are both read from v_FR: .* give each its own"):
        check_own_channels(dict.fromkeys(names, SignalSource(column="v_FR")))


def test_commands_and_positions_of_several_parts_may_be_one_channel() -> None:
    shared, other = SignalSource(column="a"), SignalSource(column="b")
    check_own_channels({"wheel.FR.v_ref": shared, "wheel.FL.v_ref": shared, "wheel.FR.v": other})
    check_own_channels({"wheel.FR.u_applied": shared, "wheel.FL.u_applied": shared, "wheel.FR.u": other})
    check_own_channels({"wheel.FR.v": SignalSource(column="a", derivative=True), "wheel.FL.v": shared})
    check_own_channels({"cmd.v": shared, "wheel.FR.v": shared})  # a machine of one drive
