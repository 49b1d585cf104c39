"""A machine with two driven wheels: each is the other's measure, of drives that are measured twice and of those that are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing.checks import cells_of, checks_of
from diagnosis.results.clearing import Check
from diagnosis.results.machine_words import HYDRAULIC
from replay.arrays.envelope import bucket_of
from replay.control.loop import replay_loop
from replay.machine.config import haulotte
from replay.signals.timeline import align
from tests.diagnosis.clearing.missions import LENGTH, signals_of, simulated

WHEELS = ("FR", "FL")


def failing(share: float, stop: float = LENGTH, *, base: bool = False) -> set[Check]:
    """Checks that do not pass of a machine whose front right speeds, by all sensors, are a share from the middle until `stop` [s]."""
    one = simulated(seed=5)
    t = (one.stamps - one.stamps[0]) * 1e-9
    behind = np.where((t > LENGTH / 2) & (t < stop), share, 1.0)
    columns = {n: x * behind if n in ("wheel.FR.v", "wheel.FR.v_true") else x for n, x in one.columns.items()}
    columns = {n: x for n, x in columns.items() if not n.startswith(("wheel.RR", "wheel.RL", "steer."))}
    machine = replace(haulotte(), wheels=WHEELS, geometry=None)
    timeline = align(signals_of(replace(one, columns=columns), base=base))
    cells = cells_of(timeline, replay_loop(timeline, machine, bucket_of(timeline.size)), machine)
    return {c.check for c in checks_of(cells, HYDRAULIC) if not c.passed}


@pytest.mark.parametrize(("share", "found"), [(1.0, False), (0.5, True)])
def test_what_lies_behind_one_of_two_drives_shows_beside_the_other(share: float, *, found: bool) -> None:
    assert bool(failing(share) & {Check.RESPONSE, Check.LASTING_RESPONSE, Check.CHANGE}) is found


def test_ten_seconds_of_it_show_in_windows() -> None:
    assert Check.RESPONSE in failing(0.65, LENGTH / 2 + 10.0)


def test_six_seconds_of_it_show_without_second_measurements() -> None:
    assert Check.RESPONSE in failing(0.65, LENGTH / 2 + 6.0, base=True)
    assert not failing(1.0, base=True) & {Check.RESPONSE, Check.EXCESS, Check.CHANGE}
