"""What happened to the machine as a whole, as rows of `report.json`."""

from __future__ import annotations

from typing import TypedDict

from diagnosis.results.document_numbers import Seconds


class SpanRow(TypedDict):
    """A time [s]."""

    start_s: Seconds
    stop_s: Seconds


class EventRow(TypedDict):
    """What happened to the machine as a whole, and is no part's fault, and when: without `spans` throughout."""

    id: str
    title: str
    text: str
    spans: list[SpanRow]
