"""The part of `report.json` on the recording: its files, how their clocks were put onto one, and how long it is."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from diagnosis.results.document_numbers import Seconds


class ClockRow(TypedDict):
    """How a file's clock was put onto the mission's."""

    reference: str
    method: str
    offset_s: float | None
    drift_ppm: float | None
    uncertainty_s: float | None
    signals: list[str]
    overlap_s: float | None
    reason: str


class FileRow(TypedDict):
    """One file of the mission.

    `left_out`: which sentences of `damage` say that a whole file was left out, which is not damaged; absent where none does.
    """

    path: str
    sha256: str
    bytes: int
    format: str
    damage: list[str]
    left_out: NotRequired[list[str]]
    notes: list[str]
    clock: ClockRow | None


class LogRow(TypedDict):
    """The recording.

    `path_note`: which source of positions stood still while others showed way, and was not used; `distance_note`: what the distance is from
    where it is not from the wheels' speeds, and why.
    """

    files: list[FileRow]
    start_ns: int
    open_loop: bool
    duration_s: Seconds
    rate_hz: float
    samples_per_bucket: NotRequired[int]
    distance_m: float | None
    distance_note: NotRequired[str]
    path_note: NotRequired[str]
    driving_s: Seconds
