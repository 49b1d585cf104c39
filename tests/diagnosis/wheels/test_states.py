"""Why a wheel was not judged, where its command is missing."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.results.assessment import CODE, Assessment, Lack
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.states import with_reasons
from replay.faults import State

N, DT = 1000, 0.1


@pytest.mark.parametrize(
    ("spans", "when"),
    [
        ([(0, N)], ""),
        ([(700, N)], ", from 70.0 s on"),
        ([(200, 500)], ", from 20.0 to 50.0 s"),
        ([(200, 300), (600, 650)], ", for 15.0 s"),
    ],
)
def test_a_missing_command_is_told_with_its_time(spans: list[tuple[int, int]], when: str) -> None:
    absent = np.zeros(N, np.bool_)
    for a, b in spans:
        absent[a:b] = True
    for state in (State.NOT_ASSESSED, State.NO_DATA):
        states = np.where(absent, CODE[state], CODE[State.HEALTHY])
        told = with_reasons(Assessment(states, {}, tier=Tier.MODEL), absent, DT, gains=True)
        assert told.reasons[state] == "no {valve} command to compare with" + when
        assert told.lacks[state] is Lack.COMMAND


def test_what_is_open_for_another_reason_does_not_ask_for_the_command() -> None:
    absent = np.zeros(N, np.bool_)
    absent[:100] = True
    states = np.full(N, CODE[State.NOT_ASSESSED])
    told = with_reasons(Assessment(states, {}, tier=Tier.MODEL), absent, DT, gains=True)
    assert State.NOT_ASSESSED not in told.lacks
    assert "no samples" in told.reasons[State.NO_DATA]
