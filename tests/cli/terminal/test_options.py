from __future__ import annotations

from cli.terminal.options import FailOn
from diagnosis.results.vocabulary import Severity


def test_fail_on_takes_every_severity_in_order_and_never() -> None:
    assert [level.value for level in FailOn] == [*(severity.value for severity in Severity), "never"]
