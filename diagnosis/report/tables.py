"""Rows of the report's tables and lists, as the template shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.pages.labels import UNDATED_NS, bounded, clock, grouped, mode_legend, number, sat_text, utc_mark
from diagnosis.report.confidence import headline, judged, sure_of, sure_of_verdict
from diagnosis.report.edges import time_words
from diagnosis.report.judged_parts import judged_sides, kind_of
from diagnosis.results.candidates import label_of
from diagnosis.results.clearing import size_words
from diagnosis.results.document import (
    PAPER_DEFAULTS,
    ActionRow,
    FileRow,
    IntervalRow,
    LoopRow,
    MachineRow,
    MetricsRow,
    MissingRow,
    QualityRow,
    ReportDocument,
    SignalRow,
)
from diagnosis.results.fault_rows import state_label
from diagnosis.results.left_out import only_left_out
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.vocabulary import Kind, Tier, Verdict
from replay.faults import FAULT_STATES, UNDECIDED, FaultMode, State
from replay.machine.quantities import OPENING

_SHOWN = 0.001
_UNFOLDED = 4  # notes and evidence beyond this number fold away

#: What the template is given: markup, text and numbers, no documents.
Context = dict[str, Any]


def machine_name(machine: MachineRow) -> str:
    """Name and identity of the machine."""
    assumed = " (assumed)" if machine["assumed"] and machine["source"] == PAPER_DEFAULTS else ""
    return " · ".join(x for x in (machine["id"], machine["name"] + assumed) if x) or "Unnamed machine"


def context(report: ReportDocument, duration: float) -> Context:
    """Everything that the template shows as text.

    Parameters
    ----------
    report : ReportDocument
        The document with names made visible.
    duration : float
        Length of the mission [s].
    """
    log, limits, tool = report["log"], report["limits"], report["tool"]
    words = words_of(report["machine"])
    checks, folded = _folded(sorted(report["quality"], key=lambda q: q["ok"]))
    return {
        "machine": machine_name(report["machine"]),
        "mission": " + ".join(f["path"] for f in log["files"]) or "no log named",
        "verdict": _verdict(report),
        "facts": _facts(report, duration),
        "faults": [_fault(f, words) for f in report["intervals"]],
        "coverage": _coverage(report),
        "metrics": _metrics(report["metrics"], words),
        "words": words,
        "steered": bool(report["machine"]["axles"]),
        "signals": [_signal(s, words) for s in report["signals"]],
        "missing": _missing(report["missing"]),
        "clearing": _clearing(report),
        "limits_clear_at": report["limits"]["clear_at"],
        "clear_at": f"{100 * report['limits']['clear_at']:.0f} %",
        "quality": checks,
        "quality_folded": folded,
        "files": [_file(f) for f in log["files"]],
        "readings": report["readings"],
        "limits": _limits(report, words),
        "tool": f"{tool['name']} {tool['version']}",
        "schema": report["schema"],
        "modes": [(m, mode_legend(m)) for m in FaultMode],
        "lines": (State.HEALTHY, *(s for s in UNDECIDED if words.part == "wheel" or s is not State.SLIP)),
        "open_loop": log["open_loop"],
        "assumed": report["machine"]["assumed"],
        "machine_file": "" if report["machine"]["source"] == PAPER_DEFAULTS else report["machine"]["source"],
        "min_percent": f"{100 * limits['min_probability']:g} %",
        "judged": any(judged_sides(report).values()),
    }


def _verdict(report: ReportDocument) -> Context:
    verdict = report["verdict"]
    words, answer = headline(report)
    faults = {f["id"]: f for f in report["intervals"]}
    return {
        "state": Verdict(verdict["status"]).symbol,
        "words": words,
        "steered": bool(report["machine"]["axles"]),
        "answer": answer,
        "sure": "" if verdict["actions"] else sure_of_verdict(report),
        "title": verdict["title"] or words,
        "text": verdict["text"],
        "caveats": merged_caveats(verdict["caveats"]),
        "actions": [_action(a, faults, report) for a in verdict["actions"]],
    }


def _fault(fault: IntervalRow, words: MachineWords) -> Context:
    epsilon, sat = fault["epsilon"], fault["sat"]
    figures = []
    if epsilon:
        figures.append(("ε̂", number(epsilon["value"]), f"{number(epsilon['low'])} to {number(epsilon['high'])}"))
    if sat:
        unit = sat["unit"]
        bounds = f"{sat_text(sat['low'], unit, words).partition(' ')[0]} to {sat_text(sat['high'], unit, words)}"
        figures.append(("sat", sat_text(sat["mean"], unit, words), bounds))
        figures.append(("sat r.m.s.", sat_text(sat["rms"], unit, words), ""))
    hypotheses = sorted(fault["hypotheses"], key=lambda h: -h["p"])
    likely = max(1, sum(h["p"] >= _SHOWN for h in hypotheses))
    return {
        **fault,
        "label": label_of(fault),
        "tier": words.evidence(Tier(fault["tier"]), Kind(fault["kind"])),
        "delay": _delay(fault),
        "likely": hypotheses[:likely],
        "unlikely": ", ".join(
            (f"{words.part_name(fault['kind'], h['side'])} " if h["side"] != "none" else "")
            + state_label(h["mode"], h["side"]).lower()
            for h in hypotheses[likely:]
        ),
        "figures": figures,
        "check": fault.get("check", ""),
        "percent": f"{100 * fault['probability']:.1f} %",
    }


def _delay(fault: IntervalRow) -> str:
    detected = fault["detected_s"]
    if detected is None:
        return ""
    return "at once" if detected <= fault["start_s"] else "+" + time_words(detected - fault["start_s"])


def merged_caveats(caveats: Sequence[str]) -> list[str]:
    """Sentences that say the same of several parts as one, with the parts named before the colon."""
    parts: dict[str, list[str]] = {}
    for i, sentence in enumerate(caveats):
        head, colon, tail = sentence.partition(": ")
        parts.setdefault(tail if colon else f"{i}:", []).append(head if colon else sentence)
    return [", ".join(heads) + ("" if tail.endswith(":") else f": {tail}") for tail, heads in parts.items()]


def _folded(quality: Sequence[QualityRow]) -> tuple[list[QualityRow], list[tuple[str, list[QualityRow]]]]:
    """Checks to be read, and apart from them how the data were read: notes and evidence of many channels."""
    shown, folded = list(quality), []
    for name, words in (
        ("Note", "notes on where signals come from"),
        ("Evidence", "lines on what each channel resolves"),
    ):
        rows = [q for q in quality if q["ok"] and q["check"] == name]
        if len(rows) > _UNFOLDED:
            folded.append((f"{len(rows)} {words}", rows))
            shown = [q for q in shown if q not in rows]
    return shown, folded


def _action(action: ActionRow, intervals: Mapping[str, IntervalRow], report: ReportDocument) -> Context:
    faults = [f for f in action["faults"] if f in intervals]
    first = intervals[faults[0]] if faults else None
    return {
        "lead": action.get("lead", ""),
        "text": action["text"].removeprefix(action.get("lead", "")),
        "check": action.get("check", ""),
        "faults": faults,
        "state": first["mode"] if first else "warning",
        "severity": action["severity"],
        "sure": sure_of(first, report) if first else "",
    }


def _facts(report: ReportDocument, duration: float) -> list[tuple[str, str]]:
    machine, log = report["machine"], report["log"]
    facts = [
        ("Machine", machine["id"] or machine["name"] or "unnamed"),
        ("Start (UTC)", utc_mark(log["start_ns"], both=True))
        if not 0 <= log["start_ns"] < UNDATED_NS
        else ("Start", "clock without a date"),
        ("Duration", clock(duration)),
        (words_of(machine).moving.capitalize(), clock(log["driving_s"])),
    ]
    if log["distance_m"] is not None and words_of(machine).speed_unit == "m/s":
        facts.append(("Distance", f"{number(log['distance_m'])} m"))
    facts.append(("Sample rate", f"{number(log['rate_hz'])} Hz"))
    parts = judged(report)
    facts.append(("Judged", parts) if parts else (words_of(machine).parts.capitalize(), _count(machine)))
    return facts


def _count(machine: MachineRow) -> str:
    wheels, axles = machine["wheels"], machine["axles"]
    return str(len(wheels)) + (f", {len(axles)} steering" if axles else "")


def _coverage(report: ReportDocument) -> list[Context]:
    rows, why, words = [], _why_undecided(report), words_of(report["machine"])
    loss = {(x["component"], x["side"]): bounded(x["epsilon"]) for x in report["loss"] if not x["relative"]}
    for row in report["coverage"]:
        key, seconds = (row["component"], row["side"]), row["seconds"]
        total = sum(seconds.values())
        healthy = seconds.get(State.HEALTHY, 0.0)
        faulty = sum(v for k, v in seconds.items() if k in FAULT_STATES)
        rows.append(
            {
                "component": row["component"],
                "part": words.part_name(kind_of(row["component"], report["machine"]), row["side"]),
                "parts": [(k, v, 100 * v / total) for k, v in seconds.items() if total > 0 and v > 0],
                "healthy": healthy,
                "faulty": faulty,
                "open": total - healthy - faulty,
                "driving": row["decided_driving_s"],
                "loss": loss.get(key, ""),
                "why": why.get(key, []),
            }
        )
    return rows


def _clearing(report: ReportDocument) -> list[Context]:
    """Checks behind an all-clear, those first that do not clear their part."""
    rows, words = [], words_of(report["machine"])
    for c in sorted(report["clearing"], key=lambda c: c["passed"]):
        start, stop = c["start_s"], c["stop_s"]
        rows.append(
            {
                "ok": c["passed"],
                "part": words.part_words(kind_of(c["component"], report["machine"]), c["component"], c["side"]),
                "asked": c["asked"],
                "worst": "not shown" if c["worst"] is None else size_words(c["check"], c["worst"]),
                "limit": size_words(c["check"], c["limit"]),
                "when": "" if start is None or stop is None else f"{start:.1f}–{stop:.1f} s",
                "shows": "" if c["shows"] is None else f"from {100 * c['shows']:.0f} %",
            }
        )
    return rows


def _why_undecided(report: ReportDocument) -> dict[tuple[str, str], list[str]]:
    """For each component and side, the two reasons that cost most time without a decision."""
    seconds: dict[tuple[str, str], dict[str, float]] = {}
    for s in report["states"]:
        if s["state"] in UNDECIDED:
            reason = s["reason"] or state_label(s["state"]).lower()
            mine = seconds.setdefault((s["component"], s["side"]), {})
            mine[reason] = mine.get(reason, 0.0) + s["stop_s"] - s["start_s"]
    return {
        key: [f"{reason} ({length:.1f} s)" for reason, length in sorted(mine.items(), key=lambda r: -r[1])[:2]]
        for key, mine in seconds.items()
    }


def _cells(row: LoopRow, commanded: bool) -> list[str]:
    error, effort = row["tracking_error"], row["control_effort"]
    cells = [number(error["mission"]), number(error["driving"])]
    return cells + [number(None if x is None else 100 * x) for x in (effort["mission"], effort["driving"]) if commanded]


#: Unit of each limit of the machine file; absent: a plain number. ``{speed}`` is the machine's own.
_LIMIT_UNITS = {
    "brief": "s",
    "min_assessed": "s",
    "driving_speed": "{speed}",
    "min_sat": "{speed}{angles}, of commands as a share",
}
_SHARES = ("min_probability", "clear_at")


def _limits(report: ReportDocument, words: MachineWords) -> list[tuple[str, str]]:
    """Limits of the machine file with their units."""
    out = []
    angles = ", of angles in rad" if report["machine"]["axles"] else ""
    for key, value in report["limits"].items():
        unit = _LIMIT_UNITS.get(key, "").replace("{speed}", words.speed_unit).replace("{angles}", angles)
        size = value if isinstance(value, float) else float("nan")
        out.append(
            (key.replace("_", " "), f"{100 * size:g} %" if key in _SHARES else f"{number(value)} {unit}".rstrip())
        )
    return out


def _metrics(metrics: MetricsRow, words: MachineWords) -> Context:
    rows = [*metrics["wheels"].items(), ("Average", metrics["average"])]
    paper = [
        (p["controller"], [number(p["tracking_error"]), number(100 * p["control_effort"]), number(p["parameters"])])
        for p in (metrics["paper"] if words.drive == "valve" else ())
    ]
    some = any(q["mission"] is not None for _, r in rows for q in (r["tracking_error"], r["control_effort"]))
    effort = any(r["control_effort"]["mission"] is not None for _, r in rows)
    shown = [(name, _cells(values, effort)) for name, values in rows] if some else []
    return {"rows": shown, "effort": effort, "paper": paper}


def _signal(signal: SignalRow, words: MachineWords) -> Context:
    unit, recorded, missing, step = signal["unit"], signal["recorded_unit"], signal["missing_share"], signal["lsb"]
    if unit in (OPENING, words.unit(OPENING)):
        unit, step = words.percent.strip(), None if step is None else 100 * step
    return {
        "name": signal["name"],
        "channel": signal["channel"] or "–",
        "unit": unit if unit == recorded or not recorded else f"{unit} (recorded {recorded})",
        "rate": f"{number(signal['rate_hz'], 4)} Hz",
        "samples": grouped(signal["samples"]),
        "gaps": f"{signal['gaps']}, longest {number(signal['longest_gap_s'])} s" if signal["gaps"] else "none",
        "missing": "–" if missing is None else f"{100 * missing:.2g} %",
        "lsb": f"{number(step)} {unit}" if step else "–",
        "found": "guessed" if signal["guessed"] else "given",
        "poor": missing is not None and missing > 0.01,
    }


def _missing(rows: Sequence[MissingRow]) -> list[Context]:
    """Missing signals that cost the same stand in one row."""
    names: dict[str, list[str]] = {}
    for row in rows:
        names.setdefault(row["cost"], []).append(row["name"])
    return [{"names": n, "cost": cost} for cost, n in names.items()]


def _file(file: FileRow) -> Context:
    return {
        "path": file["path"],
        "format": file["format"],
        "sha256": file["sha256"] or "–",
        "size": f"{grouped(file['bytes'])} bytes",
        "notes": [*file["damage"], *file["notes"]],
        "heading": "Left out" if only_left_out(file["damage"]) else "Damage" if file["damage"] else "Notes",
    }
