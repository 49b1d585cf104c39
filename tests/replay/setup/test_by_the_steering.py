"""Track and wheelbase by the speeds and angles of steered wheels beside the yaw rate."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.log.source_options import SignalSource
from replay.machine.geometry import WheelGeometry
from replay.setup.by_the_steering import lengths_by_yaw
from replay.signals.signal import Signal, Signals

TRACK, BASE, RADIUS = 2.2, 2.9, 0.55
STAMPS = 1_700_000_000 * 10**9 + np.arange(3000, dtype=np.int64) * 2 * 10**7
GUESSED = {
    w: WheelGeometry(x, y, 0.0, f"{w}_steer")
    for w, x, y in (("FR", 0.25, -0.25), ("FL", 0.25, 0.25), ("RR", -0.25, -0.25), ("RL", -0.25, 0.25))
}


def machine(unit: str, sign: float = 1.0, noise: float = 0.01) -> Signals:
    """Four wheels that steer by themselves; turns and sideways motion differ."""
    rng, t = np.random.default_rng(5), np.arange(STAMPS.size) * 0.02
    vx, vy, yaw = 1.5 + 0.8 * np.sin(0.2 * t), 0.3 * np.sin(0.13 * t), 0.4 * np.sin(0.37 * t)
    items: dict[str, NDArray[np.float64]] = {"imu.yaw_rate": yaw}
    for w, p in GUESSED.items():
        x, y = np.sign(p.x) * BASE / 2, np.sign(p.y) * TRACK / 2
        along, across = vx - yaw * y, vy + yaw * x
        items[f"wheel.{w}.v"] = np.hypot(along, across) / (RADIUS if unit == "rad/s" else 1.0)
        items[f"steer.{w}_steer.phi"] = sign * np.arctan2(across, along)
    out = {}
    for name, values in items.items():
        source = SignalSource(topic="/t", field=name, unit=unit if name.endswith(".v") else "rad")
        noisy = values + noise * rng.normal(size=values.size)
        out[name] = Signal(name, STAMPS, noisy, source, "log", guessed=True)
    return Signals(out, {}, ())


@pytest.mark.parametrize("unit", ["", "m/s", "rad/s"])
def test_lengths_of_a_machine_whose_wheels_steer_by_themselves(unit: str) -> None:
    found = lengths_by_yaw(machine(unit), GUESSED, RADIUS, {})
    assert found.track is not None
    assert found.base is not None
    assert found.track.length == pytest.approx(TRACK, rel=0.03)
    assert found.base.length == pytest.approx(BASE, rel=0.03)


def test_angles_against_the_turns_give_a_negative_wheelbase() -> None:
    found = lengths_by_yaw(machine("m/s", sign=-1.0), GUESSED, RADIUS, {})
    assert found.base is not None
    assert found.base.length == pytest.approx(-BASE, rel=0.03)


def test_nothing_is_told_by_noise_or_with_a_wheel_less() -> None:
    noisy = lengths_by_yaw(machine("m/s", noise=1.0), GUESSED, RADIUS, {})
    assert (noisy.track, noisy.base) == (None, None)
    some = machine("m/s")
    less = Signals({n: s for n, s in some.items.items() if n != "wheel.RL.v"}, {}, ())
    assert lengths_by_yaw(less, GUESSED, RADIUS, {}).track is None
