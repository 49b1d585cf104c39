"""How long a part must be judged before it counts as judged, for verdict, caveats, comparison and pages alike; what cut a mission."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from diagnosis.results.document import CutRow, VerdictRow

#: Share of its driving for which a part must be judged.
LEAST_SHARE = 0.8


class CutKind(StrEnum):
    """In which way what was judged is not the whole mission."""

    #: A part of the log alone was judged.
    LOG = "log"
    #: Wheels or joints were left out.
    WHEELS = "wheels"
    #: The log names wheels or joints that the machine does not have.
    OTHERS = "others"
    #: Nothing judged the steering of axles.
    STEERING = "steering"
    #: The steering of an axle has no data for some time.
    DATA = "data"

    @property
    def of_time(self) -> bool:
        """Whether some of the mission's time is missing, rather than a part of the machine."""
        return self in (CutKind.LOG, CutKind.DATA)


@dataclass(frozen=True)
class Cut:
    """Why what was judged is not the whole mission.

    Attributes
    ----------
    kind : CutKind
        In which way.
    components : tuple[str, ...]
        Wheels or axles that it is of; empty where it is of the whole machine.
    text : str
        The reason, to follow *but*.
    """

    kind: CutKind
    components: tuple[str, ...]
    text: str

    def row(self) -> CutRow:
        """The same for ``report.json``, which has the reason beside it."""
        return {"kind": self.kind, "components": list(self.components)}


def needed_s(driving_s: float, min_assessed: float) -> float:
    """Driving [s] in which a part must be decided: `min_assessed` seconds and four fifths of what it drove."""
    return max(min_assessed, LEAST_SHARE * driving_s)


def is_judged(decided_s: float, driving_s: float, min_assessed: float) -> bool:
    """Whether a part was judged: decided for as long as it must be. Both times of its driving [s]."""
    return decided_s >= needed_s(driving_s, min_assessed)


def is_limited(verdict: VerdictRow, component: str) -> bool:
    """Whether a component that was judged was so for a part of the mission alone; also where an earlier version does not say of what a reason is."""
    cuts = verdict.get("cuts")
    if cuts is None:
        return bool(verdict["scope"])
    return any(
        CutKind(cut["kind"]).of_time and (not cut["components"] or component in cut["components"]) for cut in cuts
    )
