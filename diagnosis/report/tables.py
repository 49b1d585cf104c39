"""Rows of the report's tables and lists, as the template shows them."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import Any

from markupsafe import Markup

from diagnosis.pages.labels import UNDATED_NS, clock, mode_legend, number, sat_text, utc, utc_mark
from diagnosis.report.confidence import (
    going_out,
    headline,
    held_by_fleet,
    holds_open,
    is_repaired,
    judged,
    judged_means,
    may_go_out,
    percent,
    sure_of_action,
    sure_of_verdict,
)
from diagnosis.report.data_tables import (
    check_rows,
    coverage_rows,
    file_row,
    limit_rows,
    loop_tables,
    missing_rows,
    signal_row,
)
from diagnosis.report.edges import time_words
from diagnosis.report.fault_times import times_words
from diagnosis.report.judged_parts import judged_sides
from diagnosis.report.near_the_top import law_doubt, other_side_words, positions_fact
from diagnosis.report.second_measurements import JOINT, by_position, second_of
from diagnosis.results.candidates import UNCLEAR, candidates_of, label_of, symbol_of
from diagnosis.results.document import (
    PAPER_DEFAULTS,
    ActionRow,
    IntervalRow,
    MachineRow,
    QualityRow,
    ReportDocument,
    ToClearRow,
    VerdictRow,
)
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.open_sizes import is_open
from diagnosis.results.size_rows import SatRow
from diagnosis.results.sizes import loss_known
from diagnosis.results.vocabulary import Kind, Severity, Tier, Verdict
from replay.faults import UNDECIDED, FaultMode, Side, State

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
    words, logged = words_of(report["machine"]), {s["name"] for s in report["signals"]}
    checks, folded = _folded(sorted(report["quality"], key=lambda q: q["ok"]))
    return {
        "machine": machine_name(report["machine"]),
        "mission": " + ".join(f["path"] for f in log["files"]) or "no log named",
        "verdict": _verdict(report),
        "when": _when(report, duration),
        "facts": _facts(report, duration),
        "means": judged_means(report),
        "moved": clock(log["driving_s"]),
        "faults": [_fault(f, words, logged) for f in report["intervals"]],
        "coverage": coverage_rows(report),
        "metrics": loop_tables(report["metrics"], words),
        "words": words,
        "steered": bool(report["machine"]["axles"]),
        "signals": [signal_row(s, words) for s in report["signals"]],
        "missing": missing_rows(report["missing"]),
        "clearing": check_rows(report),
        "limits_clear_at": report["limits"]["clear_at"],
        "clear_at": f"{100 * report['limits']['clear_at']:.0f} %",
        "quality": checks,
        "quality_folded": folded,
        "files": [file_row(f) for f in log["files"]],
        "readings": report["readings"],
        "limits": limit_rows(report, words),
        "tool": f"{tool['name']} {tool['version']}",
        "schema": report["schema"],
        "modes": [
            *((m, mode_legend(m)) for m in FaultMode),
            *([("warning", UNCLEAR.capitalize())] if any(candidates_of(f) for f in report["intervals"]) else []),
        ],
        "lines": (State.HEALTHY, *(s for s in UNDECIDED if words.part == "wheel" or s is not State.SLIP)),
        "open_loop": log["open_loop"],
        "assumed": report["machine"]["assumed"],
        "machine_file": "" if report["machine"]["source"] == PAPER_DEFAULTS else report["machine"]["source"],
        "law_doubt": law_doubt(report),
        "positions": positions_fact(report),
        "min_percent": f"{100 * limits['min_probability']:g} %",
        "judged": any(judged_sides(report).values()),
    }


def _verdict(report: ReportDocument) -> Context:
    verdict = report["verdict"]
    words, _ = headline(report)
    blocked = (holds_open(report) and may_go_out(verdict)) or is_repaired(report) or held_by_fleet(report) is not None
    faults = {f["id"]: f for f in report["intervals"]}
    return {
        "state": (Verdict.NOT_ASSESSED if blocked else Verdict(verdict["status"])).symbol,
        "words": words,
        "steered": bool(report["machine"]["axles"]),
        "going_out": going_out(report),
        "sure": "" if verdict["actions"] else sure_of_verdict(report),
        "title": (verdict["title"] or words) + (", repaired since" if is_repaired(report) else ""),
        "text": verdict["text"],
        "caveats": merged_caveats(other_caveats(verdict)),
        "to_clear": clearing_sentences(verdict),
        "actions": [_action(a, faults, report) for a in verdict["actions"]],
    }


def _fault(fault: IntervalRow, words: MachineWords, logged: Container[str]) -> Context:
    epsilon, sat = fault["epsilon"], fault["sat"]
    figures = []
    if epsilon:
        known = loss_known(epsilon["low"], epsilon["high"])  # else the value is the middle of what may be anything
        value = number(epsilon["value"]) if known else "not known"
        figures.append(("ε̂", value, f"{number(epsilon['low'])} to {number(epsilon['high'])}"))
    if sat:
        unit = sat["unit"]
        bounds = f"{sat_text(sat['low'], unit, words).partition(' ')[0]} to {sat_text(sat['high'], unit, words)}"
        figures.append(("sat", sat_text(sat["mean"], unit, words), bounds))
        if FaultMode(fault["mode"]).varying:
            figures.append(_noise(fault, sat, words))
    hypotheses = sorted(fault["hypotheses"], key=lambda h: -h["p"])
    likely = max(1, sum(h["p"] >= _SHOWN for h in hypotheses))
    return {
        **fault,
        "label": label_of(fault),
        "symbol": symbol_of(fault),
        "tier": JOINT
        if by_position(fault)
        else words.evidence(Tier(fault["tier"]), Kind(fault["kind"]), second_of(fault, logged)),
        "delay": _delay(fault),
        "likely": hypotheses[:likely],
        "both": len({h["side"] for h in hypotheses} & {*Side.SENSOR_OR_ACTUATOR.sides, Side.SENSOR_OR_ACTUATOR}) > 1,
        "unlikely": ", ".join(
            (f"{words.part_name(fault['kind'], h['side'])} " if h["side"] != "none" else "")
            + state_label(h["mode"], h["side"]).lower()
            for h in hypotheses[likely:]
        ),
        "figures": figures,
        "check": fault.get("check", ""),
        "size_note": fault.get("size_note", ""),
        "percent": percent(fault["probability"]),
    }


def _noise(fault: IntervalRow, sat: SatRow, words: MachineWords) -> tuple[str, str, str]:
    """How large the noise of a fault is: that of the saturation term, or of what it adds where ε̂ is open."""
    epsilon = fault["epsilon"]
    if epsilon and is_open(epsilon["low"], epsilon["high"]):
        added = sat_text(epsilon["value"] * sat["rms"], sat["unit"], words)
        return "ε·sat r.m.s.", added, "what the noise adds; ε, which is open, divides it into ε and sat"
    return "sat r.m.s.", sat_text(sat["rms"], sat["unit"], words), "the rest’s, divided by ε̂"


def _delay(fault: IntervalRow) -> str:
    detected = fault["detected_s"]
    if detected is None:
        return ""
    return "at once" if detected <= fault["start_s"] else "+" + time_words(detected - fault["start_s"])


def other_caveats(verdict: VerdictRow) -> list[str]:
    """Caveats but those that stand beside what would clear them."""
    said = {row["reason"].rstrip(".") for row in verdict.get("to_clear", [])}
    return [text for text in verdict["caveats"] if text.rstrip(".") not in said]


def clearing_sentences(verdict: VerdictRow) -> list[tuple[str, str]]:
    """What keeps the machine from being cleared and what would clear it, but for what the verdict's own sentences and actions say."""
    text = verdict["text"]
    rows = [
        r for r in verdict.get("to_clear", []) if not _said(r, text) and not (verdict["actions"] and r.get("fault"))
    ]
    return [(_begun(row["reason"]), "" if row["act"] in text else row["act"]) for row in rows]


def _said(row: ToClearRow, text: str) -> bool:
    """Whether the verdict's sentences give a reason, or why parts were not judged together with what would clear them."""
    why, reason = row.get("why", ""), row["reason"].rstrip(".")
    told = reason in text or (f"{reason[:1].lower()}{reason[1:]}" in text and row["act"] in text)
    return told or (bool(why) and why in text and row["act"] in text)


def _begun(text: str) -> str:
    """A sentence with its first letter large, but for a channel's name."""
    return text if "." in text.partition(" ")[0] else text[:1].upper() + text[1:]


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
        "state": symbol_of(first) if first else "warning",
        "severity": action["severity"],
        "sure": sure_of_action([intervals[f] for f in faults], report) if first else "",
        "of": f" of {first['id']}" if first and len(faults) > 1 else "",
        "when": times_words([intervals[f] for f in faults], report),
        "other": other_side_words([intervals[f] for f in faults], report) if first else "",
    }


def _when(report: ReportDocument, duration: float) -> Markup:
    """Begin, end and length of the mission, for the first screen."""
    start = report["log"]["start_ns"]
    if abs(start) < UNDATED_NS:
        return Markup("Clock without a date, {}").format(clock(duration))
    end = start + round(duration * 1e9)
    same = utc(start)[:10] == utc(end)[:10]
    until = Markup("<time>{}</time>").format(utc(end)) if not same else Markup("{}").format(utc(end)[11:19])
    return Markup("{} to {} UTC, {}").format(utc_mark(start), until, clock(duration))


def _facts(report: ReportDocument, duration: float) -> list[tuple[str, str]]:
    machine, log = report["machine"], report["log"]
    facts = [
        ("Machine", machine["id"] or machine["name"] or "unnamed"),
        ("Start (UTC)", utc_mark(log["start_ns"], both=True))
        if abs(log["start_ns"]) >= UNDATED_NS
        else ("Start", "clock without a date"),
        ("Duration", clock(duration)),
        (words_of(machine).moving.capitalize(), clock(log["driving_s"])),
    ]
    if log["distance_m"] is not None and words_of(machine).speed_unit == "m/s":
        note = log.get("distance_note", "")
        facts.append(("Distance", f"{number(log['distance_m'])} m{f', {note}' if note else ''}"))
    facts.append(("Sample rate", f"{number(log['rate_hz'])} Hz"))
    faulty = {(f["component"], f["side"]) for f in report["intervals"] if f["severity"] != Severity.INFO}
    if faulty:
        spells = sum(f["severity"] != Severity.INFO for f in report["intervals"])
        more = f", {spells} spells" if spells != len(faulty) else ""
        facts.append(("Faulty", f"{len(faulty)} part{'s' if len(faulty) > 1 else ''}{more}"))
    parts = judged(report)
    facts.append(("Judged and cleared", parts) if parts else (words_of(machine).parts.capitalize(), _count(machine)))
    return facts


def _count(machine: MachineRow) -> str:
    wheels, axles = machine["wheels"], machine["axles"]
    return str(len(wheels)) + (f", {len(axles)} steering" if axles else "")
