"""Whether the signals of two tables go together at the stamps that they have."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.log.source_options import SignalSource
from replay.setup.one_clock import lags
from replay.signals.signal import Signal, Signals

Array = NDArray[np.float64]
START_NS = 1_790_000_000 * 10**9
WHEELS, LEFT = ("FR", "FL"), ("FL",)


def signal(name: str, values: Array, source: str, late_s: float = 0.0, step_s: float = 0.05) -> Signal:
    stamps = START_NS + np.round((np.arange(values.size) * step_s + late_s) * 1e9).astype(np.int64)
    return Signal(name, stamps, values, SignalSource(column=name), source, guessed=True)


def found(*signals: Signal) -> Signals:
    return Signals({s.name: s for s in signals}, {}, ())


def drive(seed: int = 1) -> tuple[Array, Array]:
    """Forward speed and what right wheels are faster than left ones, 120 s at 20 Hz."""
    rng = np.random.default_rng(seed)
    v, w = (np.convolve(rng.uniform(-1, 1, 60).repeat(40), np.ones(30) / 30, "same") for _ in range(2))
    return v, 0.4 * w


@pytest.mark.parametrize("late", [0.0, 2.5, -4.0])
@pytest.mark.parametrize("by", ["imu.yaw_rate", "gnss.speed", "wheel.FL.v_ref"])
def test_a_table_that_is_late_is_told_from_one_that_fits(by: str, late: float) -> None:
    v, w = drive()
    other = {"imu.yaw_rate": w, "gnss.speed": np.abs(v), "wheel.FL.v_ref": v - w}[by]
    told = lags(
        found(signal("wheel.FR.v", v + w, "a"), signal("wheel.FL.v", v - w, "a"), signal(by, other, "b", late)),
        WHEELS, LEFT, ("a", "b"),
    )  # fmt: skip
    assert told["b"].seconds == pytest.approx(late, abs=0.06)
    assert (told["b"].fits, told["b"].apart, told["b"].other) == (late == 0, late != 0, "a")


def test_a_third_table_is_compared_with_one_that_fits() -> None:
    v, w = drive()
    a, b = signal("cmd.v", v, "a"), [signal("wheel.FR.v", v + w, "b"), signal("wheel.FL.v", v - w, "b")]
    told = lags(found(a, *b, signal("imu.yaw_rate", w, "c", 3.0)), WHEELS, LEFT, ("a", "c", "b"))
    assert {s: (t.fits, t.apart, t.other) for s, t in told.items()} == {
        "b": (True, False, "a"),
        "c": (False, True, "b"),
    }


@pytest.mark.parametrize("what", ["constant", "unrelated", "short", "empty", "one frequency"])
def test_what_does_not_tell_says_nothing(what: str) -> None:
    v = drive()[0]
    t = np.arange(v.size) * 0.05
    speed = np.sin(2 * np.pi * t / 90) if what == "one frequency" else v
    other = {
        "constant": np.ones(v.size), "unrelated": drive(7)[0], "short": v[:600], "empty": np.full(v.size, np.nan),
        "one frequency": np.sin(2 * np.pi * (t - 3) / 90) + np.random.default_rng(2).normal(0, 0.3, v.size),
    }[what]  # fmt: skip
    signals = found(signal("wheel.FR.v", speed, "a"), signal("wheel.FR.v_ref", other, "b"))
    assert lags(signals, WHEELS, LEFT, ("a", "b")) == {}
