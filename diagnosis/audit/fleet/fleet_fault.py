"""A fault of a machine over its missions: in which of them it was found, and whether it stands."""

from __future__ import annotations

from dataclasses import dataclass

from diagnosis.audit.fleet.fault_types import Status
from diagnosis.audit.fleet.read import Bounds
from diagnosis.audit.fleet.runs import Run
from diagnosis.results.vocabulary import Severity

#: Missions that assessed the part without the fault after which a fault is past.
STANDING = 3
#: The same of a fault that was of high severity and that nobody is known to have repaired.
OPEN = 10


@dataclass(frozen=True)
class FleetFault:
    """All faults of one machine on one component and side in one row.

    Attributes
    ----------
    component, kind, side, mode : str
        As in the missions' reports.
    severity : str
        The worst in its last missions: those after the last mission before them that assessed the part without it.
    status : str
        ``new``: in the machine's last mission and in none of the earlier ones, of which one assessed the part;
        ``recurring``: in several missions; ``once``; ``past``: not found in the last `needed` missions that assessed it;
        ``repaired``: not found since the part was repaired.
    missions, assessed : int
        Missions with it, and missions that assessed the part.
    first, last : Run
        Its first and last mission.
    last_id : str
        Its number in the report of the last one.
    since : int
        Missions that assessed the part after the last one with it.
    epsilon : Bounds or None
        ε̂ in the last one.
    needed : int
        Missions without it after which it is past: `STANDING`, or `OPEN` where it was of high severity and not repaired.
    clean : int
        Such missions so far; of an open fault those that would have shown it.
    repaired_ns : int or None
        When the part was repaired last, as far as that was recorded.
    unclear : bool
        Whether the report of the last one says that its kind is unclear.
    """

    component: str
    kind: str
    side: str
    mode: str
    severity: Severity
    status: Status
    missions: int
    assessed: int
    first: Run
    last: Run
    last_id: str
    since: int
    epsilon: Bounds | None
    needed: int = STANDING
    clean: int = 0
    repaired_ns: int | None = None
    unclear: bool = False

    @property
    def standing(self) -> bool:
        """Whether it counts as there."""
        return self.status not in ("past", "repaired")

    @property
    def open(self) -> bool:
        """Whether it was of high severity, is not repaired, and was not refuted by enough missions."""
        return self.standing and self.needed == OPEN
