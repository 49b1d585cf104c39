"""A car of whose wheels only the rear ones have speeds: its steering is asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replay.setup.draft_notes import Draft
from tests.replay.setup.test_unsure_signals import COMMANDS, SIDES, V, drafted

_REAR = {f"rear_{s}_wheel_speed_mps": v for s, v in SIDES.items()}


def _asked(draft: Draft) -> list[str]:
    return [q for q in draft.questions if "does it steer" in q]


def test_steering_without_a_steered_wheel_is_asked_for(tmp_path: Path) -> None:
    angle = 0.3 * np.sin(np.arange(V.size) * 0.01)
    draft = drafted(tmp_path, {**COMMANDS, **_REAR, "steering_angle_deg": angle, "cmd_steering_angle_deg": angle})
    (question,) = _asked(draft)
    assert "cmd_steering_angle_deg, steering_angle_deg" in question
    assert "--preset ackermann" in question


@pytest.mark.parametrize("fronts", [True, False])
def test_no_question_where_it_is_steered_or_nothing_says_so(tmp_path: Path, *, fronts: bool) -> None:
    more = {f"front_{s}_wheel_speed_mps": v for s, v in SIDES.items()} if fronts else {}
    angle = {"steering_angle_deg": 0.3 * np.sin(np.arange(V.size) * 0.01)} if fronts else {}
    assert not _asked(drafted(tmp_path, {**COMMANDS, **_REAR, **more, **angle}))
