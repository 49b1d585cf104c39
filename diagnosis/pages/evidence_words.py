"""What the kinds of evidence are called: the name of each tier, and how a fault was decided by it.

The plural that follows *by* (``second measurements``) stands with `diagnosis.results.vocabulary.Tier`.
"""

from __future__ import annotations

from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import Side

_NAMES = {
    Tier.DIRECT: "second measurement",
    Tier.DRIVE: "drive model",
    Tier.SIGNAL: "channel alone",
    Tier.TRACKING: "command tracking",
    Tier.NONE: "",
}
_MODELS = {Kind.WHEEL: "wheel model", Kind.STEER: "steering model"}
_VALVE = "measured against the valve's position"
_DIRECT = {
    (Kind.WHEEL, Side.SENSOR): "measured against a second speed sensor",
    (Kind.WHEEL, Side.ACTUATOR): _VALVE,
    (Kind.STEER, Side.SENSOR): "measured against a second angle sensor",
    (Kind.STEER, Side.ACTUATOR): _VALVE,
}
_DECIDED = {
    Tier.DRIVE: "by the drive's own effort, without a second measurement",
    Tier.SIGNAL: "from the channel alone",
    Tier.TRACKING: "because the command is not followed; sensor and drive cannot be told apart",
    Tier.NONE: "",
}


def tier_name(kind: Kind, tier: Tier) -> str:
    """Name of the evidence: ``second measurement``, ``wheel model``; empty where there is none."""
    return _MODELS[kind] if tier == Tier.MODEL else _NAMES[tier]


def how_decided(kind: Kind, side: Side, tier: Tier) -> str:
    """How a fault of a component and side was decided; empty where nothing says so."""
    if tier == Tier.DIRECT:
        return _DIRECT.get((kind, side), "")
    if tier == Tier.MODEL:
        return f"by the {_MODELS[kind]}, without a second measurement"
    return _DECIDED[tier]
