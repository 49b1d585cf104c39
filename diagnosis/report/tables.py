"""Rows of the report's tables and lists, with absent fields filled so that the template never asks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.pages.labels import (
    FAULT_MODES,
    UNDECIDED,
    VERDICTS,
    bounded,
    clock,
    grouped,
    known,
    number,
    part,
    sat_text,
    state_label,
    utc,
)
from diagnosis.report.compared_channels import tier_words
from diagnosis.report.confidence import headline, judged, sure_of, sure_of_verdict
from diagnosis.report.edges import time_words
from diagnosis.report.machine_picture import judged_sides
from diagnosis.report.timeline import kind_of

_SHOWN = 0.001
_TOLD = 4  # notes and evidence beyond this number fold away


def machine_name(report: Mapping[str, Any]) -> str:
    """Name and identity of the machine."""
    machine = report.get("machine") or {}
    both = [str(machine[k]) for k in ("id", "name") if machine.get(k)]
    return " · ".join(both) or "Unnamed machine"


def repaired(report: Mapping[str, Any]) -> dict[str, Any]:
    """Report without estimates that have no value: a null in ε̂, the saturation term or a probability."""

    def complete(estimate: Any) -> Any:
        return estimate if estimate and all(v is not None for v in estimate.values()) else None

    faults = [
        {
            **f,
            "epsilon": complete(f.get("epsilon")),
            "sat": complete(f.get("sat")),
            "hypotheses": [h for h in f.get("hypotheses") or () if h.get("p") is not None],
        }
        for f in report.get("intervals") or ()
    ]
    return {**report, "intervals": faults}


def context(report: Mapping[str, Any], duration: float) -> dict[str, Any]:
    """Everything that the template shows as text.

    Parameters
    ----------
    report : Mapping[str, Any]
        The parsed ``report.json`` with names made visible.
    duration : float
        Length of the mission [s].
    """
    verdict = report.get("verdict") or {}
    state, _ = VERDICTS.get(verdict.get("status", "not_assessed"), VERDICTS["not_assessed"])
    words, answer = headline(report)
    faults = [_fault(f) for f in report.get("intervals") or ()]
    worst = {f["id"]: f for f in report.get("intervals") or ()}
    quality = sorted(
        ({"ok": True, "effect": "", "result": "", "check": "", **q} for q in report.get("quality") or ()),
        key=lambda q: bool(q["ok"]),
    )
    checks, folded = _folded(quality)
    log, limit = report.get("log") or {}, (report.get("limits") or {}).get("min_probability")
    return {
        "machine": machine_name(report),
        "mission": " + ".join(f.get("path", "") for f in log.get("files") or ()) or "no log named",
        "verdict": {
            "state": state,
            "words": words,
            "answer": answer,
            "sure": "" if verdict.get("actions") else sure_of_verdict(report),
            "title": verdict.get("title") or words,
            "text": verdict.get("text") or "",
            "caveats": merged_caveats(verdict.get("caveats") or ()),
            "actions": [_action(a, worst, report) for a in verdict.get("actions") or ()],
        },
        "facts": _facts(report, log, duration),
        "faults": faults,
        "coverage": _coverage(report),
        "metrics": _metrics(report.get("metrics") or {}),
        "signals": [_signal(s) for s in report.get("signals") or ()],
        "missing": _missing(report.get("missing") or ()),
        "quality": checks,
        "quality_folded": folded,
        "files": [_file(f) for f in log.get("files") or ()],
        "readings": [{"detail": "", "value": "", **r} for r in report.get("readings") or ()],
        "limits": [(k.replace("_", " "), _plain(v)) for k, v in (report.get("limits") or {}).items()],
        "tool": " ".join(str((report.get("tool") or {}).get(k, "")) for k in ("name", "version")).strip(),
        "schema": report.get("schema", ""),
        "undecided": UNDECIDED,
        "open_loop": bool(log.get("open_loop")),
        "min_percent": f"{100 * limit:g} %" if isinstance(limit, int | float) else "",
        "judged": any(judged_sides(report).values()),
    }


def _plain(value: Any) -> str:
    return number(value) if isinstance(value, int | float) and not isinstance(value, bool) else str(value)


def _fault(fault: Mapping[str, Any]) -> dict[str, Any]:
    epsilon, sat = fault.get("epsilon"), fault.get("sat")
    figures = []
    if epsilon:
        figures.append(("ε̂", number(epsilon["value"]), f"{number(epsilon['low'])} to {number(epsilon['high'])}"))
    if sat:
        unit = sat.get("unit", "")
        bounds = f"{sat_text(sat['low'], unit)} to {sat_text(sat['high'], unit)}"
        figures.append(("sat", sat_text(sat["mean"], unit), bounds))
        figures.append(("sat r.m.s.", sat_text(sat["rms"], unit), ""))
    p = fault.get("probability")
    hypotheses = sorted(fault.get("hypotheses") or (), key=lambda h: -h["p"])
    likely = max(1, sum(h["p"] >= _SHOWN for h in hypotheses))
    return {
        **fault,
        "advice": fault.get("advice") or "",
        "evidence": fault.get("evidence") or [],
        "tier": tier_words(fault),
        "delay": _delay(fault),
        "likely": hypotheses[:likely],
        "unlikely": ", ".join(
            f"{state_label(h['mode'], h['side']).lower()} ({h['side']})" for h in hypotheses[likely:]
        ),
        "figures": figures,
        "percent": f"{100 * p:.1f} %" if p is not None else "–",
    }


def _delay(fault: Mapping[str, Any]) -> str:
    detected = fault.get("detected_s")
    return (
        ""
        if detected is None
        else "at once"
        if detected <= fault["start_s"]
        else "+" + time_words(detected - fault["start_s"])
    )


def merged_caveats(caveats: Sequence[str]) -> list[str]:
    """Sentences that say the same of several parts as one, with the parts named before the colon."""
    parts: dict[str, list[str]] = {}
    for i, sentence in enumerate(caveats):
        head, colon, tail = sentence.partition(": ")
        parts.setdefault(tail if colon else f"{i}:", []).append(head if colon else sentence)
    return [", ".join(heads) + ("" if tail.endswith(":") else f": {tail}") for tail, heads in parts.items()]


def _folded(
    quality: Sequence[Mapping[str, Any]],
) -> tuple[list[Mapping[str, Any]], list[tuple[str, list[Mapping[str, Any]]]]]:
    """Checks to be read, and what only tells how the data were read: notes and evidence of many channels."""
    shown, folded = list(quality), []
    for name, words in (
        ("Note", "notes on where signals come from"),
        ("Evidence", "lines on what each channel resolves"),
    ):
        rows = [q for q in quality if q["ok"] and q["check"] == name]
        if len(rows) > _TOLD:
            folded.append((f"{len(rows)} {words}", rows))
            shown = [q for q in shown if q not in rows]
    return shown, folded


def _action(
    action: Mapping[str, Any], intervals: Mapping[str, Mapping[str, Any]], report: Mapping[str, Any]
) -> dict[str, Any]:
    faults = [f for f in action.get("faults") or () if f in intervals]
    first = intervals[faults[0]] if faults else None
    return {
        "text": action.get("text", ""),
        "faults": faults,
        "state": known(first["mode"]) if first else "warning",
        "severity": action.get("severity", ""),
        "sure": sure_of(first, report) if first else "",
    }


def _facts(report: Mapping[str, Any], log: Mapping[str, Any], duration: float) -> list[tuple[str, str]]:
    machine = report.get("machine") or {}
    facts = [
        ("Machine", str(machine.get("id") or machine.get("name") or "unnamed")),
        ("Start (UTC)", utc(log.get("start_ns"))),
        ("Duration", clock(duration)),
    ]
    if log.get("driving_s") is not None:
        facts.append(("Driving", clock(log["driving_s"])))
    if log.get("distance_m") is not None:
        facts.append(("Distance", f"{number(log['distance_m'])} m"))
    if log.get("rate_hz"):
        facts.append(("Sample rate", f"{number(log['rate_hz'])} Hz"))
    parts = judged(report)
    facts.append(("Judged", parts) if parts else ("Wheels", _count(report)))
    return facts


def _count(report: Mapping[str, Any]) -> str:
    machine = report.get("machine") or {}
    wheels, axles = machine.get("wheels") or (), machine.get("axles") or ()
    return str(len(wheels)) + (f", {len(axles)} steering" if axles else "")


def _coverage(report: Mapping[str, Any]) -> list[dict[str, Any]]:
    machine, rows, why = report.get("machine") or {}, [], _why_undecided(report)
    loss = {(x["component"], x["side"]): x.get("epsilon") for x in report.get("loss") or ()}
    for row in report.get("coverage") or ():
        seconds = {k: float(v or 0.0) for k, v in (row.get("seconds") or {}).items()}
        total = sum(seconds.values())
        healthy = seconds.get("healthy", 0.0)
        faulty = sum(v for k, v in seconds.items() if k in FAULT_MODES)
        parts = [(known(k), v, 100 * v / total) for k, v in seconds.items() if total > 0 and v > 0]
        kind = row.get("kind") or kind_of(row["component"], machine)
        rows.append(
            {
                "component": row["component"],
                "part": part(kind, row["side"]),
                "parts": parts,
                "healthy": healthy,
                "faulty": faulty,
                "open": total - healthy - faulty,
                "driving": row.get("decided_driving_s"),
                "loss": _bounds(loss.get((row["component"], row["side"]))),
                "why": why.get((row["component"], row["side"]), []),
            }
        )
    return rows


def _bounds(epsilon: Mapping[str, Any] | None) -> str:
    if not epsilon or any(epsilon.get(k) is None for k in ("value", "low", "high")):
        return ""
    return bounded(epsilon)


def _why_undecided(report: Mapping[str, Any]) -> dict[tuple[str, str], list[str]]:
    """For each component and side, the two reasons that cost most time without a decision."""
    seconds: dict[tuple[str, str], dict[str, float]] = {}
    for s in report.get("states") or ():
        if s["state"] in UNDECIDED:
            reason = s.get("reason") or state_label(s["state"]).lower()
            mine = seconds.setdefault((s["component"], s["side"]), {})
            mine[reason] = mine.get(reason, 0.0) + s["stop_s"] - s["start_s"]
    return {
        key: [f"{reason} ({length:.1f} s)" for reason, length in sorted(mine.items(), key=lambda r: -r[1])[:2]]
        for key, mine in seconds.items()
    }


def _cells(row: Mapping[str, Any]) -> list[str]:
    return [
        number((row.get(q) or {}).get(when))
        for q in ("tracking_error", "control_effort")
        for when in ("mission", "driving")
    ]


def _metrics(metrics: Mapping[str, Any]) -> dict[str, Any]:
    rows = [(wheel, _cells(values)) for wheel, values in (metrics.get("wheels") or {}).items()]
    if metrics.get("average"):
        rows.append(("Average", _cells(metrics["average"])))
    keys = ("tracking_error", "control_effort", "parameters")
    paper = [(str(p.get("controller", "")), [number(p.get(k)) for k in keys]) for p in metrics.get("paper") or ()]
    return {"rows": rows, "paper": paper}


def _signal(signal: Mapping[str, Any]) -> dict[str, Any]:
    unit, recorded = signal.get("unit") or "", signal.get("recorded_unit") or ""
    missing = signal.get("missing_share")
    return {
        "name": signal["name"],
        "channel": signal.get("channel") or "–",
        "unit": unit if unit == recorded or not recorded else f"{unit} (recorded {recorded})",
        "rate": f"{number(signal.get('rate_hz'), 4)} Hz",
        "samples": grouped(signal["samples"]) if isinstance(signal.get("samples"), int) else "–",
        "gaps": _gaps(signal),
        "missing": f"{100 * missing:.2g} %" if isinstance(missing, int | float) else "–",
        "lsb": f"{number(signal.get('lsb'))} {unit}" if signal.get("lsb") else "–",
        "found": "guessed" if signal.get("guessed") else "given",
        "poor": bool(missing and missing > 0.01),
    }


def _missing(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Missing signals that cost the same stand in one row."""
    names: dict[str, list[str]] = {}
    for row in rows:
        names.setdefault(row.get("cost") or "", []).append(row["name"])
    return [{"names": n, "cost": cost} for cost, n in names.items()]


def _gaps(signal: Mapping[str, Any]) -> str:
    gaps: Any = signal.get("gaps")
    if not gaps:
        return "none" if gaps == 0 else "–"
    return f"{gaps}, longest {number(signal.get('longest_gap_s'))} s"


def _file(file: Mapping[str, Any]) -> dict[str, Any]:
    size = file.get("bytes")
    notes: Sequence[str] = [*(file.get("damage") or ()), *(file.get("notes") or ())]
    return {
        "path": file.get("path", ""),
        "format": file.get("format", ""),
        "sha256": file.get("sha256") or "–",
        "size": f"{grouped(size)} bytes" if isinstance(size, int) else "–",
        "notes": notes,
        "damaged": bool(file.get("damage")),
    }
