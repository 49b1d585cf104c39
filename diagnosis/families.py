"""The tables of families of evidence, in the order in which they are asked.

What one has judged stays, so the order is that of strength; where one needs what another finds (the wheels need the
steering angles), that one comes first. Those of the first two tables need nothing of each other, and may be asked at once.
"""

from __future__ import annotations

from diagnosis.channels.family import DeadSensors
from diagnosis.direct.family import DirectEvidence
from diagnosis.drives.family import DriveEvidence
from diagnosis.evidence import EvidenceFamily
from diagnosis.response.family import ResponseEvidence, TrackingEvidence
from diagnosis.steering.family import SteeringEvidence
from diagnosis.wheels.family import WheelEvidence

#: What the steering does.
AXLES: tuple[EvidenceFamily, ...] = (SteeringEvidence(),)
#: What the channels of a single wheel show: these look at nothing that the axles hand on, and hand on parts alone.
SINGLE: tuple[EvidenceFamily, ...] = (DeadSensors(), DirectEvidence())
#: What wheels show beside each other and beside their commands.
WHOLE: tuple[EvidenceFamily, ...] = (WheelEvidence(), DriveEvidence(), ResponseEvidence(), TrackingEvidence())
