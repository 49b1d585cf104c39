"""What if it were another fault, in Chromium: the page's equations against the program's, and what the sliders change."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from replay.faults import FaultMode, FaultSpec, Side, fault_affected
from replay.injection.edited_signals import strength
from replay.injection.valve import _opened
from replay.machine.plant import WheelPlant

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]


def test_equations_are_those_of_the_program(open_page: OPEN) -> None:
    page = open_page("five_faults")
    page.evaluate("Data.later()")
    rng = np.random.default_rng(3)
    n, dt = 2000, 0.01
    t = np.arange(n) * dt
    u = 0.5 * np.sin(t) + 0.02 * rng.standard_normal(n)
    fault = FaultSpec("FR", Side.ACTUATOR, FaultMode.INEFFICIENT, 4.0, 9.0, epsilon=0.4, sat=0.1)
    plant = WheelPlant(0.8, 0.3, dead=0.05)
    epsilon = strength(fault, t)
    applied = fault_affected(u, epsilon, np.full(n, 0.1))
    a = float(np.exp(-dt / plant.tau))
    speed = plant.K * lfilter([0.0, 1.0 - a], [1.0, -a], _opened(applied, plant) - _opened(u, plant))
    found = page.evaluate(
        """([u, n, dt]) => {
          const eps = WhatIf.strength(n, 0, dt, { start: 4, stop: 9, epsilon: 0.4 }), y = Float64Array.from(u);
          const given = WhatIf.affected(y, eps, new Float64Array(n).fill(0.1));
          return [eps, given, WhatIf.respond(y, given, { K: 0.8, tau: 0.3, dead: 0.05 }, dt)].map((v) => Array.from(v)); }""",
        [u.tolist(), n, dt],
    )
    for mine, theirs in zip(found, (epsilon, applied, speed), strict=True):
        assert np.allclose(mine, theirs, rtol=1e-9, atol=1e-12)


def test_the_wheel_model_is_found_again(open_page: OPEN) -> None:
    page = open_page("five_faults")
    page.evaluate("Data.later()")
    t = np.arange(6000) * 0.01
    u = 0.4 * np.sin(0.7 * t) + 0.3 * np.sign(np.sin(0.31 * t))
    plant = WheelPlant(0.8, 0.3, dead=0.04)
    a = float(np.exp(-0.01 / plant.tau))
    v = plant.K * lfilter([0.0, 1.0 - a], [1.0, -a], _opened(u, plant))
    v = v + 0.005 * np.random.default_rng(1).standard_normal(len(t))
    fit = page.evaluate(
        "([u, v]) => WhatIf.fit(Float64Array.from(u), Float64Array.from(v), u.map(() => 1), 0.01)",
        [u.tolist(), v.tolist()],
    )
    assert fit["dead"] == 0.04
    assert fit["K"] == pytest.approx(0.8, rel=0.02)
    assert fit["tau"] == pytest.approx(0.3, rel=0.15)
    assert fit["explains"] > 0.99


def test_sliders_change_residual_and_evidence(open_page: OPEN) -> None:
    page = open_page("five_faults", "#fault=F1&t=27,39")
    page.keyboard.press("w")
    words = page.locator("#whatif-words")
    expect(words).to_contain_text(
        re.compile(r"What if: residual [\d.]+ m/s r\.m\.s\., beyond its threshold .*, first at 0:[\d.]+, ")
    )
    page.locator("#whatif-figure .main-svg").first.wait_for()
    times = re.compile(r"What if: residual ([\d.]+) m/s r\.m\.s\..* Log: ([\d.]+) m/s r\.m\.s\.")
    found = times.search(words.inner_text())
    assert found
    # the log's residual passes its threshold at one time, whoever says so
    page.get_by_role("button", name="Play").click()
    at = re.search(r"Log: .*, first at ([\d.:]+), ", words.inner_text())
    assert at
    expect(page.locator("#events")).to_contain_text(f"{at[1]} · FR speed sensor: the residual, ")
    page.get_by_role("button", name="Pause").click()
    assert float(found[1]) == pytest.approx(float(found[2]), rel=0.15)  # as it was diagnosed, it is as it was recorded
    page.locator("#whatif-mode").select_option("inefficient")
    page.locator("#whatif-epsilon").fill("0.2")
    page.locator("#whatif-onset").fill("32")
    expect(page.locator("#whatif-onset + output")).to_have_text(re.compile(r"^0:3[12]\.\d{3}$"))
    inefficient = times.search(words.inner_text())
    assert inefficient
    assert float(inefficient[1]) < float(found[1])
    expect(page.locator("#whatif-sat")).to_be_disabled()
    page.get_by_role("button", name="As diagnosed").click()
    expect(page.locator("#whatif-mode")).to_have_value("stuck")


def test_a_valve_moves_the_wheel(open_page: OPEN) -> None:
    page = open_page("five_faults", "#fault=F2")
    page.keyboard.press("w")
    expect(page.locator("#whatif-words")).to_contain_text("Wheel model found here: K = ")
    expect(page.locator("#whatif-figure")).to_contain_text("Change of the wheel’s speed")


def test_a_residual_that_is_drawn_is_not_denied_and_the_onset_is_the_faults_own(open_page: OPEN) -> None:
    """Where no model of the part is found, its residual is named as the panel above, and nothing is rounded by the sliders' steps."""
    page = open_page("five_faults", "#fault=F1")
    page.keyboard.press("w")
    expect(page.locator("#whatif-onset + output")).to_have_text(re.compile(r"^\d"))
    onset, stated = page.evaluate(
        "[+document.querySelector('#whatif-onset').value, Data.view.faults.find((f) => f.id === 'F1').start]"
    )
    assert onset == stated
    words = page.evaluate(
        """() => { const one = Float64Array.of(1), d = { sensor: false, runit: "°", channel: { name: "steer.rear.u" }, residual: one };
          return [WhatIf.words(d, { ratio: null }), WhatIf.words({ ...d, residual: null }, { ratio: null })]; }"""
    )
    assert words[0].startswith(
        "What a changed opening does to the residual of this part (°, drawn above) is not computed here"
    )
    assert words[1] == "No residual of this part was recorded in which the change could be seen."


def test_readings_of_a_slow_channel_are_beyond_a_threshold_on_end(open_page: OPEN) -> None:
    """A residual that is known in one of five rows passed its threshold fifteen times over and was *never beyond it*."""
    page = open_page("five_faults")
    page.evaluate("Data.later()")
    found = page.evaluate(
        """() => { const y = Float64Array.from({ length: 100 }, (_, i) => (i % 5 ? NaN : i >= 20 && i < 60 ? 15 : 0.1));
          const d = { y, t: 1, dt: 0.01, stride: 1 }, of = (v) => Replay.stretches({ ...d, y: v }, (i) => Replay.over(Math.abs(v[i]), 1)).map((s) => [s.start, s.stop]);
          return [of(y), of(y.map((v, i) => (i === 40 ? v : Math.min(v, 0.1)))), of(Float64Array.from(y, () => NaN))]; }"""
    )
    assert np.allclose(found[0], [[1.2, 1.55]])
    assert found[1:] == [[], []]


def test_a_residual_that_passes_its_threshold_now_and_then_is_said_to_be_so(open_page: OPEN) -> None:
    """A mean below the threshold and a time beyond it are no contradiction where it says how long."""
    page = open_page("five_faults", "#fault=F1")
    page.keyboard.press("w")
    expect(page.locator("#whatif-words")).to_contain_text("What if")
    words = page.evaluate(
        """() => { const residual = Float64Array.from({ length: 100 }, (_, i) => (i >= 40 && i < 50 ? 1.2 : 0.1));
          const d = { f: { start: 0, stop: 1, detected: null }, n: 100, t: 0, dt: 0.01, stride: 1, rk: 1, runit: "m/s", residual, threshold: new Float64Array(100).fill(1), passes: { start: 0.4, stop: 0.49 }, channel: { name: "" } };
          return WhatIf.words(d, { ratio: residual, residual, spec: { start: 0, stop: 1 } }); }"""
    )
    assert (
        "Log: 0.391 m/s r.m.s., beyond its threshold in 10 % of the fault, first at 0:00.400, 400 ms after the onset."
        in words
    )
