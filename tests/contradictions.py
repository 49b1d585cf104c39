"""Statements of one result that cannot all be true: verdict, severity, hypotheses, advice, sizes, times, states, words, page."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cli.tables.verdict import verdict_parts
from diagnosis.decision.short import AS_WELL_HEALTHY
from diagnosis.pages.labels import fault_title
from diagnosis.results.candidates import candidates_of, label_of
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Severity
from replay.machine.quantities import OPENING
from tests.clearing_contradictions import of_checks, of_coverage, of_detectability, of_remedies
from tests.page_contradictions import of_page
from tests.plot_contradictions import of_faults, of_states
from tests.sentence_contradictions import of_kinds, of_lengths, of_slip
from tests.word_slips import slips

_TOTAL = ("stuck", "no_signal")
_AT_RISK, _ROUNDED = 0.75, 1e-6
_HALF = 0.5  # of ε, from which on a part alone keeps a machine from being cleared
_LOST = 0.9
_SPARE_S = 0.05


def contradictions(report: Mapping[str, Any], columns: Mapping[str, NDArray[Any]] | None = None) -> list[str]:
    """One sentence for each contradiction in a ``report.json``, and between it and its plots; empty where there is none.

    Parameters
    ----------
    report : Mapping[str, Any]
        The document.
    columns : Mapping[str, NDArray] or None
        Columns of its plots, with ``t``: every sample of a short mission.
    """
    out = [
        *_verdict(report),
        *_actions(report),
        *_coverage(report),
        *_open(report),
        *_terminal(report),
        *of_coverage(report),
        *of_checks(report),
        *of_detectability(report),
        *of_remedies(report),
        *of_kinds(report),
        *of_lengths(report),
        *of_slip(report),
        *of_page(report),
        *slips(report),
    ]
    for fault in report["intervals"]:
        name = f"{fault['id']} {fault['component']} {fault['side']} {fault['mode']}"
        out += [f"{name}: {text}" for text in (*_chances(fault), *_sizes(fault, report), *_urgency(fault, report))]
        out += [f"{name}: {text}" for text in (*_times(fault, report), *_words(fault), *_followed(fault))]
        out += [f"{name}: {text}" for text in of_faults(fault, report, columns or {})]
    out += of_states(report, columns or {})
    return out


def _verdict(report: Mapping[str, Any]) -> Iterator[str]:
    verdict, faults = report["verdict"], report["intervals"]
    high = sum(f["severity"] == "high" for f in faults)
    watch = sum(f["severity"] in ("medium", "low") for f in faults)
    if (verdict["status"] == "stop") != (high > 0):
        yield f"verdict {verdict['status']} with {high} faults of high severity"
    if verdict["status"] in ("ready", "not_assessed") and watch:
        yield f"verdict {verdict['status']} with {watch} faults to watch"
    if verdict["status"] == "ready" and not verdict["cleared"]:
        yield "ready, and not cleared"
    if verdict["cleared"] and verdict["status"] not in ("ready", "watch"):
        yield f"cleared with verdict {verdict['status']}"
    if verdict["cleared"] and verdict["not_cleared"]:
        yield "cleared, with a reason why not"
    if (verdict["status"] == "ready") and verdict["to_clear"]:
        yield f"ready, and open: {verdict['to_clear'][0]['reason']}"
    if not verdict["cleared"] and verdict["status"] in ("watch", "not_assessed"):
        how = bool(verdict["to_clear"]) or verdict["not_cleared"].endswith("may not answer")
        if not how or not all(row["act"] for row in verdict["to_clear"]):
            yield "not cleared, and nobody is told what would clear it"
    if verdict["status"] == "not_assessed" and len(re.findall(r"[.](?= [A-Z]|$)", verdict["text"])) > 2:
        yield f"more than two sentences: {verdict['text']!r}"
    if "a check is open" in verdict["title"] and "other checks" in verdict["text"]:
        yield f"title {verdict['title']!r}, and more than one are open"
    parts = {(f["component"], f["side"]) for f in faults if f["severity"] != "info"}
    repair = {(f["component"], f["side"]) for f in faults if f["severity"] == "high"}
    told = [len(repair), len(parts - repair)]
    spells = re.search(r", in (\d+) spells$", verdict["title"])
    stated = sum(f["severity"] != "info" for f in faults)
    if (int(spells.group(1)) if spells else len(parts)) != stated and verdict["status"] in ("stop", "watch"):
        yield f"title {verdict['title']!r}, and {stated} spells"
    if len(verdict["actions"]) != len(parts):
        yield f"{len(verdict['actions'])} things to do for {len(parts)} parts"
    counts = [
        int(n)
        for n in re.findall(r"(\d+) parts? to repair|(\d+) (?:parts? )?to (?:watch|check)", verdict["title"])
        for n in n
        if n
    ]
    if counts and counts != [n for n in told if n]:
        yield f"title {verdict['title']!r} with {high} and {watch} faults"
    open_checks = [c for c in report.get("clearing", []) if not c["passed"]]
    if verdict["cleared"] and open_checks:
        yield f"cleared with {len(open_checks)} open checks"


def _actions(report: Mapping[str, Any]) -> Iterator[str]:
    faults = {f["id"]: f for f in report["intervals"]}
    named: dict[str, int] = {}
    for action in report["verdict"]["actions"]:
        worst = max(Severity(faults[f]["severity"]).rank for f in action["faults"])
        if Severity(action["severity"]).rank != worst:
            yield f"action {action['n']} is {action['severity']}, its worst fault is not"
        if action["text"].startswith("Stop") != (action["severity"] == "high"):
            yield f"action {action['n']} ({action['severity']}) begins with {action['text'][:12]!r}"
        for f in action["faults"]:
            named[f] = named.get(f, 0) + 1
    for action in report["verdict"]["actions"]:
        sizes = [faults[f]["epsilon"]["value"] for f in action["faults"] if faults[f]["epsilon"]]
        for found in re.finditer(r"\((?:reads )?(?:(\d+) to )?(\d+) % (?:lost|too little)\b", action["text"]):
            said = [int(x) for x in found.groups() if x]
            if not all(any(abs(x - 100 * size) <= 0.6 for size in sizes) for x in said):
                yield f"action {action['n']} says {found.group(0)!r}, its faults {[round(100 * x) for x in sizes]} %"
    for f in faults.values():
        if named.get(f["id"], 0) != (f["severity"] != "info"):
            yield f"{f['id']} ({f['severity']}) stands in {named.get(f['id'], 0)} actions"


def _coverage(report: Mapping[str, Any]) -> Iterator[str]:
    for row in report["coverage"]:
        total = sum(row["states_s"].values()) if "states_s" in row else None
        spans = [s for s in report["states"] if (s["component"], s["side"]) == (row["component"], row["side"])]
        length = sum(s["stop_s"] - s["start_s"] for s in spans)
        if total is not None and abs(total - length) > 0.01 * max(length, 1.0):
            yield f"coverage of {row['component']} {row['side']} is {total:.1f} s of {length:.1f} s"
        if row["decided_driving_s"] > row["driving_s"] + _SPARE_S:
            yield f"{row['component']} {row['side']} was judged for longer than it drove"


def _open(report: Mapping[str, Any]) -> Iterator[str]:
    """The part of which the verdict says that most of its driving is open, against the table of coverage and the states."""
    for text in report["verdict"]["caveats"]:
        found = re.match(r"(\S+) .+: ([\d.]+) s of its [\d.]+ s of .* were not judged(?: \((.*)\))?; this", text)
        if not found:
            continue
        component, seconds, reason = found.group(1), float(found.group(2)), found.group(3)
        rows = [r for r in report["coverage"] if r["component"] == component]
        if not any(abs(r["driving_s"] - r["decided_driving_s"] - seconds) <= _SPARE_S + 0.01 for r in rows):
            yield f"{component} is not open for {seconds} s of driving: {text!r}"
        spans = [s for s in report["states"] if s["component"] == component and s["reason"] == reason]
        if reason == AS_WELL_HEALTHY:
            spans = [
                f
                for f in report["intervals"]
                if f["component"] == component and sum(h["p"] for h in f["hypotheses"] if h["mode"] == "healthy") >= 0.5
            ]
        length = sum(s["stop_s"] - s["start_s"] for s in spans)
        if reason and length < 0.3 * seconds:
            yield f"its reason holds for {length:.1f} s: {text!r}"


def _chances(fault: Mapping[str, Any]) -> Iterator[str]:
    hypotheses = fault["hypotheses"]
    total = sum(h["p"] for h in hypotheses)
    if hypotheses and abs(total - 1.0) > 0.02:
        yield f"probabilities add up to {total:.3f}"
    named = [h["p"] for h in hypotheses if h["mode"] == fault["mode"] and h["side"] == fault["side"]]
    if named and abs(max(named) - fault["probability"]) > 1e-3:
        yield f"probability {fault['probability']:.3f}, its hypothesis {max(named):.3f}"
    either = fault["side"] == "sensor_or_actuator"
    rows: dict[str, float] = {}
    for h in hypotheses:
        if h["mode"] != "healthy" and (either or h["side"] == fault["side"]):
            rows[h["mode"]] = rows.get(h["mode"], 0.0) + h["p"]
    if rows and rows.get(fault["mode"], 0.0) < max(rows.values()) - 0.01:
        best = max(rows, key=lambda mode: rows[mode])
        yield f"{best} is more probable ({rows[best]:.2f}) than the row it is called ({rows.get(fault['mode'], 0.0):.2f})"
    unclear = bool(candidates_of(fault))  # type: ignore[arg-type]
    if ("unclear" in label_of(fault)) != unclear or ("unclear" in fault_title(fault, HYDRAULIC)) != unclear:  # type: ignore[arg-type]
        yield "heading and title do not agree on whether its kind is clear"
    healthy = sum(h["p"] for h in hypotheses if h["mode"] == "healthy")
    if fault["severity"] != "info" and healthy > 0.5:
        yield f"{fault['severity']} although healthy is more probable ({healthy:.2f})"


def _sizes(fault: Mapping[str, Any], report: Mapping[str, Any]) -> Iterator[str]:
    epsilon, sat = fault["epsilon"], fault["sat"]
    if epsilon is not None:
        if not epsilon["low"] <= epsilon["value"] <= epsilon["high"]:
            yield f"ε̂ {epsilon['value']:.2f} outside of its bounds"
        if fault["mode"] != "outside_table" and not (epsilon["low"] >= 0.0 and epsilon["high"] <= 1.0):
            yield f"ε̂ from {epsilon['low']:.2f} to {epsilon['high']:.2f}"
        if fault["mode"] != "outside_table" and epsilon["high"] <= 0.0:
            yield "a fault that for certain takes nothing away"
        healthy = sum(h["p"] for h in fault["hypotheses"] if h["mode"] == "healthy")
        if fault["mode"] in _TOTAL and epsilon["low"] <= 0.0 and healthy < 0.05:
            yield f"{fault['mode']} with {fault['probability']:.2f}, and bounds of ε̂ that hold a healthy part"
        if fault["mode"] == "no_signal" and epsilon["value"] < 0.9:
            yield f"no signal with ε̂ {epsilon['value']:.2f}"
    if sat is not None:
        least = 0.05 if sat["unit"] == OPENING else min(0.05, 0.5 * report["limits"]["min_sat"])
        if fault["mode"] == "no_signal" and abs(sat["mean"]) > least:
            yield f"no signal, and a reading of {sat['mean']:.2f} {sat['unit']}"
        if not sat["low"] <= sat["mean"] <= sat["high"]:
            yield "saturation term outside of its bounds"
        if sat["unit"] == OPENING and not all(abs(sat[k]) <= 1.0 + 1e-6 for k in ("mean", "low", "high")):
            yield f"an opening of {sat['mean']:.2f} ({sat['low']:.2f} to {sat['high']:.2f})"


def _urgency(fault: Mapping[str, Any], report: Mapping[str, Any]) -> Iterator[str]:
    high = fault["severity"] == "high"
    if fault["advice"].startswith("Stop") != high:
        yield f"severity {fault['severity']} with advice {fault['advice'][:30]!r}"
    either = fault["side"] == "sensor_or_actuator"
    named = [h for h in fault["hypotheses"] if h["mode"] != "healthy" and (either or h["side"] == fault["side"])]
    total = sum(h["p"] for h in named if h["mode"] in _TOTAL)
    size = fault["epsilon"]
    least = (
        None
        if size is None
        else size["low"]
        if fault["mode"] in _TOTAL and fault["tier"] == "direct"
        else size["value"]
    )
    scaled = fault["mode"] in ("inefficient", "outside_table")
    lost = least is not None and least >= _LOST and (scaled or fault["tier"] == "direct")
    risk = total + sum(h["p"] for h in named if lost and h["mode"] in ("inefficient", "outside_table"))
    limits = report["limits"]
    sure = sum(h["p"] for h in named) >= limits["min_probability"]
    brief = fault["side"] == "sensor" and fault["stop_s"] - fault["start_s"] <= limits["brief"]
    waits = any(
        "next service" in text
        for text in (fault["advice"], *(a["text"] for a in report["verdict"]["actions"] if fault["id"] in a["faults"]))
    )
    if waits and not report["verdict"]["cleared"] and fault["stop_s"] - fault["start_s"] > limits["brief"] + _SPARE_S:
        yield "it waits for the next service, and the machine is not cleared"
    if high and risk < _AT_RISK:
        yield f"stopped for, although stuck, silent or lost is {risk:.2f} probable"
    if (
        report["verdict"]["cleared"]
        and total >= 1.0 - _AT_RISK
        and fault["side"] != "sensor"
        and fault["severity"] == "medium"
    ):
        yield f"cleared although it is stuck or silent with {total:.2f}"
    if "no reason to stop" in fault["advice"] and total >= 1.0 - _AT_RISK:
        yield f"no reason to stop although it is stuck or silent with {total:.2f}"
    halved = size is not None and size["high"] >= _HALF and fault["mode"] in ("inefficient", "noisy")
    if "no reason to stop" in fault["advice"] and halved:
        yield f"no reason to stop although ε̂ may be {size['high']:.2f}, which keeps the machine from being cleared"
    if not high and risk > _AT_RISK + _ROUNDED and sure and not brief:
        yield f"stuck, silent or lost is {risk:.2f} probable, and its severity is {fault['severity']}"


def _times(fault: Mapping[str, Any], report: Mapping[str, Any]) -> Iterator[str]:
    start, stop, seen = fault["start_s"], fault["stop_s"], fault["detected_s"]
    if stop <= start:
        yield f"it ends at {stop:.3f} s, before it begins"
    if seen is not None and not start - _SPARE_S <= seen <= stop + _SPARE_S:
        yield f"detected at {seen:.2f} s, and lasts from {start:.2f} to {stop:.2f} s"
    sides = ("sensor", "actuator") if fault["side"] == "sensor_or_actuator" else (fault["side"],)
    inside = healthy = 0.0
    for s in report["states"]:
        if s["component"] == fault["component"] and s["side"] in sides:
            shared = max(0.0, min(stop, s["stop_s"]) - max(start, s["start_s"]))
            inside += shared
            healthy += shared if s["state"] == "healthy" else 0.0
    if inside and healthy > 0.5 * inside and fault["severity"] != "info":
        yield f"its part is called healthy for {100 * healthy / inside:.0f} % of it"


def _words(fault: Mapping[str, Any]) -> Iterator[str]:
    for text in fault["evidence"]:
        found = re.search(r"it was this in (\d+) of 100 cases", text)
        told = any("less probable" in e for e in fault["evidence"])  # something else limits it, and that is said
        if found and not told and abs(int(found.group(1)) - 100 * fault["probability"]) > 1.6:
            yield f"{found.group(0)!r} beside a probability of {fault['probability']:.3f}"
    all_words = " ".join(fault["evidence"])
    if "hardly moved" in all_words and " moved over " in all_words:
        yield "a signal hardly moved, and moved"
    if " moved over 0 " in all_words:
        yield "a signal moved over nothing"
    lost = re.search(r" lost (\d+) %", fault_title(fault, HYDRAULIC))  # type: ignore[arg-type]
    if lost and fault["epsilon"] and abs(int(lost.group(1)) - 100 * fault["epsilon"]["value"]) > 0.6:
        yield f"its title says {lost.group(0)!r}, its table {100 * fault['epsilon']['value']:.0f} %"
    if re.search(r"\b(nan|inf)\b", " ".join((*fault["evidence"], fault["advice"], fault_title(fault, HYDRAULIC)))):  # type: ignore[arg-type]
        yield "a number in it is none"


def _followed(fault: Mapping[str, Any]) -> Iterator[str]:
    """A gain that a sentence gives beside the ε̂ of the table."""
    for text in fault["evidence"]:
        found = re.search(r"followed (\S+) × .*\(95 %: (\S+) to (\S+)\)", text)
        if (
            found
            and fault["epsilon"] is not None
            and not any(x in " ".join(fault["evidence"]) for x in (" stretches (", " pieces that touch "))
        ):
            said = [1.0 - float(x) for x in found.groups()]
            sizes = [fault["epsilon"][k] for k in ("value", "high", "low")]
            if not np.allclose(said, sizes, atol=1e-3):
                yield f"{found.group(0)!r} beside ε̂ {sizes[0]:.3f} ({sizes[2]:.3f} to {sizes[1]:.3f})"


def _terminal(report: Mapping[str, Any]) -> Iterator[str]:
    from rich.console import Console

    console = Console(width=200, record=True, file=io.StringIO(), color_system=None)
    console.print(*verdict_parts(report))  # type: ignore[arg-type]
    shown = " ".join(console.export_text().split())
    title = report["verdict"]["title"]
    if title and title.casefold() not in shown.casefold():
        yield f"the terminal does not show the title {title!r}"
    for fault in report["intervals"][:40]:
        if label_of(fault).lower() not in shown.casefold():  # type: ignore[arg-type]
            yield f"{fault['id']}: the terminal does not show {label_of(fault)!r}"  # type: ignore[arg-type]
