"""An axle that stands still for a while whenever its command begins, and follows it later, is late; one that does nothing for a time is not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.clearing.cells import Cells
from diagnosis.decision.late_axles import as_late_axles, lags_of
from diagnosis.estimation.one_delay import late_s
from diagnosis.results.assessment import Finding
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

DT, N, WIDTH, LATE_S = 0.1, 800, 10, 0.6
FOUND = Finding(
    2800, 6600, Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL, 0.608,
    (Hypothesis("sensor_or_actuator", "no_signal", 0.608),), Epsilon(1.0, 0.6, 1.0), None, ("It stands still.",), Tier.MODEL,
)  # fmt: skip


def opening(seed: int) -> NDArray[np.float64]:
    """Commands of a valve that come and go."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.choice([0.0, 0.0, 0.3, -0.3, 0.5, -0.5], N // 8), 8)


def mission(late: bool) -> Cells:
    u = np.column_stack([opening(1), opening(2)])
    rate = 0.4 * np.roll(u, 1, axis=0)
    if late:
        rate[200:, 1] = 0.4 * u[200 - round(LATE_S / DT) - 1 : N - round(LATE_S / DT) - 1, 1]
    else:
        rate[300:360, 1] = 0.0
    phi = np.cumsum(rate, axis=0) * DT
    kinds = {"phi": phi, "u": u, "u_applied": np.full_like(u, np.nan)}
    return cast(
        "Cells",
        SimpleNamespace(
            dt=DT, width=WIDTH, machine=SimpleNamespace(axles=("front", "rear")), axles=kinds.__getitem__,
            timeline=SimpleNamespace(size=N * WIDTH),
        ),
    )  # fmt: skip


def test_an_axle_that_follows_its_command_later_is_late() -> None:
    told = as_late_axles({"rear": FOUND}, mission(late=True), HYDRAULIC)["rear"]
    assert told.mode is FaultMode.OUTSIDE_TABLE
    assert told.side is Side.SENSOR_OR_ACTUATOR
    assert late_s(told) == pytest.approx(LATE_S, abs=DT)
    assert told.start <= FOUND.start
    assert sum(h.p for h in told.hypotheses) == pytest.approx(1.0)


def test_an_axle_that_does_nothing_for_a_time_is_not_late() -> None:
    assert as_late_axles({"rear": FOUND}, mission(late=False), HYDRAULIC)["rear"] is FOUND
    assert as_late_axles({"FL": FOUND}, mission(late=True), HYDRAULIC)["FL"] is FOUND


def test_lags_are_not_known_where_nothing_is_steered() -> None:
    still = lags_of(np.zeros(N), np.zeros(N), DT)
    assert np.isnan(still.lag).all()
    u = opening(3)
    followed = lags_of(np.roll(u, 4), u, DT)
    assert np.nanmedian(followed.lag) == pytest.approx(0.4)
