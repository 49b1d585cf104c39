from __future__ import annotations

import pytest

from diagnosis.audit.store.outcome import ENDS, Outcome


def test_there_are_six_states() -> None:
    assert ENDS == ("ok", "degraded", "unreadable", "timeout", "out_of_memory", "crashed")


@pytest.mark.parametrize(("state", "reason"), [("ok", "but"), ("crashed", ""), ("fine", "")])
def test_every_end_but_ok_has_a_reason(state: str, reason: str) -> None:
    with pytest.raises(ValueError, match=r"state 'fine'|reason"):
        Outcome(state, reason)  # type: ignore[arg-type]
