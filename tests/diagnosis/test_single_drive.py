"""A machine with one motor that does not follow its command: a report without an all-clear, never an error of too little driving."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from diagnosis.pipeline import diagnose
from diagnosis.results.vocabulary import Verdict
from replay.machine.toml_file import load_machine

MACHINE = """
[machine]
wheels = ["M"]
drive = "motor"

[geometry]
max_speed = 3.2
wheel_diameter = 0.11
M = { x = -0.165, y = 0.0, steer = "fixed" }

[control]
law = "none"
"""


@pytest.mark.parametrize("dies_s", [0.0, 20.0])
def test_a_single_motor_that_is_dead_ends_with_a_report(tmp_path: Path, dies_s: float) -> None:
    rng, dt = np.random.default_rng(3), 0.02
    t = np.arange(round(80.0 / dt)) * dt
    asked = np.repeat(rng.choice([0.0, 1.0, 1.5, 2.0, -1.0], 20), t.size // 20)
    speed = np.where(t < dies_s, asked, 0.0)
    v, u = speed + rng.normal(0.0, 0.02, t.size), asked / 4.0 + rng.normal(0.0, 0.01, t.size)
    rows = np.column_stack([t, asked, v, u])
    log, machine = tmp_path / "dead.csv", tmp_path / "machine.toml"
    np.savetxt(log, rows, delimiter=",", header="t,cmd.v,wheel.M.v,wheel.M.u", comments="", fmt="%.5f")
    machine.write_text(MACHINE, encoding="utf-8")
    report = diagnose([log], load_machine(machine)).report
    assert report["verdict"]["status"] != Verdict.READY
    assert not report["verdict"]["cleared"]
    assert report["events"] or report["intervals"]
