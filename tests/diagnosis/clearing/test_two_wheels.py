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


def failing(share: float, stop: float = LENGTH, *, base: bool = False, more: float = 0.0) -> set[Check]:
    """Checks that do not pass of a machine whose front right wheel changes from the middle until `stop` [s].

    Its speeds, by all sensors, are a share of what they were, and its openings are more by so much of full opening.
    """
    one = simulated(seed=5)
    t = (one.stamps - one.stamps[0]) * 1e-9
    late = (t > LENGTH / 2) & (t < stop)
    behind = np.where(late, share, 1.0)
    columns = {n: x * behind if n in ("wheel.FR.v", "wheel.FR.v_true") else x for n, x in one.columns.items()}
    moves = np.sign(one.columns["wheel.FR.u"]) * (np.abs(one.columns["wheel.FR.u"]) > 0.05)
    columns |= {n: columns[n] + more * moves * late for n in ("wheel.FR.u", "wheel.FR.u_applied")}
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


@pytest.mark.parametrize("base", [True, False])
def test_a_brake_that_drags_for_six_seconds_shows_by_the_opening_that_its_wheel_needs(*, base: bool) -> None:
    assert Check.OPENING_OFFSET in failing(1.0, LENGTH / 2 + 6.0, base=base, more=0.15)
    assert Check.OPENING_OFFSET not in failing(1.0, base=base)
