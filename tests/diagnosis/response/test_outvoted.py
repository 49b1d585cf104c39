"""Two wheels of three on a side that come to read too little beside a sound one: nothing tells which, unless the body's turns do."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from diagnosis.results.assessment import Finding
from replay.machine.config import Limits
from replay.machine.geometry import Geometry, WheelGeometry
from tests.diagnosis.response.robot import DT, TRACK, followers_of, speeds

WHEELS = ("FR", "FL", "MR", "ML", "RR", "RL")
PLACES = {
    w: WheelGeometry({"F": 0.5, "M": 0.0, "R": -0.5}[w[0]], -TRACK / 2 if w.endswith("R") else TRACK / 2, 0.0, "fixed")
    for w in WHEELS
}


def found(seed: int, low: tuple[str, ...], high: tuple[str, ...]) -> list[tuple[str, Finding]]:
    """Findings where some wheels come to read 0.93 and others 1.2 times their speed within three seconds, as a loop around either may make it."""
    measured, asked, body = speeds(seed, WHEELS)
    t = np.arange(len(body)) * DT
    grows = np.clip((t - 60.0) / 3.0, 0.0, 1.0) * np.clip((103.0 - t) / 3.0, 0.0, 1.0)
    for wheels, share in ((low, 0.93), (high, 1.2)):
        for w in wheels:
            measured[w] = np.round(measured[w] * (1.0 + (share - 1.0) * grows), 3)
    j = assess_response(
        followers_of(measured, asked, body), Geometry(PLACES, 0.33), None, Limits(driving_speed=0.05), DT
    )
    return [(w, f) for w, sides in j.parts.items() for side in sides for f in side.findings]


@pytest.mark.parametrize("seed", [3, 4])
def test_two_against_one_is_not_sure(seed: int) -> None:
    told = found(seed, ("FR", "MR"), ("RR",))
    quick = [f for w, f in told if w == "RR" and f.epsilon is not None and f.epsilon.value < 0.0]
    assert quick
    assert all(f.probability <= 0.6 for f in quick)
    assert any("Two against one" in text for f in quick for text in f.evidence)
