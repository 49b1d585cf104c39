"""Wheels of which a log has the speed alone, and of others what drives them: whether they have a drive is asked, not taken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replay.setup.draft_notes import Draft
from replay.setup.machine_text import machine_text
from tests.replay.setup.test_unsure_signals import COMMANDS, V, drafted

SPEEDS = {f"{w}_speed_mps": V for w in ("FR", "FL", "RR", "RL")}
OPENINGS = {f"{w}_valve_cmd": np.clip(0.4 * V, -1.0, 1.0) for w in ("FR", "FL", "RR", "RL")}


def _asked(draft: Draft) -> list[str]:
    return [q for q in draft.questions if "no drive" in q]


def test_it_is_asked_and_the_line_stands_as_a_comment(tmp_path: Path) -> None:
    front = {name: x for name, x in OPENINGS.items() if name.startswith("F")}
    draft = drafted(tmp_path, {**COMMANDS, **SPEEDS, **front})
    (question,) = _asked(draft)
    assert question.startswith("have RR and RL no drive?")
    text = machine_text(draft, "a.csv")
    assert '# unpowered = ["RR", "RL"]' in text.splitlines()
    assert not draft.machine.unpowered


@pytest.mark.parametrize("openings", [{}, OPENINGS])
def test_nothing_is_asked_where_all_or_none_have_what_drives_them(
    tmp_path: Path, openings: dict[str, np.ndarray]
) -> None:
    draft = drafted(tmp_path, {**COMMANDS, **SPEEDS, **openings})
    assert not _asked(draft)
    assert "unpowered" not in machine_text(draft, "a.csv")
