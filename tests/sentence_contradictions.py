"""Sentences of a fault that cannot be true beside what its heading and its table say: its kind, and how long it lasts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from diagnosis.results.candidates import UNCLEAR, candidates_of


def of_kinds(report: Mapping[str, Any]) -> Iterator[str]:
    """An action that calls a fault by a row while its heading calls it unclear, or the other way round."""
    faults = {f["id"]: f for f in report["intervals"]}
    for action in report["verdict"]["actions"]:
        unclear = [f for f in action["faults"] if candidates_of(faults[f])]
        own = action["text"].partition("; it lies in the time of ")[0]  # a cause's kind may be unclear
        if (UNCLEAR in own) != bool(unclear):
            yield f"unclear are {unclear}, and action {action['n']} says {action['text']!r}"


def of_slip(report: Mapping[str, Any]) -> Iterator[str]:
    """A fault during whose time a lane of its part says mostly that the wheel slips, or that sensor is faulty: it is told which."""
    for fault in report["intervals"]:
        sides = ("sensor", "actuator") if fault["side"] == "sensor_or_actuator" else (fault["side"],)
        for side in sides if fault["severity"] != "info" else ():
            spans = [s for s in report["states"] if (s["component"], s["side"]) == (fault["component"], side)]
            shared = [
                (s["state"], min(s["stop_s"], fault["stop_s"]) - max(s["start_s"], fault["start_s"])) for s in spans
            ]
            slips = sum(t for state, t in shared if state == "slip" and t > 0.0)
            if slips > 0.5 * (fault["stop_s"] - fault["start_s"]):
                yield f"{fault['id']}: its {side} is said to slip for {slips:.1f} s of it"


def of_lengths(report: Mapping[str, Any]) -> Iterator[str]:
    """A time in which a channel did something that is longer than the fault, and not said to be."""
    for fault in report["intervals"]:
        seconds = fault["stop_s"] - fault["start_s"]
        for text in fault["evidence"]:
            for said, rest in re.findall(r"\b(?:[Ff]or|[Oo]ver) ([\d.]+) s\b(.{0,20})", text):
                elsewhere = re.match(r" (?:before it|after it|of driving|in all|in and around it)", rest)
                grew = "Before that it grew" in text
                if float(said) > 1.02 * seconds + 0.06 and not elsewhere and not grew:
                    yield f"{fault['id']} lasts for {seconds:.2f} s: {text!r}"
