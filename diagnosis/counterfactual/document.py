"""What `mfhca counterfactual` writes as JSON."""

from __future__ import annotations

from typing import Final, Literal, TypedDict

from diagnosis.results.document import ReadingRow, ToolRow
from replay.faults import FaultMode, Side

SCHEMA: Final = "mfhca-counterfactual/1"


class FigureRow(TypedDict):
    """One figure over the mission, over driving, and per wheel outside and inside of its faults; null where there is no such time."""

    mission: float | None
    driving: float | None
    healthy: float | None
    faulty: float | None


class LawFigures(TypedDict):
    """Figures of one law.

    `tracking_error` is mean |v − v_c| [m/s] where the wheel's speed is known, `control_effort` mean |u| [fraction], `total_variation`
    Σ|Δu| per second and wheel, `saturated` the share of commands at their limit.
    """

    tracking_error: FigureRow
    control_effort: FigureRow
    total_variation: float
    saturated: float


class RecoveryRow(TypedDict):
    """How long a wheel took to come back to its command after a fault [s]; null where it did not, or cannot be seen."""

    component: str
    side: Side
    mode: FaultMode
    start_s: float
    stop_s: float
    recovery_s: float | None


class BandRow(TypedDict):
    """90 % of the Monte Carlo draws of a figure over the mission; null where none were drawn."""

    low: float
    high: float


class LawRow(TypedDict):
    """One law: what it is, and what the mission would have been."""

    law: str
    title: str
    parameters: int
    gains: dict[str, float]
    tuned: bool
    figures: LawFigures
    error_band: BandRow | None
    effort_band: BandRow | None
    recoveries: list[RecoveryRow]


class SelfReplayRow(TypedDict):
    """The recorded law, replayed in the loop: what it must reproduce before another law is predicted.

    `shift` is mean |Δv| [m/s]; errors and efforts are of the mission, recorded and replayed.
    """

    law: str
    gains: dict[str, float]
    error_recorded: float
    error_replayed: float
    effort_recorded: float
    effort_replayed: float
    shift: float


class PlantRow(TypedDict):
    """What the wheels were taken for: gain [m/s], lag [s], grip [1], and relative standard deviations of the draws."""

    wheel: str
    K: float
    tau: float
    grip: float
    K_std: float
    tau_std: float


class SpanRow(TypedDict):
    """A stretch of the mission [s]."""

    start_s: float
    stop_s: float


class ProofRow(TypedDict):
    """The paper's stability proof on one wheel of the recorded mission; see `replay.control.lyapunov`.

    Largest |F| and |D| [m/s²] and V [m]; seconds in which V' and its bound L22 are known, in which V' exceeds it, and in which a = 0;
    stretches of at least 0.1 s in which it does.
    """

    wheel: str
    F_most: float | None
    D_most: float | None
    V_most: float | None
    known_s: float
    broken_s: float
    uncontrolled_s: float
    broken: list[SpanRow]


class CounterfactualDocument(TypedDict):
    """A recorded mission under other laws."""

    schema: Literal["mfhca-counterfactual/1"]
    tool: ToolRow
    log: list[str]
    machine: str
    duration_s: float
    rate_hz: float
    known_s: dict[str, float]
    faults: int
    readings: list[ReadingRow]
    plant: list[PlantRow]
    plant_note: str
    self_replay: SelfReplayRow
    recorded: LawRow
    laws: list[LawRow]
    proof: list[ProofRow]
    draws: int
    notes: list[str]
