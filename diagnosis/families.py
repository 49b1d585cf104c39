"""The table of families of evidence, in the order in which they are asked.

What one has judged stays, so the order is that of strength; where one needs what another finds (the wheels need the
steering angles), that one comes first.
"""

from __future__ import annotations

from diagnosis.channels.family import DeadSensors
from diagnosis.direct.family import DirectEvidence
from diagnosis.drives.family import DriveEvidence
from diagnosis.evidence import EvidenceFamily
from diagnosis.response.family import ResponseEvidence, TrackingEvidence
from diagnosis.steering.family import SteeringEvidence
from diagnosis.wheels.family import WheelEvidence

FAMILIES: tuple[EvidenceFamily, ...] = (
    SteeringEvidence(),
    DeadSensors(),
    DirectEvidence(),
    WheelEvidence(),
    DriveEvidence(),
    ResponseEvidence(),
    TrackingEvidence(),
)
