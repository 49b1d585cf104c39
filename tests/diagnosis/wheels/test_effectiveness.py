"""Speed per opening against the other wheels: a valve's loss shows, what all wheels share and turning do not."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.lag import low_passed
from diagnosis.results.loss import Loss
from diagnosis.wheels.effectiveness import relative_losses

DT, N, TAU = 0.01, 12_000, 0.25
Array = np.ndarray


def losses(loss: float = 0.0, *, common: float = 1.0, turn: float = 0.0, usable: Array | None = None) -> list[Loss]:
    """Four wheels, of which the second loses gain; both directions are driven, and turned in."""
    rng = np.random.default_rng(3)
    t = np.arange(N) * DT
    gains = common * np.array([2.4, 2.4 * (1 - loss), 2.3, 2.5])
    way = np.sign(np.sin(0.11 * t + 0.3))
    curvature = 0.3 * np.sin(0.5 * t)
    opening = way[:, None] * 0.1 * (1 + 0.2 * np.sin(0.3 * t))[:, None] * np.ones(4)
    side = np.array([1.0, -1.0, 1.0, -1.0])
    ratio = 1.0 + 0.73 * curvature[:, None] * side
    fed = np.column_stack([low_passed(u, TAU, DT) for u in opening.T])
    y = fed * gains * (1.0 + turn * curvature[:, None] * side) + 0.002 * rng.normal(size=(N, 4))
    found = relative_losses(y, opening, ratio, np.ones(N, np.bool_) if usable is None else usable, TAU, 0.05, DT)
    assert all(f is not None and f.relative for f in found)
    return [f for f in found if f is not None]


@pytest.mark.parametrize("loss", [0.05, 0.15, 0.4])
def test_a_valves_loss_is_the_change_of_its_own_figure(loss: float) -> None:
    before, after = losses(), losses(loss)
    changes = [1 - (1 - b.epsilon.value) / (1 - a.epsilon.value) for a, b in zip(before, after, strict=True)]
    assert changes[1] == pytest.approx(loss, abs=0.03)
    assert np.abs(np.delete(changes, 1)).max() < 0.03


def test_what_all_wheels_share_changes_nothing() -> None:
    values = [[f.epsilon.value for f in losses(common=c)] for c in (1.0, 0.9)]
    assert values[0] == pytest.approx(values[1], abs=0.005)


def test_turning_is_no_loss() -> None:
    values = [[f.epsilon.value for f in losses(turn=x)] for x in (0.0, 0.3)]
    assert values[0] == pytest.approx(values[1], abs=0.01)


def test_too_little_driving_and_too_few_wheels_give_nothing() -> None:
    usable = np.zeros(N, np.bool_)
    usable[:500] = True
    y = np.full((N, 4), 0.2)
    assert relative_losses(y, y, y, usable, TAU, 0.05, DT) == [None] * 4
    assert relative_losses(y[:, :2], y[:, :2], y[:, :2], ~usable, TAU, 0.05, DT) == [None] * 2
