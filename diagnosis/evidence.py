"""What every family of evidence has in common: the mission that it sees, and what it hands on.

A family is one folder (`direct`, `wheels`, `steering`, `drives`, `channels`) with the same parts under the same names; one that
does without a part lacks it, as `channels`, which judges by single channels and has no model, has `family` alone of them:

    inputs          the channels that the family needs, taken from the mission
    models          its models of the fault rows, and their constants as named tuples
    identification  constants that are found in the mission itself
    kernel          compiled recursions over samples or blocks (one module, or several that end in ``_kernel``)
    findings        from the path of models to findings with ε̂, saturation, probability and evidence
    assess          the walk through these parts, for one component or all of them together
    family          the family itself: an object that is an `EvidenceFamily`

`diagnosis.families` has the tables of them, in the order in which they are asked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import CODE, Assessment
from diagnosis.results.machine_event import MachineEvent
from diagnosis.results.vocabulary import Tier
from diagnosis.results.wheel_model import WheelModelFit
from replay.control.loop import Replay
from replay.faults import Side, State
from replay.machine.config import Machine
from replay.progress import Subscriber
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: A component and its side.
Part = tuple[str, str]

SENSOR, ACTUATOR = Side.SENSOR.value, Side.ACTUATOR.value


@dataclass(frozen=True)
class Contribution:
    """What a family found, and what it hands on to those after it.

    Attributes
    ----------
    parts : Mapping[Part, Assessment]
        Parts for which the log offers this evidence.
    angle, doubtful : Array or None, NDArray[np.bool_] or None, shape (n, axles)
        Best estimate of the true steering angles [rad], and where it rests on a model or on a sensor in doubt.
    model : WheelModelFit or None
        Wheel models behind the judgement.
    events : tuple[MachineEvent, ...]
        What happened to the machine as a whole and is no part's fault.
    """

    parts: Mapping[Part, Assessment]
    angle: Array | None = None
    doubtful: Flags | None = None
    model: WheelModelFit | None = None
    events: tuple[MachineEvent, ...] = ()


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
    progress : Subscriber
        Called at the beginning of each stage.
    known : Mapping[Part, Assessment]
        What families before this one have judged: a family leaves these parts out.
    angle, doubtful, model, events
        As in `Contribution`, from families before this one.
    """

    timeline: Timeline
    replay: Replay
    machine: Machine
    wheels: tuple[str, ...]
    alive: dict[str, NDArray[np.int16]]
    progress: Subscriber
    known: Mapping[Part, Assessment] = field(default_factory=dict)
    angle: Array | None = None
    doubtful: Flags | None = None
    model: WheelModelFit | None = None
    events: tuple[MachineEvent, ...] = ()

    def values(self, name: str) -> Array:
        """A signal on the timeline, shape (n,); NaN where it is not logged."""
        found = self.timeline.get(name)
        return np.broadcast_to(np.nan, (self.timeline.size,)) if found is None else found

    def logged(self, name: str) -> bool:
        """Whether a signal has any value."""
        return bool(np.isfinite(self.values(name)).any())

    def judged(self, part: Part) -> bool:
        """Whether a family before this one has judged a part."""
        return part in self.known and self.known[part].tier is not Tier.NONE

    def command(self, wheel: str) -> Array:
        """Commanded speed of a wheel [m/s], shape (n,)."""
        return self.replay.v_ref[:, self.machine.wheels.index(wheel)]

    def after(self, found: Contribution) -> MissionView:
        """The same for the families after one that found this; what was judged before stays, what could not be is open."""
        return replace(
            self,
            known={**self.known, **{part: a for part, a in found.parts.items() if _open(self.known.get(part), a)}},
            angle=self.angle if found.angle is None else found.angle,
            doubtful=self.doubtful if found.doubtful is None else found.doubtful,
            model=self.model if found.model is None else found.model,
            events=self.events + found.events,
        )


def _open(known: Assessment | None, found: Assessment) -> bool:
    """Whether a part is still to be judged: nothing is known of it, or only why it could not be."""
    if known is None:
        return True
    masked = CODE[State.MASKED] in known.states[:1]
    return known.tier is Tier.NONE and found.tier is not Tier.NONE and not masked


class EvidenceFamily(Protocol):
    """One kind of evidence."""

    @property
    def tier(self) -> Tier:
        """How strong it is."""
        ...

    def assess(self, mission: MissionView) -> Contribution:
        """Judge the parts that are not known yet and for which the log offers this evidence."""
        ...
