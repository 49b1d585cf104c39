"""How auditing one mission can end: exactly one of six states, with a reason in one sentence."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

State = Literal["ok", "degraded", "unreadable", "timeout", "out_of_memory", "crashed"]

STATES: tuple[State, ...] = get_args(State)
READ: frozenset[State] = frozenset({"ok", "degraded"})
TRANSIENT: frozenset[State] = frozenset({"timeout", "out_of_memory", "crashed"})
"""Ends that may be the machine's fault rather than the log's: worth another attempt."""

_LIMITS = (
    ("timeout", "--timeout", re.compile(r"took longer than ([\d.e+-]+) s; allow more with --timeout$")),
    ("timeout", "--cpu", re.compile(r"took more than ([\d.e+-]+) s of a processor; allow more with --cpu$")),
    (
        "out_of_memory",
        "--memory",
        re.compile(r"needed more than (\d+) MB of memory.*; allow more with --memory$", re.DOTALL),
    ),
)


def limit_met(state: str, reason: str) -> tuple[str, float] | None:
    """Option and value of the limit at which a mission was stopped, as its reason tells; None where it was at none."""
    for of, option, pattern in _LIMITS:
        found = pattern.match(reason) if state == of else None
        if found:
            return option, float(found[1])
    return None


@dataclass(frozen=True)
class Outcome:
    """End of one attempt at one mission.

    Attributes
    ----------
    state : State
        ``ok``: read whole. ``degraded``: read, but parts are damaged or left out, or nothing in it can be judged.
        ``unreadable``: no log that can be read. ``timeout``, ``out_of_memory``: stopped at a limit. ``crashed``: the
        process ended otherwise.
    reason : str
        One sentence; empty where ok.
    wall_s, cpu_s : float
        Time that it took, and time of a processor [s].
    peak_mb : float
        Most memory held at once [MB].
    summary : Mapping or None
        From `diagnosis.audit.store.summary.summarise`; None where there is no report.
    passing : bool
        Whether the files could not be read for a reason outside of them, which may pass: no result of their content.
    """

    state: State
    reason: str = ""
    wall_s: float = 0.0
    cpu_s: float = 0.0
    peak_mb: float = 0.0
    summary: Mapping[str, Any] | None = None
    passing: bool = False

    def __post_init__(self) -> None:
        if self.state not in STATES:
            raise ValueError(f"state {self.state!r}: expected one of {', '.join(STATES)}")
        if (self.state == "ok") != (not self.reason):
            raise ValueError(
                f"{self.state} with the reason {self.reason!r}: every state but ok has a reason, ok has none"
            )
