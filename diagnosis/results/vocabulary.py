"""The words of a diagnosis, once: severities, verdicts, tiers of evidence, kinds of component.

Terminal, pages, JSON, comparison and fleet take rank and words from here; fault modes and states have theirs in
`diagnosis.results.fault_rows`, the parts of a machine in `diagnosis.results.machine_words`, which also fills in words in
braces. Everything is a `StrEnum`, so that a member is its own name in JSON.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from replay.faults import Side


class Severity(StrEnum):
    """How urgent a fault is, by Assumptions 1 and 2; the least urgent first."""

    INFO = "info"
    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"

    @property
    def rank(self) -> int:
        """Place in the order of urgency: 0 for `INFO`."""
        return _SEVERITY_RANK[self]


_SEVERITY_RANK = {member: i for i, member in enumerate(Severity)}


class Verdict(StrEnum):
    """What a mission says about its machine; the best first."""

    READY = "ready"
    NOT_ASSESSED = "not_assessed"
    WATCH = "watch"
    STOP = "stop"

    @property
    def rank(self) -> int:
        """How much it asks for: 0 for `READY`, 3 for `STOP`."""
        return _VERDICT_RANK[self]

    @property
    def label(self) -> str:
        """Words for the heading of one mission: ``Ready for the next mission``."""
        return _VERDICT_WORDS[self][0]

    @property
    def symbol(self) -> str:
        """Mode or state whose symbol and colour it takes."""
        return _VERDICT_WORDS[self][1]

    @property
    def short(self) -> str:
        """Words for lists, where many verdicts are beside each other: ``Ready``."""
        return _VERDICT_WORDS[self][2]

    @property
    def group(self) -> str:
        """Words for all missions of this verdict, in legends and counts: some that are not assessed were judged, and not cleared."""
        return f"{self.short} or {NOT_CLEARED.lower()}" if self is Verdict.NOT_ASSESSED else self.short


_VERDICT_RANK = {member: i for i, member in enumerate(Verdict)}
_VERDICT_WORDS = {
    Verdict.READY: ("Ready for the next mission", "healthy", "Ready"),
    Verdict.NOT_ASSESSED: ("Not assessed", "not_assessed", "Not assessed"),
    Verdict.WATCH: ("Faults to watch", "inefficient", "Faults to watch"),
    Verdict.STOP: ("Stop and repair", "stuck", "Stop and repair"),
}


#: Words for *not assessed* where every part of a wheel was judged, which is not what is missing.
NOT_CLEARED = "Not cleared"


class Leave(StrEnum):
    """Whether a machine may go out; what the data cannot show is to be checked first."""

    MUST_NOT = "must not go out"
    CHECK = "check before it goes out"
    MAY = "may go out"


class Tier(StrEnum):
    """Kind of evidence behind a judgement; the strongest first."""

    DIRECT = "direct"
    MODEL = "model"
    DRIVE = "drive"
    SIGNAL = "signal"
    RESPONSE = "response"
    TRACKING = "tracking"
    NONE = "none"

    @property
    def rank(self) -> int:
        """Place in the order of strength: 0 for `DIRECT`."""
        return _TIER_RANK[self]

    @property
    def strength(self) -> int:
        """How much it can show; 0 where nothing is judged. Tiers of one strength show the same."""
        return _TIERS[self].strength

    @property
    def words(self) -> str:
        """What the evidence is, to follow *by*; for `MachineWords.fill`."""
        return _TIERS[self].by

    def name_of(self, kind: Kind) -> str:
        """Name of the evidence: ``second measurement``, ``{wheel} model``; empty where there is none; for `MachineWords.fill`."""
        return _TIERS[self].evidence.format(kind=_KIND_WORDS[kind])

    def with_second(self, kind: Kind, side: Side) -> str:
        """Name of the evidence where a model, or a channel in it, took in a second measurement; for `MachineWords.fill`."""
        return f"{_KIND_WORDS[kind]} model with {_SECOND[kind, side]}"

    def decided(self, kind: Kind, side: Side, *, twice: bool = False) -> str:
        """How a fault of a component and side was decided; empty where nothing says so; for `MachineWords.fill`.

        `twice`: the model took in a second measurement of it.
        """
        if twice:
            return f"by the {self.with_second(kind, side)}"
        second = _SECOND.get((kind, side), "")
        how = _TIERS[self].decided
        return how.format(kind=_KIND_WORDS[kind], second=second) if second or "{second}" not in how else ""


class _TierRow(NamedTuple):
    """What is said of a tier: strength; what judges, to follow *by*; name of the evidence; how a fault was decided."""

    strength: int
    by: str
    evidence: str
    decided: str


_TIER_RANK = {member: i for i, member in enumerate(Tier)}
_TIERS = {
    Tier.DIRECT: _TierRow(3, "second measurements", "second measurement", "measured against {second}"),
    Tier.MODEL: _TierRow(
        2, "a model of the {wheels}", "{kind} model", "by the {kind} model, not by a second measurement"
    ),
    Tier.DRIVE: _TierRow(
        2, "a model of the drive", "drive model", "by the drive's own effort, without a second measurement"
    ),
    Tier.SIGNAL: _TierRow(1, "single channels", "channel alone", "from the channel alone"),
    Tier.RESPONSE: _TierRow(
        1,
        "how the drives answer their commands",
        "command response",
        "against what its command and the other {{wheels}} make it do, without a second measurement",
    ),
    Tier.TRACKING: _TierRow(
        1,
        "how the command is followed",
        "command tracking",
        "because the command is not followed; sensor and drive cannot be distinguished",
    ),
    Tier.NONE: _TierRow(0, "nothing", "", ""),
}


class Kind(StrEnum):
    """Kind of component."""

    WHEEL = "wheel"
    STEER = "steer"


_KIND_WORDS = {Kind.WHEEL: "{wheel}", Kind.STEER: "steering"}
# What a part's channel is measured against, where it is measured twice.
_SECOND = {
    (Kind.WHEEL, Side.SENSOR): "a second {wheel.sensor}",
    (Kind.WHEEL, Side.ACTUATOR): "the {position}",
    (Kind.STEER, Side.SENSOR): "a second angle sensor",
    (Kind.STEER, Side.ACTUATOR): "the {position}",
}
