"""The tables of families of evidence, in the order in which they are asked.

What one has judged stays, so the order is that of strength; where one needs what another finds (the wheels need the
steering angles), that one comes first. Those of the first two tables need nothing of each other, and may be asked at once.
"""

from __future__ import annotations

import numpy as np

from diagnosis.channels.family import DeadSensors
from diagnosis.direct.family import DirectEvidence
from diagnosis.drives.family import DriveEvidence
from diagnosis.evidence import EvidenceFamily, MissionView
from diagnosis.response.family import ResponseEvidence, TrackingEvidence
from diagnosis.response.never_moves import UnmovedDrives
from diagnosis.steering.family import SteeringEvidence
from diagnosis.wheels.family import WheelEvidence

#: What the steering does.
AXLES: tuple[EvidenceFamily, ...] = (SteeringEvidence(),)
#: What the channels of a single wheel show: these look at nothing that the axles hand on, and hand on parts alone.
SINGLE: tuple[EvidenceFamily, ...] = (DeadSensors(), DirectEvidence())
#: What wheels show beside each other and beside their commands.
_WHOLE: tuple[EvidenceFamily, ...] = (
    WheelEvidence(),
    DriveEvidence(),
    UnmovedDrives(),
    ResponseEvidence(),
    TrackingEvidence(),
)
_BY_SPEEDS: tuple[EvidenceFamily, ...] = (
    ResponseEvidence(),
    WheelEvidence(),
    DriveEvidence(),
    UnmovedDrives(),
    TrackingEvidence(),
)


def whole(mission: MissionView) -> tuple[EvidenceFamily, ...]:
    """What wheels show beside each other and beside their commands, in the order in which it is asked.

    The wheel model is of valves, whose openings are speeds, under wheels that are steered. Of several motors without a steering axle that
    follow commanded speeds, a duty or a current that is logged beside these says less than their answers: it must take nothing from them.
    """
    machine = mission.machine
    follows = any(np.isfinite(mission.command(w)).any() for w in machine.wheels)
    motors = machine.drive == "motor" and not machine.axles and len(machine.wheels) > 1
    return _BY_SPEEDS if motors and follows else _WHOLE
