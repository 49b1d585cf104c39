"""A silent speed lasts until its reading comes back."""

from __future__ import annotations

import numpy as np

from diagnosis.response.spells import Spell, until_back
from replay.faults import FaultMode


def test_a_dead_reading_lasts_up_to_the_last_expected_motion_before_it_comes_back() -> None:
    dead, asked = np.zeros(400, np.bool_), np.ones(400, np.bool_)
    dead[176:392] = True
    asked[196:300] = asked[390:] = False  # the machine pauses in between, and parks
    silent, other = Spell(176, 196, FaultMode.NO_SIGNAL, 0.9), Spell(20, 40, FaultMode.NOISY, 0.9)
    assert [(s.start, s.stop) for s in until_back([other, silent], dead, asked)] == [(20, 40), (176, 390)]
    asked[196:] = False
    assert until_back([silent], dead, asked) == [silent]
