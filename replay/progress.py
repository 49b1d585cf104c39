"""Stages of long work, published as they begin, for whoever wants to show how far it is.

Loader, families of evidence, fit, clips and commands publish a `Progress` at the beginning of each `Stage`; they take
a `Subscriber` for that, which is `silent` where nobody listens.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum


class Stage(Enum):
    """What is being done: its words, and what it is expected to cost.

    Attributes
    ----------
    words : str
        Shown while it lasts, with a `Progress`'s detail behind them.
    cost : float
        Expected time for each megabyte of a mission's logs [s]; what counts is how stages compare with each other.
        0 for what costs little, or is no stage of a diagnosis.
    """

    words: str
    cost: float

    def __init__(self, words: str, cost: float = 0.0) -> None:
        self.words = words
        self.cost = cost

    STARTING = ("starting",)
    COMPILING = ("compiling numerical kernels for this processor, once after an installation: up to a minute",)
    LOOKING_FOR_LOGS = ("looking for logs",)
    LOOKING_FOR_MISSIONS = ("looking for missions",)

    OPENING = ("opening", 0.004)
    READING = ("reading", 0.015)
    HASHING = ("hashing", 0.001)
    COMPARING_CLOCKS = ("comparing clocks",)
    MAPPING_SIGNALS = ("mapping signals", 0.002)
    ALIGNING_SIGNALS = ("aligning signals", 0.002)
    REPLAYING_LOOP = ("replaying the loop", 0.05)

    IDENTIFYING_STEERING = ("identifying the steering", 0.002)
    JUDGING_STEERING = ("judging steering", 0.008)
    IDENTIFYING_WHEELS = ("identifying the wheels", 0.005)
    JUDGING_WHEELS = ("judging the wheels by their models", 0.035)
    JUDGING_WHEEL = ("judging wheel", 0.006)
    DECIDING = ("deciding", 0.004)
    WRITING_REPORT = ("writing the report", 0.055)

    CUTTING_CLIPS = ("cutting clips",)
    VERIFYING = ("verifying by filterpy",)
    REPLAYING_FOR_CLIPS = ("replaying the loop for the clips",)
    READING_FOR_CLIPS = ("reading the messages for the clips",)

    REPLAYING_MISSION = ("replaying",)
    CHECKING_UNITS = ("checking units",)
    FITTING_LAW = ("fitting the control law",)
    FITTING_WHEELS = ("fitting the wheels",)
    FITTING_GEOMETRY = ("fitting the geometry",)
    FITTING_DRIVES = ("fitting the drives",)

    PREDICTING = ("predicting the mission under",)
    TUNING = ("tuning",)
    DRAWING = ("drawing plants and faults for the bands",)

    SIMULATING = ("simulating",)
    INJECTING = ("injecting faults",)
    WRITING = ("writing",)


@dataclass(frozen=True)
class Progress:
    """The beginning of a stage.

    Attributes
    ----------
    stage : Stage
        What is being done.
    detail : str
        On what: a wheel, a steering axle or the name of a file; empty for all there is.
    mission : str
        Name of the mission, where several are worked on one after the other; else empty.
    """

    stage: Stage
    detail: str = ""
    mission: str = ""

    def __str__(self) -> str:
        """One line: ``drive.mcap: judging wheel FR``."""
        words = f"{self.stage.words} {self.detail}" if self.detail else self.stage.words
        return f"{self.mission}: {words}" if self.mission else words


Subscriber = Callable[[Progress], None]


def silent(progress: Progress) -> None:
    """Subscriber that shows nothing."""


_to_tell: list[Subscriber] = []


def tell_of_compiling(subscriber: Subscriber = silent) -> None:
    """Have one subscriber told, once, when the first kernel must be compiled before it runs; replaces the former one."""
    _to_tell[:] = [subscriber]


def compiling_begins() -> None:
    """Tell whoever wants to know that a kernel is compiled now."""
    told = _to_tell[:]
    _to_tell.clear()
    for subscriber in told:
        subscriber(Progress(Stage.COMPILING))
