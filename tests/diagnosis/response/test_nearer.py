"""Of two wheels of a side that differ, the one nearer to its command is not named."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.response.nearer import nearer_to_its_command
from diagnosis.response.spells import Spell
from replay.faults import FaultMode

BLOCK_S, WIDTH, NUMBER = 0.25, 5, 80


def side(asked: float, jumps: tuple[int, ...] = (), **reads: float) -> dict[str, Any]:
    """Wheels of one side that are told the same for 20 s; each is held against all others."""
    start = np.arange(NUMBER) * WIDTH
    step = np.arange(NUMBER * WIDTH)
    return {
        w: SimpleNamespace(
            data=SimpleNamespace(name=f"wheel.{w}.v", asked=np.full(step.size, asked)),
            wheel=SimpleNamespace(
                blocks=SimpleNamespace(start=start, mean=np.full(NUMBER, y)),
                samples=SimpleNamespace(step=step),
                jumps=SimpleNamespace(place=np.array(jumps, np.intp)),
                dt=BLOCK_S / WIDTH,
                compared=" and ".join(f"wheel.{o}.v" for o in reads if o != w),
            ),
            speed=np.full(NUMBER, y),
        )
        for w, y in reads.items()
    }


def spell(mode: FaultMode = FaultMode.OUTSIDE_TABLE, *, own: bool = False) -> Spell:
    return Spell(20, 60, mode, 0.97, own)


@pytest.mark.parametrize(("rl", "fl", "held"), [(-0.14, -0.08, True), (-0.08, -0.14, False), (-0.14, -0.15, False)])
def test_the_wheel_that_is_clearly_nearer_to_its_command_is_left_open(rl: float, fl: float, held: bool) -> None:
    judged = side(-0.24, RL=rl, FL=fl)
    assert nearer_to_its_command(spell(), "RL", judged, ("FL",), BLOCK_S) is held


def test_what_shows_by_the_channel_itself_is_left_as_it_is() -> None:
    judged = side(-0.24, RL=-0.14, FL=-0.08)
    assert not nearer_to_its_command(spell(own=True), "RL", judged, ("FL",), BLOCK_S)
    assert not nearer_to_its_command(spell(FaultMode.STUCK), "RL", judged, ("FL",), BLOCK_S)
    assert not nearer_to_its_command(spell(), "RL", side(-0.24, (20 * WIDTH,), RL=-0.14, FL=-0.08), ("FL",), BLOCK_S)


def test_of_three_the_others_must_all_be_further_off() -> None:
    judged = side(-0.24, RL=-0.14, ML=-0.23, FL=-0.08)
    assert not nearer_to_its_command(spell(), "RL", judged, ("ML", "FL"), BLOCK_S)


def test_without_a_command_nothing_is_nearer() -> None:
    judged = side(np.nan, RL=-0.14, FL=-0.08)
    assert not nearer_to_its_command(spell(), "RL", judged, ("FL",), BLOCK_S)
