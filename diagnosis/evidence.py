"""What every family of evidence has in common: the mission that it sees, and what it hands on.

A family is one folder (`direct`, `wheels`, `steering`, `drives`) with the same parts under the same names:

    inputs          the channels that the family needs, taken from the mission; None where the log lacks them
    models          its models of the fault rows, and their constants as named tuples
    identification  constants that are found in the mission itself
    kernel          compiled recursions over samples or blocks (one module, or several that end in ``_kernel``)
    findings        from the path of models to findings with ε̂, saturation, probability and evidence
    assess          the family itself: an object that is an `EvidenceFamily`

`diagnosis.families` has the table of them, in the order in which they are asked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Assessment
from diagnosis.results.vocabulary import Tier
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.progress import Subscriber
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
#: A component and its side.
Part = tuple[str, str]


@dataclass(frozen=True)
class MissionView:
    """What a family may look at.

    Attributes
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    wheels : tuple[str, ...]
        Wheels to judge; the others only help.
    alive : dict[str, NDArray[np.int16]]
        From `diagnosis.channels.liveness.alive_sources`.
    known : dict[Part, Assessment]
        What families before this one have found; a family adds nothing here itself.
    """

    timeline: Timeline
    replay: Replay
    machine: Machine
    wheels: tuple[str, ...]
    alive: dict[str, NDArray[np.int16]]
    progress: Subscriber
    known: dict[Part, Assessment] = field(default_factory=dict)


class EvidenceFamily(Protocol):
    """One kind of evidence."""

    @property
    def tier(self) -> Tier:
        """How strong it is: a stronger one is asked first, and what it judged stays."""
        ...

    def assess(self, mission: MissionView) -> Mapping[Part, Assessment]:
        """Judge the parts for which the log offers this evidence; parts without it are left out."""
        ...
