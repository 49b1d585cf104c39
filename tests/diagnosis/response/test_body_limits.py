"""A controller that clips the speed of the body makes no drive of one side weak."""

from __future__ import annotations

import numpy as np

from diagnosis.response.assess import assess_response
from diagnosis.response.body_limits import _limited
from diagnosis.results.assessment import Finding
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, TRACK, Array, followers_of, geometry, robot_of, speeds

N = 400
ASKED = 1.5 * np.sin(np.arange(N) / 8.0)


def told(v: Array, turn: Array, *, clip: bool) -> list[Finding]:
    limited = (np.clip(v, -0.6, 0.6), np.clip(turn, -0.4, 0.4)) if clip else (v, turn)
    measured, _, _ = robot_of(*limited, 4)
    asked = {w: v + (0.5 if w.endswith("R") else -0.5) * TRACK * turn for w in measured}
    parts = assess_response(
        followers_of(measured, asked, np.column_stack([v, turn])),
        geometry(),
        (limited[1] + np.random.default_rng(1).normal(0.0, 0.01, v.size)),
        Limits(),
        DT,
    ).parts
    return [f for sides in parts.values() for a in sides for f in a.findings]


def test_a_body_at_its_limit_is_asked_for_more() -> None:
    found = _limited(np.clip(ASKED, -1.0, 1.0), ASKED, 0.25)
    assert found.any()
    assert (np.abs(ASKED[found]) > 0.9).all()


def test_one_that_does_as_it_is_told_is_at_no_limit() -> None:
    assert not _limited(ASKED, ASKED, 0.25).any()


def test_what_is_clipped_is_no_drives_fault() -> None:
    _, _, body = speeds(4)
    assert told(1.3 * body[:, 0], 1.6 * body[:, 1], clip=True) == []
