"""Rows of the tables on what was judged and recorded: coverage, checks, limits, the loop, signals, files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from diagnosis.pages.labels import bounded, grouped, number
from diagnosis.report.judged_parts import kind_of
from diagnosis.report.units import DEGREES, on_page
from diagnosis.results.clearing import MAY_EXPLAIN, Check, lasts_in, share_covered, size_words
from diagnosis.results.clearing_rows import ClearingRow
from diagnosis.results.document import IntervalRow, MissingRow, ReportDocument, SignalRow
from diagnosis.results.durations import covered_s
from diagnosis.results.fault_rows import state_label
from diagnosis.results.log_rows import FileRow
from diagnosis.results.loop_rows import LoopRow, MetricsRow
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.vocabulary import Severity
from replay.faults import FAULT_STATES, UNDECIDED, Side, State

#: What the template is given.
Context = dict[str, Any]

_TOLD_S = 0.1  # of a fault in which nothing of it shows, from which on that is worth a word


def coverage_rows(report: ReportDocument) -> list[Context]:
    """How long each part was in which state, and why not decided."""
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
                "why": [
                    *why.get(key, []),
                    *_unseen(report["intervals"], key, faulty),
                    *_of_remarks(report["intervals"], key, faulty),
                ],
            }
        )
    return rows


def _of_remarks(faults: Sequence[IntervalRow], part: tuple[str, str], faulty: float) -> list[str]:
    """How much of a part's faulty time [s] is of remarks, which count for none on the timeline; empty where none is."""
    component, side = part
    own = [
        (f["start_s"], f["stop_s"])
        for f in faults
        if f["severity"] == Severity.INFO and f["component"] == component and side in Side(f["side"]).sides
    ]
    time = min(covered_s(own), faulty)
    return (
        [f"{time:.1f} s of its faulty time are remarks, which count for none on the timeline"]
        if time >= _TOLD_S
        else []
    )


def _meanwhile(report: ReportDocument, check: ClearingRow) -> str:
    """The faults that may explain why a check does not pass, to follow its time."""
    start, stop = check["start_s"], check["stop_s"]
    if check["passed"] or start is None or stop is None:
        return ""
    near = [
        f
        for f in report["intervals"]
        if share_covered(start, stop, (f["start_s"], f["stop_s"])) >= MAY_EXPLAIN and f["severity"] != Severity.INFO
    ]
    during = [f["id"] for f in near if lasts_in(start, stop, (f["start_s"], f["stop_s"]))]
    after = [f["id"] for f in near if f["id"] not in during and check["check"] != Check.JUMP]
    return "".join(f", {w} {', '.join(n)}" for w, n in (("at the time of", during), ("just after", after)) if n)


def _but_for(report: ReportDocument, check: ClearingRow) -> str:
    """The component's own faults, whose time a check that passes does not ask about, to follow its time."""
    own = [
        f["id"] for f in report["intervals"] if f["component"] == check["component"] and f["severity"] != Severity.INFO
    ]
    return f", but for the time of {', '.join(own)}" if check["passed"] and own else ""


def _unseen(faults: Sequence[IntervalRow], part: tuple[str, str], seen_s: float) -> list[str]:
    """How long the faults of a part last, where that is longer than it was seen to be faulty: between its traces it may not be judged."""
    mine = sorted(
        (f["start_s"], f["stop_s"]) for f in faults if f["component"] == part[0] and part[1] in Side(f["side"]).sides
    )
    lasting, end = 0.0, 0.0
    for start, stop in mine:
        lasting += max(0.0, stop - max(start, end))
        end = max(end, stop)
    rest = lasting - seen_s
    return [f"{rest:.1f} s of the {lasting:.1f} s that its faults last show nothing of them"] if rest >= _TOLD_S else []


def check_rows(report: ReportDocument) -> list[Context]:
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
                "when": (
                    "over the mission"
                    if start is None or stop is None
                    else f"{start:.1f}–{stop:.1f} s{_meanwhile(report, c)}"
                )
                + _but_for(report, c),
                "seldom": c["shows"] is not None and c["shows"] > report["limits"]["clear_at"] + 0.005,
                "shows": "–" if c["shows"] is None else f"from {100 * c['shows']:.0f} %",
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
    cells = [_three_digits(error["mission"]), _three_digits(error["driving"])]
    return cells + [_per_cent(x) for x in (effort["mission"], effort["driving"]) if commanded]


def _per_cent(share: float | None) -> str:
    return _three_digits(None if share is None else 100 * share)


def _three_digits(value: float | None) -> str:
    """A measured value with all of its three digits, zeros too, as the others of its column have them."""
    text = number(value)
    zeros = "" if value is None or "e" in f"{value:.3g}" else f"{value:#.3g}".removesuffix(".")
    return zeros.replace("-", "−") if "." in zeros else text


#: Unit of each limit of the machine file; absent: a plain number. ``{speed}`` is the machine's own.
_LIMIT_UNITS = {
    "brief": "s",
    "min_assessed": "s",
    "driving_speed": "{speed}",
    "min_sat": "{speed}{angles}, of commands as a share",
}
_SHARES = ("min_probability", "clear_at")
#: What each limit says, before the name that the machine file has for it.
_LIMIT_WORDS = {
    "brief": "a dead sensor is tolerable for",
    "min_probability": "a fault is stated from a probability of",
    "min_epsilon": "smallest loss that is a fault",
    "min_sat": "smallest saturation term that is one",
    "min_assessed": "judged for, at least, to be cleared",
    "driving_speed": "drives from",
    "clear_at": "loss that must have shown to clear a part",
}


def limit_rows(report: ReportDocument, words: MachineWords) -> list[tuple[str, str]]:
    """Limits of the machine file with their units."""
    out = []
    min_sat = report["limits"]["min_sat"]
    angles = f", of angles {number(DEGREES * min_sat)}°" if report["machine"]["axles"] else ""
    for key, value in report["limits"].items():
        unit = _LIMIT_UNITS.get(key, "").replace("{speed}", words.speed_unit).replace("{angles}", angles)
        size = value if isinstance(value, float) else float("nan")
        said = f"{100 * size:g} %" if key in _SHARES else f"{number(value)} {unit}".rstrip()
        out.append((f"{words_} ({key})" if (words_ := _LIMIT_WORDS.get(key)) else key.replace("_", " "), said))
    return out


def loop_tables(metrics: MetricsRow, words: MachineWords) -> Context:
    """Tracking error and control effort, beside the paper's table."""
    rows = [*metrics["wheels"].items(), ("Average", metrics["average"])]
    paper = [
        (p["controller"], [number(p["tracking_error"]), _per_cent(p["control_effort"]), number(p["parameters"])])
        for p in (metrics["paper"] if words.drive == "valve" else ())
    ]
    some = any(q["mission"] is not None for _, r in rows for q in (r["tracking_error"], r["control_effort"]))
    effort = any(r["control_effort"]["mission"] is not None for _, r in rows)
    shown = [(name, _cells(values, effort)) for name, values in rows] if some else []
    return {"rows": shown, "effort": effort, "paper": paper}


def signal_row(signal: SignalRow, words: MachineWords) -> Context:
    """One signal as the table shows it."""
    recorded, missing, step = signal["recorded_unit"], signal["missing_share"], signal["lsb"]
    unit, scale = on_page(signal["unit"], words)
    return {
        "name": signal["name"],
        "channel": signal["channel"] or "–",
        "unit": unit if unit == recorded or not recorded else f"{unit} (recorded {recorded})",
        "rate": f"{number(signal['rate_hz'], 4)} Hz",
        "samples": grouped(signal["samples"]),
        "gaps": f"{signal['gaps']}, longest {number(signal['longest_gap_s'])} s" if signal["gaps"] else "none",
        "missing": "–" if missing is None else f"{100 * missing:.2g} %",
        "lsb": f"{number(scale * step)} {unit}" if step else "–",
        "found": "guessed" if signal["guessed"] else "given",
        "poor": missing is not None and missing > 0.01,
    }


def missing_rows(rows: Sequence[MissingRow]) -> list[Context]:
    """Missing signals that cost the same stand in one row."""
    names: dict[str, list[str]] = {}
    for row in rows:
        names.setdefault(row["cost"], []).append(row["name"])
    return [{"names": n, "cost": cost} for cost, n in names.items()]


def file_row(file: FileRow) -> Context:
    """One file of the mission."""
    return {
        "path": file["path"],
        "format": file["format"],
        "sha256": file["sha256"] or "–",
        "size": f"{grouped(file['bytes'])} bytes",
        "notes": [*file["damage"], *file["notes"]],
        "heading": "Left out"
        if file["damage"] and file["damage"] == file.get("left_out")
        else "Damage"
        if file["damage"]
        else "Notes",
    }
