"""Statements of one result that cannot all be true: verdict, severity, hypotheses, advice, sizes, times, states, words."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cli.tables.verdict import verdict_parts
from diagnosis.pages.labels import fault_title
from diagnosis.results.candidates import candidates_of, label_of
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Severity
from replay.machine.quantities import OPENING

_TOTAL = ("stuck", "no_signal")
_AT_RISK = 0.75
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
    out = [*_verdict(report), *_actions(report), *_coverage(report), *_terminal(report)]
    for fault in report["intervals"]:
        name = f"{fault['id']} {fault['component']} {fault['side']} {fault['mode']}"
        out += [f"{name}: {text}" for text in (*_chances(fault), *_sizes(fault), *_urgency(fault, report))]
        out += [f"{name}: {text}" for text in (*_times(fault, report), *_words(fault), *_followed(fault))]
        out += [f"{name}: {text}" for text in _plots(fault, report, columns or {})]
    out += _healthy_plots(report, columns or {})
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
        told = bool(verdict["to_clear"]) or verdict["not_cleared"].endswith("may not answer")
        if not told or not all(row["act"] for row in verdict["to_clear"]):
            yield "not cleared, and nobody is told what would clear it"
    if verdict["status"] == "not_assessed" and len(re.findall(r"[.](?= [A-Z]|$)", verdict["text"])) > 2:
        yield f"more than two sentences: {verdict['text']!r}"
    counts = [
        int(n)
        for n in re.findall(r"(\d+) faults? to repair|(\d+) (?:faults? )?to watch", verdict["title"])
        for n in n
        if n
    ]
    if counts and counts != [n for n in (high, watch) if n]:
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


def _sizes(fault: Mapping[str, Any]) -> Iterator[str]:
    epsilon, sat = fault["epsilon"], fault["sat"]
    if epsilon is not None:
        if not epsilon["low"] <= epsilon["value"] <= epsilon["high"]:
            yield f"ε̂ {epsilon['value']:.2f} outside of its bounds"
        if fault["mode"] != "outside_table" and not (epsilon["low"] >= 0.0 and epsilon["high"] <= 1.0):
            yield f"ε̂ from {epsilon['low']:.2f} to {epsilon['high']:.2f}"
        if fault["mode"] != "outside_table" and epsilon["high"] <= 0.0:
            yield "a fault that for certain takes nothing away"
        if fault["mode"] == "no_signal" and epsilon["value"] < 0.9:
            yield f"no signal with ε̂ {epsilon['value']:.2f}"
    if sat is not None:
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
    if high and risk < _AT_RISK:
        yield f"stopped for, although stuck, silent or lost is {risk:.2f} probable"
    if not high and risk >= _AT_RISK and sure and not brief:
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
        if found and abs(int(found.group(1)) - 100 * fault["probability"]) > 1.6:
            yield f"{found.group(0)!r} beside a probability of {fault['probability']:.3f}"
    if re.search(r"\b(nan|inf)\b", " ".join((*fault["evidence"], fault["advice"], fault_title(fault, HYDRAULIC)))):  # type: ignore[arg-type]
        yield "a number in it is none"


def _followed(fault: Mapping[str, Any]) -> Iterator[str]:
    """A gain that a sentence gives beside the ε̂ of the table."""
    for text in fault["evidence"]:
        found = re.search(r"followed (\S+) × .*\(95 %: (\S+) to (\S+)\)", text)
        if found and fault["epsilon"] is not None and " stretches (" not in " ".join(fault["evidence"]):
            said = [1.0 - float(x) for x in found.groups()]
            sizes = [fault["epsilon"][k] for k in ("value", "high", "low")]
            if not np.allclose(said, sizes, atol=1e-3):
                yield f"{found.group(0)!r} beside ε̂ {sizes[0]:.3f} ({sizes[2]:.3f} to {sizes[1]:.3f})"


def _rows(columns: Mapping[str, NDArray[Any]], start: float, stop: float) -> NDArray[np.bool_]:
    """Samples between two times, whatever their last digit."""
    t = columns["t"]
    spare = 0.5 * float(t[1] - t[0])
    return np.asarray((t >= start - spare) & (t < stop - spare))


def _sides(fault: Mapping[str, Any]) -> tuple[str, ...]:
    return ("sensor", "actuator") if fault["side"] == "sensor_or_actuator" else (fault["side"],)


def _plots(fault: Mapping[str, Any], report: Mapping[str, Any], columns: Mapping[str, NDArray[Any]]) -> Iterator[str]:
    """What the plots of a fault show during it, against the finding: ε̂, its band, the probability of a fault."""
    for side in _sides(fault) if "t" in columns else ():
        base, inside = (
            f"evidence.{fault['component']}.{side}.",
            _rows(columns, fault["start_s"], fault["stop_s"]),
        )
        for other in report["intervals"]:
            if other["component"] == fault["component"] and side in _sides(other) and other["id"] != fault["id"]:
                inside &= ~_rows(columns, other["start_s"], other["stop_s"])
        if not inside.any() or not any(name.startswith(base) for name in columns):
            continue
        for leaf, key in (("epsilon", "value"), ("epsilon_low", "low"), ("epsilon_high", "high")):
            said = np.nan if fault["epsilon"] is None else fault["epsilon"][key]
            drawn = columns.get(base + leaf, np.full(inside.size, np.nan))[inside]
            if not np.allclose(drawn, said, atol=1e-3, equal_nan=True):
                yield f"its plot shows {leaf} from {np.nanmin(drawn):.2f} to {np.nanmax(drawn):.2f}, its table {said:.2f}"
        chance = columns.get(base + "probability")
        if chance is not None and fault["severity"] != "info" and np.isfinite(chance[inside]).any():
            mean = float(np.nanmean(chance[inside]))
            if mean < (0.25 if len(_sides(fault)) > 1 else 0.5):  # one that may be either's divides it
                yield f"its plot shows it not healthy with {mean:.2f} on average"


def _healthy_plots(report: Mapping[str, Any], columns: Mapping[str, NDArray[Any]]) -> Iterator[str]:
    """A loss of effectiveness, or a sure fault, in plots of a part while it is called healthy or is not judged."""
    for s in report["states"] if "t" in columns else ():
        base, rows = f"evidence.{s['component']}.{s['side']}.", _rows(columns, s["start_s"], s["stop_s"])
        for f in report["intervals"]:
            if f["component"] == s["component"] and s["side"] in _sides(f):
                rows &= ~_rows(columns, f["start_s"], f["stop_s"])
        chance = columns.get(base + "probability")
        undecided = ("not_excited", "masked", "slip", "no_data", "not_assessed")
        if chance is not None and s["state"] in undecided and np.isfinite(chance[rows]).any():
            yield f"{s['component']} {s['side']} is {s['state']} from {s['start_s']:.1f} s on, its plot shows a probability"
        loss = columns.get(base + "epsilon")
        if loss is None or not rows.any():
            continue
        if s["state"] == "healthy" and (loss[rows] != 0.0).any():
            yield f"{s['component']} {s['side']} is healthy from {s['start_s']:.1f} s on, its plot shows ε̂ {np.nanmax(loss[rows]):.2f}"
        if s["state"] != "healthy" and np.isfinite(loss[rows]).any():
            yield f"{s['component']} {s['side']} is {s['state']} from {s['start_s']:.1f} s on, its plot shows ε̂ {np.nanmax(loss[rows]):.2f}"


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
