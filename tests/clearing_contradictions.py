"""Statements on how much of a part was judged, and on what its faults explain, that cannot be true beside its table and states."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from typing import Any

from diagnosis.report.confidence import sure_of

_SURE = 0.9
_STILL_SHOWS_S, _STILL_SHOWS_MOST_S = 0.5, 3.0  # after the end of a fault
_EXPLAINS = 0.3


def of_coverage(report: Mapping[str, Any]) -> Iterator[str]:
    """A fault that is sure though nothing of its part was judged, or nothing moved that could show it."""
    for fault in report["intervals"]:
        name = f"{fault['id']} {fault['component']} {fault['side']} {fault['mode']}"
        words = sure_of(fault, report)  # type: ignore[arg-type]
        if re.search(r"\b0 % of", words):
            yield f"{name}: {words!r}"
        sides = ("sensor", "actuator") if fault["side"] == "sensor_or_actuator" else (fault["side"],)
        if fault["probability"] < _SURE or fault["severity"] == "info":
            continue
        resting = [_resting(fault, side, report) for side in sides]
        parted = any("stretches" in e for e in fault["evidence"])  # and says so
        if min(resting) > (0.8 if parted else 0.5):
            yield f"{name}: its part is not excited for {100 * min(resting):.0f} % of it"


def _resting(fault: Mapping[str, Any], side: str, report: Mapping[str, Any]) -> float:
    """Share of a fault in which nothing moved that could show one."""
    start, stop, out = fault["start_s"], fault["stop_s"], 0.0
    for s in report["states"]:
        if (s["component"], s["side"], s["state"]) == (fault["component"], side, "not_excited"):
            out += max(0.0, min(stop, s["stop_s"]) - max(start, s["start_s"]))
    return out / max(stop - start, 1e-9)


def of_checks(report: Mapping[str, Any]) -> Iterator[str]:
    """A check that is put down to a fault which lasts for a moment of its window alone, or is over for long."""
    faults = {f["id"]: f for f in report["intervals"]}
    for row in report["verdict"]["to_clear"]:
        found = re.match(
            r"(?:(At the time of|Just after) |Explained by )F\d+[^:]*?(, just after (?:it|them))?:", row["reason"]
        )
        if not found:
            continue
        during = found.group(1) != "Just after" and not found.group(2)
        named = [faults[name] for name in re.findall(r"F\d+", found.group(0))]
        windows = re.findall(r" at ([\d.]+)–([\d.]+) s", row["reason"])
        for fault, (start, stop) in itertools.product(named, windows):
            a, b = float(start), float(stop)
            shows = 0.0 if during else min(max(fault["stop_s"] - fault["start_s"], _STILL_SHOWS_S), _STILL_SHOWS_MOST_S)
            shared = min(b, fault["stop_s"] + shows) - max(a, fault["start_s"])
            if shared < _EXPLAINS * (b - a) - 0.1:
                lasts = "lasts" if during else "still shows"
                yield f"{fault['id']} {lasts} for {max(shared, 0.0):.1f} s of what it may explain: {row['reason']!r}"
            if not during and fault["stop_s"] >= b:
                yield f"{fault['id']} is said to have ended: {row['reason']!r}"


def of_remedies(report: Mapping[str, Any]) -> Iterator[str]:
    """A remedy that asks for signals which are all in the log, or sends somebody with a tachometer to a valve's position."""
    logged = {s["name"] for s in report["signals"]}
    for row in report["verdict"]["to_clear"]:
        parts = row.get("parts", [])
        for clause in re.findall(r"\blog ((?:wheel|steer)\.[^;:]*)", row["act"]):
            asked = [
                f"{kind}.{c}.{leaf}"
                for kind, who, leaf in re.findall(r"\b(wheel|steer)\.(\*|\w+)\.(\w+)", clause)
                for c in (sorted({p["component"] for p in parts}) if who == "*" else [who])
            ]
            if asked and logged.issuperset(asked):
                yield f"{row['reason']!r}: asked to log {clause!r}, which is in the log"
        valves = bool(parts) and all(p["side"] == "actuator" for p in parts)
        if valves and "off its second measurement" in row["reason"] and "tachometer" in row["act"]:
            yield f"{row['reason']!r}: {row['act']!r}"


def of_detectability(report: Mapping[str, Any]) -> Iterator[str]:
    """A part of which a fault of no size would have shown, while no check of it deviates; one of whose checks leave another room."""
    open_ = {(c["component"], c["check"] == "roughness") for c in report["clearing"] if not c["passed"]}
    unjudged = {p["component"] for row in report["verdict"]["to_clear"] if row.get("why") for p in row["parts"]}
    for row in report["detectability"]["rows"]:
        where = (row["component"], row["deviation"] == "noisy")
        if row["size"] == 0.0 and where not in open_ and row["component"] not in unjudged:
            what = f"{row['deviation']} {'throughout' if row['for_s'] is None else row['for_s']}"
            yield f"{row['component']} {row['side']}: a fault of no size would show ({what}), and nothing deviates"
