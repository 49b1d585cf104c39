"""How auditing one mission can end: exactly one of six states, with a reason in one sentence."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

from diagnosis.audit.store.summary import MissionSummary


class MissionState(StrEnum):
    """How a mission stands in an audit: one of six ends, or not audited yet."""

    OK = "ok"
    DEGRADED = "degraded"
    UNREADABLE = "unreadable"
    TIMEOUT = "timeout"
    OUT_OF_MEMORY = "out_of_memory"
    CRASHED = "crashed"
    PENDING = "pending"

    @property
    def words(self) -> str:
        """Words for lists and headings; empty for what was read whole."""
        return _WORDS[self]


_WORDS = {
    MissionState.OK: "",
    MissionState.DEGRADED: "damaged or in part left out",
    MissionState.UNREADABLE: "unreadable",
    MissionState.TIMEOUT: "took too long",
    MissionState.OUT_OF_MEMORY: "out of memory",
    MissionState.CRASHED: "crashed",
    MissionState.PENDING: "not audited yet",
}
#: States in which an attempt can end.
ENDS: tuple[MissionState, ...] = tuple(state for state in MissionState if state is not MissionState.PENDING)
#: Ends of missions whose log was read, and which may have a report.
READ: frozenset[MissionState] = frozenset({MissionState.OK, MissionState.DEGRADED})
#: Ends that may be the machine's fault rather than the log's: worth another attempt.
TRANSIENT: frozenset[MissionState] = frozenset({MissionState.TIMEOUT, MissionState.OUT_OF_MEMORY, MissionState.CRASHED})

_LIMITS = (
    (
        MissionState.TIMEOUT,
        "--timeout",
        re.compile(r"took longer than ([\d.e+-]+) s; allow more with --timeout$"),
    ),
    (
        MissionState.TIMEOUT,
        "--cpu",
        re.compile(r"took more than ([\d.e+-]+) s of a processor; allow more with --cpu$"),
    ),
    (
        MissionState.OUT_OF_MEMORY,
        "--memory",
        re.compile(r"needed more than (\d+) MB of memory.*; allow more with --memory$", re.DOTALL),
    ),
)


class LimitMet(str):
    """A reason that says at which limit a mission was stopped: option of the command line, and its value there."""

    option: str
    value: float

    def __new__(cls, text: str, option: str, value: float) -> LimitMet:
        """The sentence with option and value."""
        made = super().__new__(cls, text)
        made.option, made.value = option, value
        return made


def limit_in_words(state: str, reason: str) -> tuple[str, float] | None:
    """Option and value of the limit at which a mission was stopped, of a result that an earlier version wrote, which holds them in its reason alone."""
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
    state : MissionState
        ``ok``: read whole. ``degraded``: read, but parts are damaged or left out, or nothing in it can be judged.
        ``unreadable``: no log that can be read. ``timeout``, ``out_of_memory``: stopped at a limit. ``crashed``: the
        process ended otherwise.
    reason : str
        One sentence; empty where ok.
    wall_s, cpu_s : float
        Time that it took, and time of a processor [s].
    peak_mb : float
        Most memory held at once [MB].
    summary : MissionSummary or None
        From `diagnosis.audit.store.summary.summarise`; None where there is no report.
    passing : bool
        Whether the files could not be read for a reason outside of them, which may pass: no result of their content.
    killed : bool
        Whether something outside of the mission ended it: an operator, or the system for want of memory or of room for
        temporary files. It is tried once more in any case, and always again by the next audit.
    limit : tuple[str, float] or None
        Option and value of the limit at which it was stopped: that of a reason that is a `LimitMet`; None where it was at none.
    no_log : bool
        Whether it is a table that is no machine's log.
    """

    state: MissionState
    reason: str = ""
    wall_s: float = 0.0
    cpu_s: float = 0.0
    peak_mb: float = 0.0
    summary: MissionSummary | None = None
    passing: bool = False
    killed: bool = False
    limit: tuple[str, float] | None = None
    no_log: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.reason, LimitMet):
            object.__setattr__(self, "limit", (self.reason.option, self.reason.value))
        if self.state not in ENDS:
            raise ValueError(f"state {self.state!r}: expected one of {', '.join(ENDS)}")
        if (self.state == MissionState.OK) != (not self.reason):
            raise ValueError(
                f"{self.state} with the reason {self.reason!r}: every state but ok has a reason, ok has none"
            )
