"""What as many wheels do as do not, and what ends a dispute, says little of one of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import diagnosis.response.company as company
from diagnosis.response.company import after_a_dispute, in_company
from diagnosis.response.spells import Spell
from replay.faults import FaultMode

BLOCK_S, WIDTH, NUMBER = 0.25, 5, 80


def wheels(seen: dict[str, float], **reads: float) -> dict[str, Any]:
    """Four wheels that read one speed each, held against all others, which have them at `seen`."""
    return {
        w: SimpleNamespace(
            data=SimpleNamespace(name=f"wheel.{w}.v"),
            speed=np.full(NUMBER, seen[w]),
            wheel=SimpleNamespace(
                blocks=SimpleNamespace(start=np.arange(NUMBER) * WIDTH, mean=np.full(NUMBER, y)),
                samples=SimpleNamespace(step=np.arange(NUMBER * WIDTH)),
                jumps=SimpleNamespace(place=np.zeros(0, np.intp)),
                dt=BLOCK_S / WIDTH,
                compared=" and ".join(f"wheel.{o}.v" for o in reads if o != w),
            ),
        )
        for w, y in reads.items()
    }


SPELL = Spell(20, 60, FaultMode.OUTSIDE_TABLE, 0.92)


def test_two_that_are_off_alike_are_no_minority_of_four() -> None:
    alike = wheels({"FR": -2.6, "FL": -2.1, "RR": -5.0, "RL": -2.5}, FR=-3.6, FL=-3.1, RR=-2.6, RL=-2.7)
    assert in_company(SPELL, "FR", alike)
    alone = wheels({"FR": -2.6, "FL": -3.1, "RR": -2.6, "RL": -2.7}, FR=-3.6, FL=-2.7, RR=-2.6, RL=-2.7)
    assert not in_company(SPELL, "FR", alone)
    other_way = wheels({"FR": -2.6, "FL": -4.1, "RR": -2.6, "RL": -2.7}, FR=-3.6, FL=-3.1, RR=-2.6, RL=-2.7)
    assert not in_company(SPELL, "FR", other_way)


@pytest.mark.parametrize(
    ("disputed_s", "length_s", "doubted"), [(5.0, 1.25, True), (1.0, 0.5, False), (3.0, 8.0, False)]
)
def test_a_brief_deviation_that_ends_a_dispute_is_nobodys(
    monkeypatch: pytest.MonkeyPatch, disputed_s: float, length_s: float, doubted: bool
) -> None:
    judged = wheels({"R": 1.0, "L": 1.0}, R=1.0, L=0.4)
    spell = Spell(40, 40 + round(length_s / BLOCK_S), FaultMode.INEFFICIENT, 0.7)

    def disputed(one: Any, block_s: float) -> NDArray[np.bool_]:
        out = np.zeros(NUMBER, np.bool_)
        if one is judged["R"]:
            out[40 - round(disputed_s / block_s) : 40] = True
        return out

    monkeypatch.setattr(company, "disputed", disputed)
    assert after_a_dispute(spell, "L", judged, BLOCK_S) is doubted
    assert not after_a_dispute(spell, "R", judged, BLOCK_S)
