"""Several spells of one value are stuck, of one share a loss, and what either explains as well stays open."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.direct.same_value import in_one_row
from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, Sentence, is_about
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

DT, SPELLS = 0.01, ((100, 400), (600, 900), (1200, 1500))
COMMANDS = (0.3, 0.8, 0.4)


def told(values: tuple[float, ...], commands: tuple[float, ...] = COMMANDS, sure: float = 0.0) -> list[Finding]:
    """Findings of a valve that stands at such openings in spells of such commands; the first is stuck as surely as `sure` says, if at all."""
    x = np.full(1600, 0.2)
    y = x.copy()
    for (a, b), value, command in zip(SPELLS, values, commands, strict=True):
        x[a:b], y[a:b] = command, value
    rng = np.random.default_rng(4)
    measured = Measured(
        y + 0.002 * rng.standard_normal(y.size),
        x,
        np.ones(y.size, np.bool_),
        DT,
        ("opening", "command"),
        "1",
        0.002,
        0.02,
    )
    found = []
    for k, (a, b) in enumerate(SPELLS):
        stuck, lost = (sure, 0.05) if sure and not k else (0.45, 0.45)
        rows = ((FaultMode.STUCK, stuck), (FaultMode.INEFFICIENT, lost), (FaultMode.OUTSIDE_TABLE, 0.08))
        found.append(
            Finding(
                a, b, Side.ACTUATOR, FaultMode.STUCK, stuck,
                tuple(Hypothesis("actuator", mode.value, p) for mode, p in rows),
                Epsilon(1.0, 0.6, 1.0), None, (Sentence(About.EITHER, "Either."), Sentence(About.SHARE, "Its own.")), Tier.DIRECT,
            )
        )  # fmt: skip
    return in_one_row(found, measured)


@pytest.mark.parametrize("sure", [0.0, 0.9])
def test_one_value_beside_other_commands_is_stuck(sure: float) -> None:
    found = told((0.15, 0.15, 0.15), sure=sure)
    assert [f.mode for f in found] == [FaultMode.STUCK] * 3
    assert all(f.probability > 0.85 for f in found)
    assert all(sum(h.p for h in f.hypotheses) == pytest.approx(0.98, abs=0.06) for f in found)
    assert not any(is_about(e, About.EITHER) for f in found for e in f.evidence)
    assert "In 3 such spells opening had one value" in found[1].evidence[-1]


def test_one_share_of_other_commands_is_a_loss() -> None:
    found = told((0.15, 0.4, 0.2))
    assert [f.mode for f in found] == [FaultMode.INEFFICIENT] * 3
    assert found[0].epsilon is not None
    assert found[0].epsilon.value == pytest.approx(0.5, abs=0.02)
    assert "one share, 0.50, of command" in found[0].evidence[-1]
    assert not any(is_about(e, About.SHARE) for f in found for e in f.evidence)  # of one spell, with other bounds


@pytest.mark.parametrize(
    ("values", "commands"),
    [
        ((0.15, 0.15, 0.15), (0.3, 0.3, 0.301)),
        ((0.1, 0.3, 0.35), COMMANDS),
        ((0.0, 0.0, 0.0), COMMANDS),
        ((0.2, 0.7, 0.3), COMMANDS),
    ],
)
def test_what_spells_do_not_tell_apart_stays_open(values: tuple[float, ...], commands: tuple[float, ...]) -> None:
    assert [f.probability for f in told(values, commands)] == [0.45] * 3
