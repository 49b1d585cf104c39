"""Sentences of a fault that cannot be true beside what its heading and its table say: its kind, and how long it lasts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from diagnosis.results.candidates import UNCLEAR, candidates_of


def of_kinds(report: Mapping[str, Any]) -> Iterator[str]:
    """An action that calls a fault by a row while its heading calls it unclear, or the other way round."""
    faults = {f["id"]: f for f in report["intervals"]}
    for action in report["verdict"]["actions"]:
        unclear = [f for f in action["faults"] if candidates_of(faults[f])]
        if (UNCLEAR in action["text"]) != bool(unclear):
            yield f"unclear are {unclear}, and action {action['n']} says {action['text']!r}"
