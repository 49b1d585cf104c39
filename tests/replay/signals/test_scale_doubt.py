from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.scale_doubt import scale_doubt
from replay.signals.signal import Signal

STAMPS = np.arange(1000, dtype=np.int64) * 20_000_000
COMMAND = np.repeat(np.random.default_rng(1).uniform(-0.3, 0.3, 20), 50)
MACHINE = haulotte()


def signals(scale: float, follow: bool = True) -> dict[str, Signal]:
    moved = COMMAND if follow else np.random.default_rng(2).normal(0.0, 0.2, 1000)
    wheels = {f"wheel.{w}.v": scale * moved for w in MACHINE.wheels}
    return {
        n: Signal(n, STAMPS, v, SignalSource(), "run.mcap", False, "") for n, v in {"cmd.v": COMMAND, **wheels}.items()
    }


@pytest.mark.parametrize(
    ("scale", "words"), [(1 / 24, "24 times slower than it commands"), (17.7, "17.7 times as fast as")]
)
def test_a_scale_that_all_wheels_share_is_asked_about(scale: float, words: str) -> None:
    assert words in scale_doubt(signals(scale), MACHINE)


@pytest.mark.parametrize("scale", [1.0, 0.5, 2.0])
def test_plausible_scales_are_not(scale: float) -> None:
    assert scale_doubt(signals(scale), MACHINE) == ""


def test_drives_that_do_not_follow_are_no_question_of_scale() -> None:
    assert scale_doubt(signals(0.01, follow=False), MACHINE) == ""
    assert scale_doubt(signals(0.0), MACHINE) == ""


def test_one_weak_wheel_is_none_either() -> None:
    found = signals(1.0)
    found["wheel.FR.v"] = replace(found["wheel.FR.v"], values=0.02 * COMMAND)
    assert scale_doubt(found, MACHINE) == ""


def test_without_a_command_nothing_is_compared() -> None:
    assert scale_doubt({n: s for n, s in signals(0.01).items() if n != "cmd.v"}, MACHINE) == ""
