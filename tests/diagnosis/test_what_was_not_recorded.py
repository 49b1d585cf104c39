"""A mission of which much was not recorded, or whose log names more wheels than the machine has, clears nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.pipeline import diagnose_signals
from replay.faults import FaultMode, FaultSpec, Side
from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.other_wheels import other_wheels
from replay.signals.signal import Signals
from tests.diagnosis.clearing.missions import signals_of, simulated


@pytest.mark.parametrize(("from_s", "said"), [(20.0, True), (58.0, False)])
def test_a_hole_in_a_log_is_no_time_without_a_fault(from_s: float, *, said: bool) -> None:
    whole = signals_of(simulated(), base=True)
    items = {}
    for name, signal in whole.items.items():
        t = (signal.stamps - signal.stamps[0]) * 1e-9
        kept = (t < from_s) | (t >= 59.0)
        items[name] = replace(signal, stamps=signal.stamps[kept], values=signal.values[kept])
    verdict = diagnose_signals(Signals(items=items, missing={}), haulotte()).report["verdict"]
    assert any("no speed of any wheel was recorded" in text for text in verdict["scope"]) is said
    if said:
        assert not verdict["cleared"]
        assert verdict["to_clear"][0]["act"] == "record another mission, without gaps"


def channels(*wheels: str) -> dict[str, Channel]:
    stamps = np.arange(100, dtype=np.int64) * 10_000_000
    return {n: Channel(n, "", n, stamps, np.sin(np.arange(100.0)), "m/s") for n in (f"{w}_speed" for w in wheels)}


def test_wheels_that_the_machine_does_not_have_are_named() -> None:
    six = channels("FL", "FR", "ML", "MR", "RL", "RR")
    assert other_wheels(six, haulotte()) == ("MR", "ML")
    assert other_wheels(channels("FL", "FR", "RL", "RR"), haulotte()) == ()
    listed = replace(
        haulotte(), signals={"wheel.FR.v": next(iter(signals_of(simulated(), base=True).items.values())).origin}
    )
    assert other_wheels(six, listed) == ()


def test_a_log_of_more_wheels_clears_no_machine_of_four() -> None:
    signals = replace(signals_of(simulated(), base=False), other_wheels=("MR", "ML"))
    verdict = diagnose_signals(signals, haulotte()).report["verdict"]
    assert "the log names 2 more wheels than this machine has (MR, ML), which were not judged" in verdict["scope"]
    assert not verdict["cleared"]


def test_of_a_machine_that_stands_in_for_one_with_other_wheels_no_model_holds() -> None:
    fault = FaultSpec("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL, 20.0, 32.0, 1.0, 0.0)
    signals = replace(signals_of(simulated(fault), base=True), other_wheels=("MR", "ML"))
    stands_in = diagnose_signals(signals, haulotte()).report["intervals"]
    known = diagnose_signals(signals, replace(haulotte(), assumed=())).report["intervals"]
    assert {i["tier"] for i in stands_in} <= {"direct", "signal"}
    assert "model" in {i["tier"] for i in known}


@pytest.mark.parametrize("asked", ["which wheels are left_3_speed, right_3_speed?", "which wheel is rear_speed?"])
def test_a_machine_file_that_still_asks_for_wheels_clears_nothing(asked: str) -> None:
    machine = replace(haulotte(), questions=("How fast can it go?", asked))
    verdict = diagnose_signals(signals_of(simulated(), base=False), machine).report["verdict"]
    assert not verdict["cleared"]
    assert f"the machine file still asks {asked[:-1]}: not judged" in verdict["scope"]


def test_numbered_wheels_beyond_the_machine_s_are_named_without_a_machine_file() -> None:
    six = channels("w1", "w2", "w3", "w4", "w5", "w6")
    taken = {f"wheel.{w}.v": SignalSource(column=f"w{i + 1}_speed") for i, w in enumerate(haulotte().wheels)}
    assert other_wheels(six, haulotte(), taken) == ("w5_speed", "w6_speed")
