"""What contradicts itself is refused, and a wheel is called odd only where the others agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.fitting import geometry
from diagnosis.fitting.plants import _blamed_on_the_model, _without_odd_wheels, _without_unsure_wheels
from diagnosis.fitting.robust import Estimate
from diagnosis.fitting.wheels import WheelFit
from replay.machine.config import haulotte
from replay.signals.timeline import Timeline

NONE = Estimate(float("nan"), float("nan"))
OTHER = Estimate(0.0, 0.001)


def wheel(K: float, std: float, left: float = 0.0, refused: str = "") -> WheelFit:
    empty = np.empty(0)
    fit = WheelFit(Estimate(K, std), OTHER, OTHER, OTHER, empty, empty.astype(np.int64), 40, (0,), ())
    return replace(fit, left_share=left, refused=refused)


def odd(*gains: tuple[float, float]) -> list[bool]:
    found = _without_odd_wheels([wheel(*g) for g in gains])
    return [f is not None and bool(f.refused) for f in found]


def test_a_wheel_surely_unlike_the_others_is_odd() -> None:
    assert odd((2.4, 0.05), (2.5, 0.05), (1.5, 0.05), (2.45, 0.05)) == [False, False, True, False]


def test_a_wheel_that_alone_is_uncertain_is_odd() -> None:
    assert odd((2.4, 0.05), (2.5, 0.05), (1.5, 0.5), (2.45, 0.05)) == [False, False, True, False]


def test_gains_that_all_scatter_name_no_wheel() -> None:
    assert odd((0.88, 0.1), (1.6, 0.2), (3.3, 0.5), (1.65, 0.3)) == [False] * 4


def test_uncertain_gains_are_refused_with_what_was_seen() -> None:
    found = _without_unsure_wheels([wheel(5.2, 4.1), wheel(2.0, 0.1), wheel(2.0, float("nan"))])
    assert [f.refused if f else "" for f in found] == [
        "too uncertain: a gain of 5.2 ± 4.1 m/s per full opening",
        "",
        "too uncertain: a gain of 2 ± nan m/s per full opening",
    ]


def test_contradicting_windows_of_all_wheels_are_blamed_on_the_model() -> None:
    bad = wheel(1.0, 0.1, left=0.45, refused="45 % of its 40 steady windows disagree: it may have been faulty")
    alike = _blamed_on_the_model([bad, *(wheel(2.0, 0.1, left=0.2) for _ in range(3))])[0]
    alone = _blamed_on_the_model([bad, *(wheel(2.0, 0.1, left=0.02) for _ in range(3))])[0]
    assert alike is not None
    assert alone is not None
    assert "no map from opening to speed holds" in alike.refused
    assert "faulty" in alone.refused


@pytest.mark.parametrize(("steering", "turning"), [(0.0, 0.25), (0.3, 0.05)])
def test_an_offset_that_two_methods_contradict_is_refused(
    monkeypatch: pytest.MonkeyPatch, steering: float, turning: float
) -> None:
    offset, why = fitted(monkeypatch, steering, turning)
    assert np.isnan(offset)
    assert "contradict each other" in why


@pytest.mark.parametrize(("steering", "turning"), [(0.2, 0.25), (0.19, 0.30), (0.0, 0.05)])
def test_slip_in_held_turns_is_no_contradiction(
    monkeypatch: pytest.MonkeyPatch, steering: float, turning: float
) -> None:
    assert fitted(monkeypatch, steering, turning)[0] == pytest.approx(steering, abs=0.01)


def fitted(monkeypatch: pytest.MonkeyPatch, steering: float, turning: float) -> tuple[float, str]:
    """Offset fitted to blocks in which it shows as given in steering movements and in held turns."""
    rng = np.random.default_rng(2)
    levers = 0.2 * rng.normal(size=(200, 4, 2))
    speeds = levers @ [turning, steering] + 0.001 * rng.normal(size=(200, 4))
    stacked = (levers, speeds, np.zeros(200, np.int64), np.arange(200) // 20)
    monkeypatch.setattr(geometry, "_stacked", lambda *_: stacked)
    lines: list[Timeline] = []
    estimate = geometry.fit_offset(lines, haulotte(), set())[0]
    return estimate.value, estimate.why
